"""A simulated rover of a robot that others described goes where its commands say, and holds itself up on the way."""

import numpy as np
import pytest

import footfall
from footfall.balance.balance_settings import GRAVITY
from footfall.balance.legged_effort import efforts_under
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse
from footfall.planning.legged.measured import as_measured, standing_state
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stance import all_standing
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.robot.legged.posture import placed
from footfall.sim.legged_rover import SimulatedLeggedRover
from footfall.telemetry.link import CommandMessage
from footfall.terrain.generate import fractal
from tests.support.described import robot_of


@pytest.fixture(scope="module")
def made():
    """A robot of four legs on rough ground, the state it starts from, and the commands of one step."""
    _, robot = robot_of(4)
    dem = fractal(4.0, 0.1, roughness=0.02, seed=3)
    state = stand(robot, dem)
    target = state.soles[1, :2] + (0.05, 0.02)
    result = plan_step(robot, dem, state, 1, tuple(target), LeggedSettings(time_limit=1e6))
    assert result.plan is not None, result.reason
    return robot, dem, state, footfall.make_sequence(result.plan, robot, dem)


@pytest.fixture
def rover(made):
    robot, dem, state, _ = made
    measured = as_measured(robot, state.q, state.T_site_base, all_standing(state), 100.0)
    return SimulatedLeggedRover(robot, dem, measured)


def message(command, row: int) -> CommandMessage:
    return CommandMessage(f"row {row}", "s", row, command.name, command.leg, command.joints, command.duration)


def carry_out(rover, command, row: int) -> list[str]:
    told = [ack.state for ack in rover.command(message(command, row))]
    for _ in range(4):
        told += [ack.state for ack in rover.step(command.duration / 3)]
    return told


def require_held(robot, state):
    """Forces of the ground balance the weight: their sum, and their moment about the centre of mass."""
    weight = robot.mass * GRAVITY
    np.testing.assert_allclose(state.wheel_forces.sum(axis=0), [0.0, 0.0, weight], atol=1e-4 * weight)


def test_it_ends_each_row_where_the_commands_are_predicted_to(made, rover):
    robot, _, _, sequence = made
    for row, command in enumerate(sequence.commands):
        assert carry_out(rover, command, row) == ["received", "started", "done"]
        state = rover.frame().state
        np.testing.assert_allclose(state.posture, sequence.predicted[row], atol=1e-12)
        np.testing.assert_allclose(state.T_site_base, sequence.poses[row], atol=1e-9)
        require_held(robot, state)
    assert rover.frame().number == len(sequence.commands)
    assert state.described is not None
    assert state.described.joint_names == robot.joint_names


def test_plans_begin_from_its_telemetry_as_from_the_stance(made, rover):
    robot, dem, state, _ = made
    again = standing_state(robot, dem, rover.state())
    for name in ("q", "T_site_base", "soles", "contacts", "normals"):
        np.testing.assert_allclose(getattr(again, name), getattr(state, name), atol=1e-6, err_msg=name)


def test_a_leg_in_the_air_bears_nothing_and_a_stop_freezes_it(made, rover):
    _, _, _, sequence = made
    swings = next(k for k, command in enumerate(sequence.commands) if command.leg is not None) + 2
    for row, command in enumerate(sequence.commands[:swings]):
        carry_out(rover, command, row)
    command = sequence.commands[swings]
    rover.command(message(command, swings))
    rover.step(command.duration / 2)
    before = rover.state()
    assert before.mode == "moving"
    assert not before.wheel_forces[command.leg].any()
    (refused,) = rover.stop()
    assert refused.state == "refused"
    assert "stopped after 50%" in refused.reason
    rover.step(1.0)
    after = rover.state()
    np.testing.assert_array_equal(after.posture, before.posture)
    assert after.mode == "stopped"
    assert rover.command(message(command, 99))[0].reason == "the rover is stopped; clear the stop first"


@pytest.mark.parametrize(
    ("name", "leg", "joints", "why"),
    [
        ("LEG_MOVE", 4, [0.0, 0.0, 0.0], "there is no leg 4; there are 0…3"),
        ("LEG_MOVE", 0, [0.0, 0.0], "LEG_MOVE needs 3 finite joint angles"),
        ("LEG_LOWER", 0, [0.0, 0.0, 0.0], "'LEG_LOWER' is no command of this rover"),
        ("LEG_MOVE", 0, [0.0, 0.0, 99.0], "rad beyond its limits"),
    ],
)
def test_it_refuses_what_it_has_not(made, rover, name, leg, joints, why):
    before = rover.state()
    (ack,) = rover.command(CommandMessage("x", "s", 0, name, leg, np.array(joints), 1.0))
    assert ack.state == "refused"
    assert why in ack.reason
    if "beyond" in why:
        assert made[0].joint_names[2] in ack.reason
    np.testing.assert_array_equal(rover.state().posture, before.posture)


def test_it_faults_where_its_feet_can_not_hold_it(made, rover):
    robot, _, state, _ = made
    told = []
    for leg in (0, 1):  # two feet of four are drawn up, one after the other
        lifted = state.q[robot.slices[leg]] - (0.0, 0.3, 0.0)
        told += rover.command(CommandMessage(f"{leg}", "s", leg, "LEG_MOVE", leg, lifted, 1.0))
        told += [*rover.step(0.5), *rover.step(0.6)]
        if rover.mode == "fault":
            break
    assert rover.state().mode == "fault"
    refused = [ack.reason for ack in told if ack.state == "refused"]
    assert len(refused) == 1
    assert "can't hold" in refused[0]
    assert "in fault" in rover.command(CommandMessage("y", "s", 0, "WAIT", None, None, 1.0))[0].reason


def test_a_state_of_other_joints_is_refused(made):
    robot, dem, state, _ = made
    _, other = robot_of(5)
    measured = as_measured(robot, state.q, state.T_site_base, all_standing(state))
    with pytest.raises(InvalidInput, match="its joints are not those of"):
        SimulatedLeggedRover(other, dem, measured)
    with pytest.raises(InvalidInput, match="with other joints than"):
        standing_state(other, dem, measured)


def test_efforts_are_those_of_virtual_work(made):
    """τ = ∂(m g z)/∂q − f · ∂p/∂q, by differences, with the contacts fixed to the last bodies."""
    robot, _, state, _ = made
    rng = np.random.default_rng(1)
    forces = rng.normal(size=(2, 3)) * 20.0
    standing = [0, 2]
    T = state.T_site_base
    bodies = [robot.slices[leg].stop for leg in standing]
    at = placed(robot, state.q).Ts_base_body
    on_body = [
        apply(inverse(at[body]), apply(inverse(T), state.contacts[leg]))
        for leg, body in zip(standing, bodies, strict=True)
    ]

    def work(q: np.ndarray) -> float:
        where = placed(robot, q)
        points = [apply(T, apply(where.Ts_base_body[body], point)) for body, point in zip(bodies, on_body, strict=True)]
        lifted = robot.mass * GRAVITY * apply(T, where.com)[2]
        return float(lifted - sum(force @ point for force, point in zip(forces, points, strict=True)))

    step = 1e-5
    by_differences = [(work(state.q + step * e) - work(state.q - step * e)) / (2 * step) for e in np.eye(len(state.q))]
    found = efforts_under(robot, state.q, T, standing, state.contacts[standing], forces)
    np.testing.assert_allclose(found, by_differences, atol=1e-5)
