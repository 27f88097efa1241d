"""The kinematic rover moves all its legs, and lowers one until it meets the ground: as was predicted, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import footfall
from footfall.core.frames import apply
from footfall.maps.standing import wheel_gaps
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.planning.body.follow import DRIFT
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Command
from footfall.sequence.make import make_sequence
from footfall.sequence.passage import passages
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import CommandMessage, decode, encode
from footfall.telemetry.state import RobotState
from tests.support.chassis_ground import lifted, wavy

LEG = 2
OWN = slice(6 * LEG, 6 * LEG + 6)


@pytest.fixture(scope="module")
def dem():
    return wavy(half=5.0)


@pytest.fixture(scope="module")
def stood(athlete, dem) -> RobotState:
    """Low enough that a leg reaches under the ground."""
    low = footfall.shifted_state(athlete, dem, footfall.stand(athlete, dem), BodyShift(dz=-0.4))
    assert isinstance(low, PredictedState)
    return RobotState("athlete", 1000.0, low.posture, low.T_site_base, low.wheel_forces, low.joint_torques, "idle")


def sent(row: int, command: Command) -> CommandMessage:
    """The command as it arrives: through the link's text."""
    message = CommandMessage(
        f"c{row}", "s", row, command.name, command.leg, command.joints, command.duration, command.force
    )
    arrived = decode(encode(message), legs=6)
    assert isinstance(arrived, CommandMessage)
    return arrived


def carry_out(rover: SimulatedRover, row: int, command: Command, dt: float = 0.05) -> list[str]:
    acks = rover.command(sent(row, command))
    while rover.mode == "moving":
        acks += rover.step(dt)
    return [ack.state for ack in acks]


@settings(max_examples=6)
@given(shift=st.tuples(*(st.floats(-0.08, 0.08) for _ in range(6))), dt=st.sampled_from([0.05, 0.1, 0.37]))
def test_a_move_of_the_chassis_arrives_where_it_was_planned_to(athlete, dem, stood, shift, dt):
    result = footfall.plan_body_move(athlete, dem, stood, BodyShift(*shift))
    if result.plan is None:
        return
    sequence = make_sequence(result.plan, athlete, dem)
    assert sequence.valid, sequence.failures
    rover = SimulatedRover(athlete, dem, stood)
    feet = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))
    for row, command in enumerate(sequence.commands):
        rover.command(sent(row, command))
        while rover.mode == "moving":
            before = rover.posture.copy()
            rover.step(dt)
            assert (np.abs(rover.posture - before) <= athlete.speed_limits * dt + 1e-12).all()
            state = rover.state()
            away = apply(state.T_site_base, wheel_centers(athlete, state.posture)) - feet
            assert np.linalg.norm(away, axis=1).max() < DRIFT
        assert rover.mode == "idle"
        assert np.array_equal(rover.posture, sequence.predicted[row])
        assert np.array_equal(rover.state().T_site_base, sequence.poses[row])
    np.testing.assert_allclose(rover.state().T_site_base, result.plan.Ts_site_base[-1], atol=1e-9)
    weight = athlete.mass * 9.81
    assert rover.state().wheel_forces[:, 2].sum() == pytest.approx(weight, rel=1e-3)


def test_a_stop_leaves_chassis_and_legs_in_agreement(athlete, dem, stood):
    plan = footfall.plan_body_move(athlete, dem, stood, BodyShift(dz=-0.1)).plan
    assert plan is not None
    rover = SimulatedRover(athlete, dem, stood)
    rover.command(sent(0, Command("POSTURE_MOVE", None, plan.waypoints[-1], 8.0)))
    rover.step(3.0)
    (ack,) = rover.stop()
    assert "38%" in ack.reason
    frozen = rover.state()
    assert 0.01 < stood.T_site_base[2, 3] - frozen.T_site_base[2, 3] < 0.09
    rover.step(1.0)
    assert np.array_equal(rover.state().T_site_base, frozen.T_site_base)
    assert np.array_equal(rover.posture, frozen.posture)
    # and back: the feet are where they were
    rover.clear_stop()
    assert carry_out(rover, 1, Command("POSTURE_MOVE", None, stood.posture, 8.0)) == ["received", "started", "done"]
    np.testing.assert_allclose(rover.state().T_site_base, stood.T_site_base, atol=1e-4)


def test_wheels_on_ground_that_the_terrain_lacks_still_carry_after_a_move(athlete, dem, stood):
    heights = np.array(dem.heights)
    foot = apply(stood.T_site_base, wheel_centers(athlete, stood.posture)[1])[:2]
    heights[np.linalg.norm(dem.geometry.centers() - foot, axis=2) < 0.8] = np.nan
    holed = replace(dem, heights=heights)
    plan = footfall.plan_body_move(athlete, dem, stood, BodyShift(dz=-0.05)).plan
    assert plan is not None
    rover = SimulatedRover(athlete, holed, stood)
    assert rover.state().wheel_forces[1, 2] > 0
    for row, posture in enumerate(plan.waypoints[1:]):
        assert carry_out(rover, row, Command("POSTURE_MOVE", None, posture, 1.0))[-1] == "done"
    assert rover.state().wheel_forces[1, 2] > 0
    up = lifted(athlete, rover.state(), [1], 0.1).posture[6:12]
    assert carry_out(rover, 99, Command("LEG_MOVE", 1, up, 2.0))[-1] == "done"
    assert rover.state().wheel_forces[1, 2] == 0


@settings(max_examples=5)
@given(height=st.floats(0.05, 0.2), deep=st.floats(0.01, 0.1), dt=st.sampled_from([0.2, 0.5]))
def test_a_lowered_leg_freezes_where_its_wheel_meets_the_ground(athlete, dem, stood, height, deep, dt):
    rover = SimulatedRover(athlete, dem, stood)
    up = Command("LEG_MOVE", LEG, lifted(athlete, stood, [LEG], height).posture[OWN], 5.0)
    down = Command("LEG_LOWER", LEG, lifted(athlete, stood, [LEG], -deep).posture[OWN], 5.0, "lower", 200.0)
    way = passages(athlete, stood.posture, stood.T_site_base, (up, down), dem)
    assert carry_out(rover, 0, up, dt)[-1] == "done"
    began = rover.time
    assert rover.command(sent(1, down))[-1].state == "started"
    assert rover.frame().commanded[OWN].tolist() == (down.joints.tolist() if down.joints is not None else None)
    while rover.mode == "moving":
        assert wheel_gaps(athlete, dem, rover.posture, stood.T_site_base, [LEG])[0] > 0
        rover.step(dt)
    assert rover.time - began < 5.0 + dt
    assert np.array_equal(rover.posture, way[1].after)
    assert wheel_gaps(athlete, dem, rover.posture, stood.T_site_base, [LEG])[0] == pytest.approx(0.0, abs=1e-6)
    assert np.array_equal(rover.frame().commanded, rover.posture)
    assert rover.state().wheel_forces[LEG, 2] > 0


def test_a_lowered_leg_that_meets_nothing_ends_at_its_angles(athlete, dem, stood):
    rover = SimulatedRover(athlete, dem, stood)
    high, lower = (lifted(athlete, stood, [LEG], by).posture[OWN] for by in (0.3, 0.1))
    assert carry_out(rover, 0, Command("LEG_MOVE", LEG, high, 5.0))[-1] == "done"
    assert carry_out(rover, 1, Command("LEG_LOWER", LEG, lower, 5.0, "", 200.0))[-1] == "done"
    assert np.array_equal(rover.posture[OWN], lower)
    assert rover.state().wheel_forces[LEG, 2] == 0


def test_drawing_up_a_side_tips_the_rover(athlete, dem, stood):
    rover = SimulatedRover(athlete, dem, stood)
    one_side = lifted(athlete, stood, [0, 1, 5], 0.15).posture
    assert carry_out(rover, 0, Command("POSTURE_MOVE", None, one_side, 5.0))[-1] == "refused"
    assert rover.mode == "fault"


def test_what_is_no_such_command_is_refused_by_name(athlete, dem, stood):
    rover = SimulatedRover(athlete, dem, stood)
    beyond = stood.posture.copy()
    beyond[14] = athlete.upper[14] + 0.01
    here = stood.posture[OWN]
    cases = [
        (CommandMessage("a", "s", 0, "POSTURE_MOVE", 1, stood.posture, 1.0), "takes no leg"),
        (CommandMessage("b", "s", 0, "POSTURE_MOVE", None, here, 1.0), "36 finite"),
        (CommandMessage("c", "s", 0, "POSTURE_MOVE", None, None, 1.0), "36 finite"),
        (CommandMessage("d", "s", 0, "POSTURE_MOVE", None, beyond, 1.0), "joint 2 of leg 2 would be 0.0100 rad"),
        (CommandMessage("e", "s", 0, "POSTURE_MOVE", None, stood.posture, 1.0, 5.0), "takes no force"),
        (CommandMessage("f", "s", 0, "LEG_LOWER", 2, here, 1.0), "force above zero"),
        (CommandMessage("g", "s", 0, "LEG_LOWER", 2, here, 1.0, -3.0), "force above zero"),
        (CommandMessage("h", "s", 0, "LEG_LOWER", None, here, 1.0, 3.0), "no leg None"),
        (CommandMessage("i", "s", 0, "LEG_MOVE", 2, here, 1.0, 3.0), "takes no force"),
    ]
    for command, reason in cases:
        (ack,) = rover.command(command)
        assert (ack.state, reason in ack.reason) == ("refused", True), ack.reason
    assert np.array_equal(rover.posture, stood.posture)
