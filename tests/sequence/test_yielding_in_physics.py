"""The whole chain in physics: a settled stand, a plan, its execution, commands, and the rover goes as predicted."""

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.link import CommandMessage
from footfall.terrain.generate import plane

LEG = 2
CHASSIS, TOUCH = 0.010, 0.005


@pytest.fixture(scope="module")
def dem():
    return plane(size=12.0, resolution=0.05)


def settled(robot, dem):
    from footfall.sim.physics.rover import PhysicalRover

    rover = PhysicalRover(robot, dem, footfall.stand(robot, dem))
    rover.step(2.0)
    return rover


def carried_out(rover, sequence):
    """Every command, one after the other: after each what (posture, T_site_base, set points) are, and contact points.

    The points are those where the wheel of the leg touches from when its lowering begins.
    """
    after, touched = [], []
    for row, one in enumerate(sequence.commands):
        message = CommandMessage(f"c{row}", "", row, one.name, one.leg, one.joints, one.duration, one.force)
        assert rover.command(message)[-1].state == "started"
        while rover.mode == "moving":
            rover.step(0.02)
            forces, points = rover.wheel_forces()
            if one.name == "LEG_LOWER" and forces[LEG, 2] > 5.0:
                touched.append(points[LEG])
        assert rover.mode == "idle", rover.fault
        after.append((np.array(rover.posture), rover.T_site_base, np.array(rover.commanded)))
    return after, touched


@pytest.mark.parametrize("mode", ["droop_aware", "pose_held"])
def test_physics_goes_where_the_sequence_predicts(athlete, dem, mode):
    pytest.importorskip("mujoco")
    from footfall.sim.physics.referee import referee

    rover = settled(athlete, dem)
    state, set_points = rover.state(), np.array(rover.commanded)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.1, y - 0.3)).plan
    assert plan is not None
    result = footfall.plan_execution(athlete, dem, state, plan, ExecutionSettings(mode=mode), set_points)
    assert result.status is Status.FOUND, result.reason
    done = result.execution
    assert done is not None
    sequence = footfall.make_sequence(done, athlete, dem)
    assert sequence.valid, sequence.failures[0]
    after, touched = carried_out(rover, sequence)
    chassis = [np.linalg.norm(T[:3, 3] - pose[:3, 3]) for (_, T, _), pose in zip(after, sequence.poses, strict=True)]
    assert max(chassis) < CHASSIS
    # what was sent is what was said, and where lowering stopped the wheel is near to where it was said to
    (lowering,) = [row for row, one in enumerate(sequence.commands) if one.name == "LEG_LOWER"]
    sent = np.abs(np.array([commanded for _, _, commanded in after]) - sequence.commanded).max(axis=1)
    assert np.delete(sent, [lowering, lowering + 1]).max() < 1e-12
    assert sent[lowering] < 0.01
    ends = [row for row, one in enumerate(sequence.commands) if one.name == "WAIT"]
    assert max(np.abs(after[row][0] - sequence.predicted[row]).max() for row in ends) < 0.01
    assert np.linalg.norm(touched[0][:2] - done.touch_down[:2]) < TOUCH
    assert np.linalg.norm(touched[0][:2] - plan.contact[:2]) < TOUCH
    assert rover.wheel_forces()[0][LEG, 2] == pytest.approx(done.forces[-1, LEG, 2], abs=60.0)

    # the referee starts a rover of its own where the sequence starts, and finds the same
    report = referee(athlete, sequence, dem, goals={LEG: plan.contact}, poses=sequence.poses)
    assert report.passed, report.failures
    assert report.chassis.max() < CHASSIS
    first = [event.off for event in report.events if event.kind == "touch-down" and event.leg == LEG]
    assert first[0] < TOUCH
    assert report.drag[LEG] < 0.02
    assert report.slip.max() < 0.001
    assert report.clearance > 0.1


def test_what_the_rule_calls_dragging_drags_in_physics(athlete, dem):
    """The planned angles alone, sent to a rover that sags, pull its wheel over the ground before it lifts."""
    pytest.importorskip("mujoco")
    from footfall.sim.physics.referee import referee

    rover = settled(athlete, dem)
    state, set_points = rover.state(), np.array(rover.commanded)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.1, y - 0.3)).plan
    assert plan is not None
    settings = ExecutionSettings(mode="as_commanded")
    execution = footfall.plan_execution(athlete, dem, state, plan, settings, set_points).execution
    assert execution is not None
    sequence = footfall.make_sequence(execution, athlete, dem)
    assert {one.rule for one in sequence.failures} == {"no-drag"}
    report = referee(athlete, sequence, dem, poses=sequence.poses)
    assert report.drag[LEG] > 0.02
