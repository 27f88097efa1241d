"""What a new kind of product costs the interface: an entry in its table; routes, roles and addresses follow."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.api.access import BASE
from footfall.api.assemble import assemble
from footfall.api.auth.roles import declared, needed
from footfall.api.bodies import answer_models
from footfall.api.bodies.schemas import WhatIfOrder
from footfall.api.bodies.settings_models import settings_value
from footfall.api.kinds import SERVED, Asked, folder_of
from footfall.api.routes import products
from footfall.planning.body.body_shift import BodyShift
from footfall.session.access.identity import Role
from footfall.session.answers.fits import UpToDateAnswer
from footfall.session.answers.sessions import SessionAnswer
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.products.kinds import GROUND, KINDS, Kind
from footfall.session.registry import Sessions
from footfall.telemetry.state import RobotState
from footfall.terrain.generate import plane
from tests.support.local import Local

BEARS = np.zeros((6, 3)), np.zeros(36)


def echo(parents, settings, progress):
    return replace(parents["state"], time=settings.dx)


@pytest.fixture
def served(monkeypatch, tmp_path, athlete):
    kind = Kind("echo", "RobotState", "BodyShift", GROUND, f"{__name__}:echo", from_the_rover=True, watched=True)
    entry = Asked(
        folder="echoes",
        tag="stances",
        verb="make",
        text="The state at another time, as a job.",
        order=WhatIfOrder,
        answer=RobotState,
        ask=lambda live, order: live.stances.ask(kind, settings_value(BodyShift, order)),
    )
    monkeypatch.setitem(KINDS, kind.name, kind)
    monkeypatch.setitem(SERVED, kind, entry)
    monkeypatch.setattr(products, "router", products.routes())
    answer_models._model.cache_clear()
    pool = InlineJobs()
    monkeypatch.setattr(pool, "_recipes", PRODUCTS)
    with Sessions(tmp_path, pool, robot=athlete) as sessions:
        live = sessions.create("echoes")
        live.terrains.load(plane(size=4.0, resolution=0.5))
        live.stances.set(RobotState(athlete.name, 0.0, athlete.posture("stand"), np.eye(4), *BEARS, "idle"))
        yield Local(assemble(sessions))
    answer_models._model.cache_clear()


def test_a_new_kind_is_ordered_described_and_read(served):
    told = served.post("sessions/current/echoes", json={"dx": 0.25})
    assert told.status_code == 202, told.text
    job = served.get(told.headers["location"]).json()
    assert (job["kind"], job["state"]) == ("echo", "done"), job
    assert job["result_url"] == f"{BASE}/sessions/{job['session']}/echoes/{job['result']}"
    for name in (job["result"], "current"):
        assert served.get(f"sessions/current/echoes/{name}").json()["time"] == 0.25
    summary = served.get("sessions/current").json()
    assert summary["echo"] == job["result"]
    assert summary["up_to_date"]["echo"]["fits"]
    document = served.get("openapi.json").json()
    operations = document["paths"][f"{BASE}/sessions/{{session}}/echoes"]
    assert (operations["post"]["operationId"], operations["post"]["tags"]) == ("stances_make_echo", ["stances"])
    for answer in (SessionAnswer, UpToDateAnswer):
        assert "echo" in answer_models.answer_model(answer).model_fields


def test_a_new_kind_is_for_the_role_that_its_entry_says(served):
    route = "POST /sessions/{session}/echoes"
    assert route in declared()
    assert needed(*route.split(" ")) is Role.PLANNER


def test_every_kind_that_is_served_has_its_entry_and_its_address():
    assert set(SERVED) <= set(KINDS.values())
    assert {kind.name for kind in set(KINDS.values()) - set(SERVED)} == {"outcome"}
    assert {name for name in KINDS if not folder_of(name)} == {
        *("after", "what_if", "foot_moves", "sequence", "outcome", "edit", "import", "export")
    }
    assert folder_of("views") == ""
