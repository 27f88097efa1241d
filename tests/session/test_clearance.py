"""Clearance as a session measures it from telemetry, against what was commanded and predicted."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import predict
from footfall.robot.kinematics import wheel_centers
from footfall.session import least_clearances
from footfall.session.jobs.local import InlineJobs
from footfall.session.least_clearances import EVERY
from footfall.session.registry import Sessions
from footfall.session.wheel_clearance import clearances
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.swinging import Swinging
from tests.support.waiting import BOUND, until

LEG = 2


class Driven:
    """A session whose step is on its way; ``tell`` says where the rover is and what it is commanded."""

    def __init__(self, live, rover, plan):
        self.live, self.count = live, 0
        live.plans.step(LEG, plan).finish()

    def send(self, digest, state, commanded):
        live = self.live
        live.rover.connected(lambda _: None)
        live.sequences.make(digest, as_commanded=digest == live.state.plan)
        self.tell(state, commanded)
        live.commands.send(live.commands.arm()["token"])

    def tell(self, state, commanded):
        self.live.rover.take_telemetry(TelemetryFrame(self.count, state, commanded))
        self.count += 1
        return clearances(self.live, self.live.rover)


@pytest.fixture(scope="module")
def dem():
    return plane(size=10.0, resolution=0.1)


@pytest.fixture(scope="module")
def rest(athlete, dem):
    from footfall.planning.body.stand import stand

    stood = stand(athlete, dem)
    return CompliantRover(athlete, dem).let_down(stood.posture, stood.T_site_base)


@pytest.fixture
def driven(tmp_path, athlete, dem, rest):
    state = CompliantRover(athlete, dem).state(rest)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as sessions:
        live = sessions.create("clearance")
        live.terrains.load(dem)
        live.stances.set(state)
        yield Driven(live, state, (float(x) + 0.1, float(y) - 0.3))


def told_by(robot, posture, T_site_base, forces):
    nothing = np.zeros(len(posture))
    return RobotState(robot.name, 0.0, posture, T_site_base, forces, nothing, "moving")


def test_nothing_is_said_without_telemetry_ground_or_a_wheel_in_the_air(driven, athlete, dem, rest):
    found = clearances(driven.live, driven.live.rover)
    assert (found.time, found.wheels) == (None, ())
    assert "no telemetry" in found.reason
    state = CompliantRover(athlete, dem).state(rest)
    found = driven.tell(state, rest.commanded)
    assert (found.time, found.reason, found.wheels) == (0.0, "no wheel is in the air", ())
    # a rover that reports no forces, and was sent nothing
    found = driven.tell(replace(state, wheel_forces=0 * state.wheel_forces), rest.commanded)
    assert found.wheels == ()
    driven.live.rover.take_telemetry(TelemetryFrame(9, state, rest.commanded), at=-1000.0)
    found = clearances(driven.live, driven.live.rover)
    assert (found.time, found.wheels) == (None, ())
    assert "s old" in found.reason


def test_as_predicted_it_is_measured_and_a_softer_rover_is_marked(driven, athlete, dem, rest):
    live = driven.live
    state = CompliantRover(athlete, dem).state(rest)
    digest = live.executions.plan().finish()
    done = live.get(digest).execution
    driven.send(digest, state, rest.commanded)
    swings = [at for at, phase in enumerate(done.phases) if phase == "swing"]
    at = min(swings, key=lambda one: done.clearance[one])

    told = told_by(athlete, done.predicted[at], done.Ts_site_base[at], done.forces[at])
    (wheel,) = driven.tell(told, done.commanded[at]).wheels
    assert (wheel.leg, wheel.rigid, wheel.low) == (LEG, False, False)
    assert wheel.predicted == pytest.approx(done.clearance[at])
    assert wheel.less == pytest.approx(done.clearance_uncertainty[at])
    assert wheel.seen.clearance == pytest.approx(wheel.predicted, abs=1e-9)
    # were nothing to sag, it would be as much higher as the chassis and the leg give way
    hub = apply(done.Ts_site_base[0], wheel_centers(athlete, done.commanded[at])[LEG])
    assert wheel.commanded == pytest.approx(hub[2] - athlete.wheel_radius, abs=1e-6)
    assert wheel.commanded > wheel.predicted

    # the same set points, sent to a rover whose joints are half as stiff as was thought
    soft = CompliantRover(athlete, dem, ComplianceSettings(joint_scale=0.5))
    start = measured(soft, state, rest.commanded, fitted=False)
    there = predict(soft, start, done.commanded[: at + 1]).rests[-1]
    (wheel,) = driven.tell(told_by(athlete, there.posture, there.T_site_base, there.forces), done.commanded[at]).wheels
    hub = there.hubs[LEG]
    assert wheel.seen.clearance == pytest.approx(hub[2] - athlete.wheel_radius, abs=1e-6)
    assert wheel.predicted - wheel.seen.clearance > wheel.seen.uncertainty
    assert wheel.low

    # set points that are no part of it: nothing was predicted for them
    other = done.commanded[at].copy()
    other[6 * LEG + 1] += 0.3
    (wheel,) = driven.tell(told, other).wheels
    assert (wheel.predicted, wheel.less, wheel.commanded, wheel.low) == (None, None, None, False)
    assert wheel.seen is not None


def test_commands_that_take_the_rover_as_rigid_predict_what_they_command(driven, athlete, dem, rest):
    live = driven.live
    state = CompliantRover(athlete, dem).state(rest)
    plan = live.get(live.state.plan).plan
    driven.send(live.state.plan, state, state.posture)
    at = len(plan.waypoints) // 2
    forces = np.tile((0.0, 0.0, 2000.0), (athlete.leg_count, 1))
    forces[LEG] = 0.0
    told = told_by(athlete, plan.waypoints[at], plan.T_site_base, forces)
    (wheel,) = driven.tell(told, plan.waypoints[at]).wheels
    assert wheel.rigid
    assert wheel.commanded == wheel.predicted == wheel.seen.clearance
    lower = plan.T_site_base.copy()
    lower[2, 3] -= 0.01
    (wheel,) = driven.tell(told_by(athlete, plan.waypoints[at], lower, forces), plan.waypoints[at]).wheels
    assert wheel.seen.clearance == pytest.approx(wheel.predicted - 0.01)
    # without forces the row on its way says which leg it is
    first = live.get(live.state.sequence).commands[0].leg
    found = driven.tell(told_by(athlete, plan.waypoints[at], plan.T_site_base, 0 * forces), plan.waypoints[at])
    assert [one.leg for one in found.wheels] == ([] if first is None else [first])


@pytest.fixture
def swinging(driven):
    live = driven.live
    live.sequences.make(live.state.plan, as_commanded=True)
    return Swinging(live)


def least(live, looks):
    """What is told of the present run, once so many frames of a swing were looked at."""

    def told():
        found = live.commands.run["least_clearances"]
        assert found["looks"] <= looks
        return found["looks"] == looks and found

    return until(told, f"{looks} looks")


def test_the_least_of_a_run_is_of_its_swings_alone_and_is_kept_when_it_has_ended(driven, swinging):
    live, row = driven.live, swinging.row
    swinging.tell(1.0, lower=0.05)  # before it
    swinging.begin(1)
    swinging.tell(2.0, lower=0.05)  # nothing was sent yet
    swinging.send(1, swinging.phases.index("lift"))
    swinging.tell(3.0, lower=0.05)  # on its way up a wheel is near the ground whatever it does
    swinging.send(1, row)
    rims = [swinging.tell(4.0 + EVERY * i, lower) for i, lower in enumerate((0.0, 0.02, 0.01))]
    swinging.tell(4.0 + 2.5 * EVERY, lower=0.05)  # nearer than EVERY to the one before
    found = least(live, looks=3)
    assert (found["every_s"], found["missed"]) == (EVERY, 0)
    (wheel,) = found["wheels"]
    assert wheel["leg"] == swinging.leg == LEG
    assert wheel["measured"]["clearance"] == pytest.approx(min(rims), abs=1e-9)
    assert wheel["commanded"] == wheel["predicted"] == pytest.approx(rims[0], abs=1e-6)
    swinging.end(1)
    swinging.tell(9.0, lower=0.05)
    assert least(live, looks=3) == found

    swinging.begin(2)
    assert least(live, looks=0)["wheels"] == []
    swinging.send(2, row)
    rim = swinging.tell(2.0, lower=0.03)  # a clock that was set back keeps nothing from being looked at
    (wheel,) = least(live, looks=1)["wheels"]
    assert wheel["measured"]["clearance"] == pytest.approx(rim, abs=1e-9)


def test_what_can_not_be_measured_is_counted_as_missed_and_logged(driven, swinging, monkeypatch, caplog):
    live = driven.live
    swinging.begin(1)
    swinging.send(1, swinging.row)
    swinging.tell(1.0)
    found = least(live, looks=1)

    def broken(*_):
        raise OSError("the disk is gone")

    monkeypatch.setattr("footfall.session.least_clearances.clearances_by", broken)
    swinging.tell(2.0, lower=0.02)
    until(lambda: live.commands.run["least_clearances"]["missed"] == 1, "the look that failed")
    assert "the disk is gone" in caplog.text
    assert least(live, looks=1) == found | {"missed": 1}


def test_more_than_may_wait_are_missed_and_counted(driven, swinging, monkeypatch):
    live, may = driven.live, threading.Event()
    measure = least_clearances.clearances_by

    def slow(*given):
        assert may.wait(BOUND)
        return measure(*given)

    monkeypatch.setattr(least_clearances, "clearances_by", slow)
    monkeypatch.setattr(least_clearances, "MOST_WAITING", 2)
    swinging.begin(1)
    swinging.send(1, swinging.row)
    for i in range(5):
        swinging.tell(float(i))
    assert live.commands.run["least_clearances"]["missed"] == 3
    may.set()
    assert least(live, looks=2)["missed"] == 3
