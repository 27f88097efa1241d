"""How steadily the rover stands, over REST: as it stands, along a plan, and what is not there."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.balance.region import equilibrium_region, region_margin
from footfall.core.errors import NotFound
from footfall.core.frames import apply
from footfall.maps.standing import contacts
from footfall.planning.body.stand import stand
from footfall.robot.description import with_payload
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.robot.model import Robot
from footfall.session.core import present
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.steadiness import along, judged
from footfall.telemetry.state import TelemetryFrame
from tests.support.chassis_ground import wavy
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.waiting import until

LEG = 2


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """(client, session): with a planned step, and a sequence of it."""

    def prepare(sessions: Sessions) -> None:
        live = sessions.create("standing")
        dem = wavy(half=4.0)
        live.terrains.load(dem, "made for the tests")
        stood = stand(live.robot, dem)
        live.stances.set(stood)
        x, y, _ = apply(stood.T_site_base, wheel_centers(live.robot, stood.posture))[LEG]
        live.maps.choose_footfall(LEG, float(x) + 0.1, float(y) + 0.1)
        live.plans.step(LEG).finish()
        live.sequences.make()

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running, running.client() as client:
        live = running.sessions.current
        assert live is not None
        yield client, live


def test_before_telemetry_it_is_the_state_that_is_planned_from(served):
    client, live = served
    answer = client.get("/sessions/current/steadiness").json()
    assert answer["measured"] is False
    assert answer["legs"] == [0, 1, 2, 3, 4, 5]
    state, dem, robot = live.get(live.state.state), live.get(live.state.dem), live.robot
    feet = contacts(robot, dem, state.posture, state.T_site_base, robot.legs)
    com = apply(state.T_site_base, center_of_mass(robot, state.posture))
    assert answer["com"] == pytest.approx(com)
    found = region_margin(equilibrium_region(feet.points, feet.normals, answer["friction"]), com[:2])
    assert answer["margins"]["friction"] == pytest.approx(found.margin, abs=2e-3)
    assert answer["known"] == {"plain": True, "conservative": True, "friction": True}


def test_a_course_has_its_worst_moments(served):
    client, live = served
    for digest in (live.state.plan, live.state.sequence):
        course = client.get(f"/sessions/current/steadiness/{digest}").json()
        assert course["digest"] == digest
        for name, margins in course["margins"].items():
            worst = course["worst"][name]
            assert worst["margin"] == min(margins)
            at = margins.index(worst["margin"])
            assert (worst["moment"], worst["row"]) == (course["moments"][at], course["rows"][at])
    assert client.get("/sessions/current/steadiness/current").json()["digest"] == live.review.played


def test_a_course_is_told_once(served):
    client, live = served
    address = f"/sessions/current/steadiness/{live.state.plan}"
    tag = client.get(address).headers["ETag"]
    assert client.get(address, headers={"If-None-Match": tag}).status_code == 304


def test_the_standing_rover_carries_what_maps_or_commands_say(served, monkeypatch):
    client, live = served
    state = live.get(live.state.state)

    def com_with(mass: float, place: list[float]) -> np.ndarray:
        robot = Robot(with_payload(live.robot.description, mass, position=np.array(place)))
        return apply(state.T_site_base, center_of_mass(robot, state.posture))

    def stands() -> dict:
        return client.get("/sessions/current/steadiness").json()

    carried, place = 150.0, [0.3, 0.9, 0.3]
    commands = live.get(live.state.sequence)
    said = replace(
        commands.provenance.settings, compliance=None, payload_mass=carried, payload_position=np.array(place)
    )
    laden = replace(commands, provenance=replace(commands.provenance, settings=said))
    before = stands()
    get = live.get
    monkeypatch.setattr(live, "get", lambda digest: laden if digest == live.state.sequence else get(digest))
    assert stands()["com"] == pytest.approx(com_with(carried, place))
    # what the colours are made with comes first
    others, there = 80.0, [-0.5, 0.0, 0.4]
    balance = {"payload_mass": others, "payload_position": there}
    job = client.post("/sessions/current/maps", json={"leg": LEG, "settings": {"balance": balance}}).json()
    until(lambda: client.get(f"/jobs/{job['id']}").json()["state"] == "done", "the maps")
    client.put("/sessions/current/view", json={"leg": LEG}).raise_for_status()
    found = stands()
    assert found["com"] == pytest.approx(com_with(others, there))
    assert found["margins"]["plain"] != pytest.approx(before["margins"]["plain"], abs=0.01)


def test_what_does_not_move_has_no_course(served):
    client, live = served
    problem(client.get(f"/sessions/current/steadiness/{live.state.dem}"), 404, "not-found")
    far = {"leg": LEG, "x": 3.9, "y": 3.9}
    client.post("/sessions/current/footfalls", json=far).raise_for_status()
    planned = live.plans.step(LEG).finish()
    refused = problem(client.get(f"/sessions/current/steadiness/{planned}"), 409, "conflict")
    assert "there is no plan, so nothing moves" in refused["detail"]


def test_telemetry_says_which_wheels_bear(served):
    _, live = served
    state = live.get(live.state.state)
    forces = np.tile([0.0, 0.0, 1400.0], (6, 1))
    forces[LEG] = 0.0
    live.rover.take_telemetry(TelemetryFrame(1, replace(state, wheel_forces=forces), state.posture))
    found = judged(live)
    assert found.measured
    assert found.support.legs == (0, 1, 3, 4, 5)


def test_without_state_there_is_nothing_to_judge(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("empty")
        with pytest.raises(NotFound, match="no telemetry yet"):
            judged(live)
        robot = live.robot
        dem = wavy(half=4.0)
        live.stances.set(stand(robot, dem))
        found = judged(live)
        assert np.isnan(found.margins["friction"])
        assert found.margins["plain"] > 1.0
        with pytest.raises(NotFound, match="is neither a plan, a walk nor a sequence with commands"):
            along(live, present(live.state.state, "no state"))
