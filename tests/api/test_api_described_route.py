"""A route of a hexapod that others described over REST, a walk along it, its commands, and the replay of all that."""

import httpx
import numpy as np
import pytest

from footfall.planning.legged.problem import LeggedResult
from footfall.session.replay.recompute import replay
from tests.support.described import robot_of
from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.server import Running, running_server
from tests.support.walled import GOAL, walled

SESSION = "/sessions/current"
TO = {"x": GOAL[0], "y": GOAL[1]}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    def prepare(sessions) -> None:
        live = sessions.create("around a wall", robot_of(6)[1])
        live.terrains.load(walled(), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


@pytest.fixture(scope="module")
def rest(server: Running):
    with server.client() as client:
        assert client.post(f"{SESSION}/state", json={"stand": {}}).status_code == 201
        yield client


@pytest.fixture(scope="module")
def route(rest: httpx.Client):
    answer = result(rest, finished(rest, rest.post(f"{SESSION}/routes", json={"goal": TO})))
    assert answer["status"] == "found", answer["reason"]
    return answer


def test_a_route_is_judged_by_the_size_of_the_robot(rest, route):
    settings, length = route["provenance"]["settings"], robot_of(6)[1].length
    assert settings["highest"] < 0.25 * length
    told = rest.get(SESSION).json()
    assert told["route"] == route["digest"]
    assert told["up_to_date"]["route"]["fits"], told["up_to_date"]["route"]
    order = {"goal": TO, "settings": {"worst": 0.3, "maps": {"slope_limit": 0.3}}}
    other = result(rest, finished(rest, rest.post(f"{SESSION}/routes", json=order)))["provenance"]["settings"]
    assert (other["worst"], other["maps"]["slope_limit"]) == (0.3, 0.3)
    assert (other["highest"], other["maps"]["window"]) == (settings["highest"], settings["maps"]["window"])


def test_a_walk_goes_along_it_and_replays_to_the_same(server, rest, route):
    order = {"goal": TO, "route": route["digest"]}
    walk = result(rest, finished(rest, rest.post(f"{SESSION}/described-walks", json=order)))
    assert walk["status"] == "found", walk["reason"]
    assert walk["provenance"]["parents"]["route"] == route["plan"]["digest"]
    np.testing.assert_allclose(np.array(walk["plan"]["end"]["T_site_base"])[:2, 3], GOAL, atol=0.15)
    made = rest.post(f"{SESSION}/sequences", json={"plan": walk["digest"]})
    assert made.status_code == 201, made.text
    assert made.json()["valid"], [one for one in made.json()["rules"] if not one["holds"]]
    live = server.sessions.current
    assert live.typed(LeggedResult, walk["digest"]).plan is not None
    report = replay(live.export_bundle())
    assert report.ok, report.lines()
    assert {one.verdict for one in report.products} == {"same"}
    assert {"route", "described_walk", "sequence"} <= {one.kind for one in report.products}


def test_routes_that_no_walk_can_go_along_are_refused(rest, route):
    def refused(status: int, kind: str, **order) -> str:
        answer = rest.post(f"{SESSION}/described-walks", json={"goal": TO, **order})
        return problem(answer, status, kind)["detail"]

    assert "holds no value" in refused(404, "not-found", route="0" * 32)
    off = result(rest, finished(rest, rest.post(f"{SESSION}/routes", json={"goal": {"x": 9.0, "y": 0.0}})))
    assert off["status"] == "off_map"
    assert "that route was not found" in refused(422, "invalid-input", route=off["digest"])
    elsewhere = {"goal": {"x": 0.3, "y": 0.0}, "route": route["digest"]}
    job = finished(rest, rest.post(f"{SESSION}/described-walks", json=elsewhere), "failed")
    assert "from the goal: plan one to it" in job["error"]["message"]


def test_the_cost_of_athletes_legs_is_refused(rest):
    order = {"goal": TO, "settings": {"cost": "feasible"}}
    job = finished(rest, rest.post(f"{SESSION}/routes", json=order), "failed")
    assert 'cost by "goodness"' in job["error"]["message"]
