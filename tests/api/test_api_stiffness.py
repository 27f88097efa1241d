"""Over REST: clearance as it is measured, and the measured stiffness taken over, in force, and undone."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.planning.body.stand import stand
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.robot.kinematics import wheel_centers
from footfall.session.registry import Sessions
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.sagging import stepped
from tests.support.server import running_server

LEG = 2
SESSION = "/sessions/current"


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """(client, session, state, rest): a rover that sags on level ground, its step planned."""
    held = {}

    def prepare(sessions: Sessions) -> None:
        live = sessions.create("sagging")
        dem = plane(size=10.0, resolution=0.1)
        live.terrains.load(dem)
        rover, stood = CompliantRover(live.robot, dem), stand(live.robot, dem)
        rest = rover.let_down(stood.posture, stood.T_site_base)
        state = rover.state(rest)
        live.stances.set(state)
        x, y, _ = apply(state.T_site_base, wheel_centers(live.robot, state.posture))[LEG]
        live.plans.step(LEG, (float(x) + 0.1, float(y) - 0.3)).finish()
        live.rover.connected(lambda _: None)
        held.update(state=state, rest=rest)

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running, running.client() as client:
        live = running.sessions.current
        assert live is not None
        yield client, live, held["state"], held["rest"]


def commanded(client, settings=None):
    job = finished(client, client.post(f"{SESSION}/executions", json={"settings": settings}))
    return result(client, job)["settings"]["compliance"]


def test_the_measured_stiffness_is_taken_over(served):
    client, live, state, rest = served
    problem(client.post(f"{SESSION}/sag/take-over", json={}), 409, "conflict")
    for body in ({"joint_scale": "soft"}, {"scale": 1.0}, {"joint_scale": True}):
        problem(client.post(f"{SESSION}/sag/take-over", json=body), 422, "validation")
    stepped(live, state, rest.commanded, 1.25)
    sag = client.get(f"{SESSION}/sag").json()
    assert sag["ratio"] == pytest.approx(1.25)
    assert sag["refused"] == ""
    told = sag["calibration"]
    assert (told["was"], told["steps"]) == (1.0, 1)
    assert told["now"] == pytest.approx(0.8)
    other = problem(client.post(f"{SESSION}/sag/take-over", json={"joint_scale": 0.5}), 409, "conflict")
    assert "look at it again" in other["detail"]
    assert client.get(SESSION).json()["joint_scale"] == 1.0
    taken = client.post(f"{SESSION}/sag/take-over", json={"joint_scale": told["now"]})
    assert taken.status_code == 200, taken.text
    assert taken.json() == told
    summary = client.get(SESSION).json()
    assert summary["joint_scale"] == told["now"]
    assert summary["undo"]["kind"] == "stiffness"
    (event,) = [one for one in client.get(f"{SESSION}/log").json()["events"] if one["type"] == "stiffness_taken_over"]
    assert event["payload"]["by"]["name"] == "local"
    live.rover.take_telemetry(TelemetryFrame(900, state, rest.commanded))
    # where the order does not say; else what it says
    assert commanded(client)["joint_scale"] == told["now"]
    assert commanded(client, {"compliance": {"wheel_scale": 0.9}})["joint_scale"] == told["now"]
    assert commanded(client, {"compliance": {"joint_scale": 1.0}})["joint_scale"] == 1.0
    undone = client.post(f"{SESSION}/undo", json={})
    assert undone.json()["choice"]["kind"] == "stiffness"
    assert client.get(SESSION).json()["joint_scale"] == 1.0
    assert commanded(client, {"mode": "pose_held"})["joint_scale"] == 1.0


def test_what_is_gone_on_from_is_what_was_made_last(served):
    client, live, _, _ = served
    finished(client, client.post(f"{SESSION}/executions", json={}))
    from_it = client.get(SESSION).json()["ends"]["go_on"]
    assert from_it == {"digest": live.state.execution, "of": "execution", "sags": True}
    gone = client.put(f"{SESSION}/what-if/after", json={"after": None}).json()["state"]
    summary = client.get(SESSION).json()
    assert summary["after"] == live.state.execution == summary["ends"]["after"]["digest"]
    assert np.array_equal(live.get(gone).posture, live.get(live.state.execution).execution.predicted[-1])
    client.delete(f"{SESSION}/what-if")


def test_the_clearance_of_a_wheel_in_the_air(served):
    client, live, state, rest = served
    live.rover.take_telemetry(TelemetryFrame(1000, state, rest.commanded))
    assert client.get(f"{SESSION}/clearance").json() == {"time": 0.0, "reason": "no wheel is in the air", "wheels": []}
    sequence = live.get(live.sequences.make(live.executions.plan().finish()))
    live.rover.take_telemetry(TelemetryFrame(1001, state, rest.commanded))
    live.commands.send(live.commands.arm()["token"])
    row = max(range(len(sequence.commands)), key=lambda one: sequence.commands[one].phase == "swing")
    forces = state.wheel_forces.copy()
    forces[LEG] = 0.0
    there = replace(state, posture=sequence.predicted[row], T_site_base=sequence.poses[row], wheel_forces=forces)
    live.rover.take_telemetry(TelemetryFrame(1002, there, sequence.commanded[row]))
    (wheel,) = client.get(f"{SESSION}/clearance").json()["wheels"]
    measured = wheel["measured"]
    hub = apply(there.T_site_base, wheel_centers(live.robot, there.posture))[LEG]
    assert measured["clearance"] == pytest.approx(hub[2] - live.robot.wheel_radius, abs=1e-6)
    assert (measured["ground"], measured["whole"]) == (None, True)
    parts = np.hypot(measured["joints"], measured["pose"])
    assert measured["uncertainty"] == pytest.approx(1.96 * parts)
    assert (wheel["leg"], wheel["rigid"], wheel["low"]) == (LEG, False, False)
    assert wheel["predicted"] == pytest.approx(measured["clearance"], abs=2e-3)
    assert wheel["commanded"] > wheel["predicted"]
    assert wheel["less"] > 0
