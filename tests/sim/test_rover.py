"""The kinematic rover: speed limits, refusals, stop, at most once, and forces that balance."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, transform
from footfall.core.value import Provenance
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass, leg_wheel_pose, link_poses
from footfall.sequence.commands import Command
from footfall.sequence.predict import predict
from footfall.sim.rover import SimulatedRover
from footfall.sim.statics import contact_jacobian, loads
from footfall.telemetry.link import CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def order(number: int, leg: int | None, joints, duration: float, name: str = "LEG_MOVE") -> CommandMessage:
    joints = None if joints is None else np.asarray(joints, float)
    return CommandMessage(f"c{number}", "s", number, name, leg, joints, duration)


def drive(rover: SimulatedRover, dt: float = 0.05, limit: int = 10_000) -> list:
    acks = []
    for _ in range(limit):
        acks += rover.step(dt)
        if rover.mode != "moving":
            return acks
    raise AssertionError("the command never ends")


@pytest.fixture
def rover(athlete, flat, standing) -> SimulatedRover:
    return SimulatedRover(athlete, flat, standing)


def lifted(robot, leg: int, by: float = 0.3) -> np.ndarray:
    joints = robot.posture("stand")[6 * leg : 6 * leg + 6].copy()
    joints[1] -= by
    return joints


def test_a_command_is_received_started_and_done(athlete, rover):
    acks = rover.command(order(0, 2, lifted(athlete, 2), 2.0))
    assert [ack.state for ack in acks] == ["received", "started"]
    assert rover.mode == "moving"
    assert rover.moving_leg == 2
    assert np.array_equal(rover.frame().commanded[12:18], lifted(athlete, 2))
    acks = drive(rover)
    assert [(ack.id, ack.state) for ack in acks] == [("c0", "done")]
    assert rover.mode == "idle"
    assert np.array_equal(rover.posture[12:18], lifted(athlete, 2))
    assert acks[0].time == pytest.approx(1002.0, abs=0.06)


@settings(max_examples=20)
@given(
    legs=st.lists(st.integers(0, 5), min_size=1, max_size=3),
    changes=st.lists(st.floats(-0.3, 0.3), min_size=18, max_size=18),
    duration=st.floats(0.0, 3.0),
    dt=st.floats(0.05, 0.5),
)
def test_joints_never_exceed_their_speed_and_end_where_predicted(athlete, flat, standing, legs, changes, duration, dt):
    rover = SimulatedRover(athlete, flat, standing)
    commands = []
    for number, leg in enumerate(legs):
        here = rover.posture[6 * leg : 6 * leg + 6]
        commands.append(Command("LEG_MOVE", leg, here + changes[6 * number : 6 * number + 6], duration))
        acks = rover.command(order(number, leg, commands[-1].joints, duration))
        assert acks[-1].state == "started"
        while rover.mode == "moving":
            before = rover.posture.copy()
            rover.step(dt)
            assert (np.abs(rover.posture - before) <= athlete.speed_limits * dt + 1e-12).all()
        if rover.mode == "fault":
            return
    assert np.array_equal(rover.posture, predict(standing.posture, tuple(commands))[-1])


def test_the_way_is_a_straight_line_in_joint_space(athlete, rover):
    target = lifted(athlete, 1)
    target[0] += 0.2
    start = rover.posture[6:12].copy()
    rover.command(order(0, 1, target, 4.0))
    for _ in range(15):
        rover.step(0.2)
        way = (rover.posture[6:12] - start)[[0, 1]] / (target - start)[[0, 1]]
        assert way[0] == pytest.approx(way[1], abs=1e-12)


def test_refusals_say_why(athlete, rover):
    here = athlete.posture("stand")[:6]
    beyond = here.copy()
    beyond[2] = athlete.upper[2] + 0.01
    cases = [
        (order(1, 6, here, 1.0), "no leg 6"),
        (order(2, None, here, 1.0), "no leg None"),
        (order(3, 0, here[:5], 1.0), "six finite"),
        (order(4, 0, None, 1.0), "six finite"),
        (order(5, 0, [np.nan] * 6, 1.0), "six finite"),
        (order(6, 0, beyond, 1.0), "joint 2 of leg 0 .* 0.0100 rad beyond"),
        (order(7, 0, here, -1.0), "duration"),
        (order(8, 0, here, np.inf), "duration"),
        (order(9, 0, here, 1.0, "JUMP"), "no command"),
        (order(10, 0, None, 1.0, "WAIT"), "WAIT takes no leg"),
    ]
    for command, reason in cases:
        (ack,) = rover.command(command)
        assert ack.state == "refused"
        assert re.search(reason, ack.reason), ack.reason
    assert rover.mode == "idle"
    assert np.array_equal(rover.posture, athlete.posture("stand"))


def test_busy_while_moving(athlete, rover):
    rover.command(order(0, 2, lifted(athlete, 2), 5.0))
    rover.step(0.5)
    (ack,) = rover.command(order(1, 3, lifted(athlete, 3), 5.0))
    assert ack.state == "refused"
    assert "busy with command c0" in ack.reason
    assert drive(rover)[-1].id == "c0"


def test_an_id_is_executed_at_most_once(athlete, rover):
    command = order(0, 2, lifted(athlete, 2), 2.0)
    rover.command(command)
    (again,) = rover.command(command)
    assert again.state == "started"
    assert rover.became("c0") == again
    drive(rover)
    rover.command(order(1, 2, athlete.posture("stand")[12:18], 2.0))
    drive(rover)
    for repeated in (command, order(0, 4, lifted(athlete, 4), 9.0)):
        (again,) = rover.command(repeated)
        assert (again.id, again.state) == ("c0", "done")
    assert rover.step(1.0) == []
    assert np.array_equal(rover.posture, athlete.posture("stand"))
    assert rover.refuse("c0", "unreadable").state == "done"
    assert rover.became("c0").state == "done"
    assert rover.became("never").state == "unknown"


def test_stop_freezes_and_latches(athlete, rover):
    rover.command(order(0, 2, lifted(athlete, 2), 4.0))
    rover.step(1.0)
    (ack,) = rover.stop()
    assert (ack.id, ack.state) == ("c0", "refused")
    assert "stopped" in ack.reason
    frozen = rover.posture.copy()
    for _ in range(5):
        assert rover.step(1.0) == []
        assert rover.stop() == []
    assert np.array_equal(rover.posture, frozen)
    assert rover.state().mode == "stopped"
    (ack,) = rover.command(order(1, 2, lifted(athlete, 2), 4.0))
    assert "clear the stop" in ack.reason
    rover.clear_stop()
    assert rover.command(order(2, 2, lifted(athlete, 2), 4.0))[-1].state == "started"
    assert rover.command(order(1, 2, lifted(athlete, 2), 4.0))[-1].state == "refused"


def test_wait_takes_its_time_and_moves_nothing(athlete, rover):
    assert rover.command(order(0, None, None, 1.0, "WAIT"))[-1].state == "started"
    assert rover.step(0.9) == []
    assert [ack.state for ack in rover.step(0.2)] == ["done"]
    assert np.array_equal(rover.posture, athlete.posture("stand"))


def test_frames_count_and_time_runs(rover):
    frames = []
    for _ in range(3):
        rover.step(0.1)
        frames.append(rover.frame())
    assert [frame.number for frame in frames] == [0, 1, 2]
    assert [frame.state.time for frame in frames] == pytest.approx([1000.1, 1000.2, 1000.3])
    with pytest.raises(InvalidInput):
        rover.step(-0.1)


def test_lifting_all_of_one_side_is_a_fault(athlete, rover):
    faults = []
    for number, leg in enumerate((0, 1, 5)):
        rover.command(order(number, leg, lifted(athlete, leg), 2.0))
        faults += [ack for ack in drive(rover) if ack.state == "refused"]
    assert rover.mode == "fault"
    assert len(faults) == 1
    assert "tip" in faults[0].reason
    assert "fault" in rover.command(order(9, 0, athlete.posture("stand")[:6], 9.0))[0].reason
    rover.stop()
    rover.clear_stop()
    assert rover.mode == "fault"


def test_a_state_of_another_robot_is_refused(athlete, flat, standing):
    other = RobotState(
        "other",
        0.0,
        standing.posture,
        standing.T_site_base,
        standing.wheel_forces,
        standing.joint_torques,
        "idle",
    )
    with pytest.raises(InvalidInput, match="the robot is athlete"):
        SimulatedRover(athlete, flat, other)


@pytest.mark.parametrize("up", [None, 0, 4])
def test_wheel_forces_hold_the_rover(athlete, flat, standing, up):
    posture = standing.posture.copy()
    if up is not None:
        posture[6 * up : 6 * up + 6] = lifted(athlete, up)
    forces, _ = loads(athlete, flat, posture, standing.T_site_base)
    weight = athlete.mass * 9.81
    assert np.abs(forces.sum(axis=0) - [0.0, 0.0, weight]).max() < 1e-3 * weight
    com = apply(standing.T_site_base, center_of_mass(athlete, posture))
    points = np.array([contact_point(athlete, posture, leg, standing.T_site_base) for leg in athlete.legs])
    assert np.abs(np.cross(points - com, forces).sum(axis=0)).max() < 1e-3 * weight
    assert (forces[:, 2] >= 0).all()
    if up is not None:
        assert np.array_equal(forces[up], np.zeros(3))


def test_a_moving_leg_carries_nothing(athlete, flat, standing):
    forces, _ = loads(athlete, flat, standing.posture, standing.T_site_base, moving_leg=3)
    assert np.array_equal(forces[3], np.zeros(3))


def test_a_wheel_stands_where_it_stood_though_the_ground_is_unknown(athlete, flat, standing):
    heights = flat.heights.copy()
    foot = contact_point(athlete, standing.posture, 1, standing.T_site_base)
    row, col = flat.geometry.cell(foot[0], foot[1])
    heights[row - 2 : row + 3, col - 2 : col + 3] = np.nan
    holed = Dem(heights, flat.geometry, "holed", Provenance({}))
    forces, torques = loads(athlete, flat, standing.posture, standing.T_site_base)
    told = RobotState("athlete", 0.0, standing.posture, standing.T_site_base, forces, torques, "idle")
    assert SimulatedRover(athlete, holed, standing).state().wheel_forces[1, 2] == 0.0
    rover = SimulatedRover(athlete, holed, told)
    assert rover.state().wheel_forces[1, 2] > 0.0
    rover.command(order(0, 1, lifted(athlete, 1), 2.0))
    drive(rover)
    assert rover.state().wheel_forces[1, 2] == 0.0


def test_contact_jacobian_against_finite_differences(athlete, rng):
    for leg in athlete.legs:
        part = slice(6 * leg, 6 * leg + 6)
        posture = rng.uniform(athlete.lower, athlete.upper) / 2
        T_base_wheel = leg_wheel_pose(athlete, posture[part], leg)
        on_wheel = np.array([0.1, 0.0, 0.242])
        J = contact_jacobian(athlete, posture, leg, apply(T_base_wheel, on_wheel))
        for joint in range(6):
            step = np.zeros(6)
            step[joint] = 1e-6
            moved = [apply(leg_wheel_pose(athlete, posture[part] + s * step, leg), on_wheel) for s in (1, -1)]
            assert np.abs((moved[0] - moved[1]) / 2e-6 - J[:, joint]).max() < 1e-8


def test_joint_torques_do_the_work_that_forces_and_weight_need(athlete, flat, standing, rng):
    """Virtual work, from link poses alone: raising wheels and links costs what the joints give."""
    posture = standing.posture
    T = standing.T_site_base @ transform(rotation("z", 0.3))
    forces, torques = loads(athlete, flat, posture, T)

    def energy(q) -> float:
        com = apply(T, center_of_mass(athlete, q))
        work = athlete.mass * 9.81 * com[2]
        poses, here = link_poses(athlete, q), link_poses(athlete, posture)
        for leg in athlete.legs:
            name = f"leg{leg}_wheel"
            touching = contact_point(athlete, posture, leg, T)
            on_wheel = apply(np.linalg.inv(T @ here[name]), touching)
            work -= forces[leg] @ apply(T @ poses[name], on_wheel)
        return work

    for _ in range(5):
        direction = rng.normal(size=36)
        slope = (energy(posture + 1e-6 * direction) - energy(posture - 1e-6 * direction)) / 2e-6
        assert slope == pytest.approx(float(torques @ direction), rel=1e-6, abs=1e-3)
