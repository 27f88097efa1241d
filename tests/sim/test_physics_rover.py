"""The rover in physics: it stands, sags, lifts less than told, stops, and takes commands as the kinematic one does."""

import re

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.body.stand import stand
from footfall.robot.description import with_payload
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import gravity_torques, leg_wheel_pose, wheel_centers
from footfall.robot.model import Robot
from footfall.sim.physics.contacts import on_wheels
from footfall.sim.physics.physics_settings import TIME_STEP, Noise, PhysicsSettings
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.rover import SimulatedRover
from footfall.sim.statics import contact_jacobian
from footfall.telemetry.link import CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal

MOON = 1.62


def order(
    number: int, leg: int | None, joints, duration: float, name: str = "LEG_MOVE", force: float | None = None
) -> CommandMessage:
    joints = None if joints is None else np.asarray(joints, float)
    return CommandMessage(f"c{number}", "s", number, name, leg, joints, duration, force)


def raised(robot: Robot, leg: int, joints: np.ndarray, height: float) -> np.ndarray:
    """Joint angles that have the wheel higher by ``height`` in base, nearest to ``joints``."""
    T = leg_wheel_pose(robot, joints, leg)
    T[2, 3] += height
    solutions = solve_leg(robot, leg, T[None])
    found = solutions.q[0][solutions.valid[0]]
    return found[np.argmin(np.abs(found - joints).sum(axis=1))]


def hub_heights(rover: PhysicalRover) -> np.ndarray:
    return apply(rover.T_site_base, wheel_centers(rover.robot, rover.posture))[:, 2]


def wheel_forces(rover: PhysicalRover) -> np.ndarray:
    return on_wheels(rover.physics, rover.touches())[0]


@pytest.fixture(scope="module")
def rough() -> Dem:
    return fractal(size=10.0, resolution=0.05, roughness=0.2, seed=1)


@pytest.fixture(scope="module")
def on_rough(athlete, rough) -> RobotState:
    return stand(athlete, rough)


@pytest.fixture
def rover(athlete, flat, standing) -> PhysicalRover:
    return PhysicalRover(athlete, flat, standing)


def test_it_has_the_methods_of_the_kinematic_rover(rover):
    public = {name for name in dir(SimulatedRover) if not name.startswith("_")} | {
        "robot",
        "dem",
        "time",
        "posture",
        "mode",
    }
    assert all(hasattr(rover, name) for name in public)


@pytest.mark.parametrize("wheel_shape", ["sphere", "crowned"])
def test_it_stands_at_rest_as_it_was_asked_to(athlete, rough, on_rough, wheel_shape):
    rover = PhysicalRover(athlete, rough, on_rough, PhysicsSettings(wheel_shape=wheel_shape))
    assert np.abs(rover.posture - on_rough.posture).max() <= 1e-3
    assert rover.settled.joints <= 1e-3
    # the wheels give way by about weight / (6 × 60 kN/m) = 23 mm
    assert rover.settled.moved[2] == pytest.approx(-0.02, abs=0.01)
    before, hubs = rover.T_site_base, hub_heights(rover)
    rover.step(10.0)
    assert np.linalg.norm(rover.T_site_base[:3, 3] - before[:3, 3]) < 1e-3
    assert np.abs(hub_heights(rover) - hubs).max() < 1e-3
    state = rover.state()
    assert np.allclose(state.wheel_forces.sum(axis=0), (0, 0, athlete.mass * 9.81), atol=1.0)
    assert (state.wheel_forces[:, 2] > 500).all()


def test_servos_hold_weight_and_wheel_forces_by_an_independent_balance(athlete, rough, on_rough):
    """Stiffness × (commanded − measured) = gravity of the links − Jᵀ · force of the ground, from pin and statics."""
    rover = PhysicalRover(athlete, rough, on_rough)
    rover.step(5.0)
    state, frame = rover.state(), rover.frame()
    servo = athlete.stiffness * (frame.commanded - frame.state.posture)
    assert np.allclose(servo, state.joint_torques, atol=1e-9)
    T = state.T_site_base
    forces, points = on_wheels(rover.physics, rover.touches())
    balance = gravity_torques(athlete, state.posture, T[:3, :3])
    for leg in athlete.legs:
        # the contact moves with the link as the rim's spring holds it: the arm reaches to where the ground pushes
        J = contact_jacobian(athlete, state.posture, leg, (points[leg] - T[:3, 3]) @ T[:3, :3])
        balance[6 * leg : 6 * leg + 6] -= J.T @ (forces[leg] @ T[:3, :3])
    # the rim's own weight of 20 kg hangs at a hub that its spring has moved by some 2 cm: up to 4 N·m
    assert np.allclose(servo, balance, atol=5.0)
    assert np.abs(servo).max() > 500


@pytest.mark.parametrize(
    ("gravity", "stiffness", "least", "most"),
    [(9.81, 1.0, 0.25, 0.40), (MOON, 1.0, 0.80, 0.95), (9.81, 0.5, -0.05, 0.15)],
    ids=["earth", "moon", "soft joints on earth"],
)
def test_a_lift_of_20_cm_raises_the_wheel_by_less(athlete, flat, standing, gravity, stiffness, least, most):
    rover = PhysicalRover(athlete, flat, standing, PhysicsSettings(gravity=gravity, stiffness_scale=stiffness))
    before = hub_heights(rover)[0]
    rover.command(order(0, 0, raised(athlete, 0, rover.commanded[:6], 0.2), 6.0))
    rover.step(8.0)
    assert least <= (hub_heights(rover)[0] - before) / 0.2 <= most
    # with half the stiffness (2.5 × torque limit per radian) the wheel never leaves the ground
    assert (wheel_forces(rover)[0, 2] > 0) == (stiffness < 1)


def test_a_command_is_received_started_and_done(athlete, rover):
    target = raised(athlete, 2, rover.commanded[12:18], 0.1)
    before = rover.commanded[12:18].copy()
    acks = rover.command(order(0, 2, target, 2.0))
    assert [ack.state for ack in acks] == ["received", "started"]
    assert (rover.mode, rover.moving_leg) == ("moving", 2)
    assert rover.step(1.0) == []
    half = rover.frame()
    assert np.allclose(half.commanded[12:18] - target, 0.5 * (before - target), atol=1e-9)
    acks = rover.step(1.0)
    assert [(ack.id, ack.state) for ack in acks] == [("c0", "done")]
    assert acks[0].time == pytest.approx(1002.0, abs=TIME_STEP)
    assert np.array_equal(rover.commanded[12:18], target)
    assert (rover.mode, rover.moving_leg) == ("idle", None)


def test_speed_limits_come_before_the_duration(athlete, rover):
    target = rover.commanded[:6].copy()
    target[0] += 0.1
    rover.command(order(0, 0, target, 0.0))
    assert rover.step(0.49) == []
    assert [ack.state for ack in rover.step(0.02)] == ["done"]


def test_a_posture_move_shifts_the_chassis(athlete, rover):
    """All wheels higher in base: the chassis comes down on its standing wheels."""
    target = rover.commanded.copy()
    for leg in athlete.legs:
        own = slice(6 * leg, 6 * leg + 6)
        target[own] = raised(athlete, leg, target[own], 0.1)
    before = rover.T_site_base[2, 3]
    assert rover.command(order(0, None, target, 3.0, "POSTURE_MOVE"))[-1].state == "started"
    assert rover.moving_leg is None
    assert rover.step(4.0)[-1].state == "done"
    assert rover.T_site_base[2, 3] - before == pytest.approx(-0.1, abs=0.01)


@pytest.mark.parametrize("speed", [0.02, 0.1])
def test_lowering_ends_where_the_wheel_touches(athlete, flat, standing, speed):
    rover = PhysicalRover(athlete, flat, standing, PhysicsSettings(gravity=MOON, noise=Noise(force=10.0)))
    down = rover.commanded[:6]
    up = raised(athlete, 0, down, 0.2)
    rover.command(order(0, 0, up, 4.0))
    rover.step(5.0)
    assert wheel_forces(rover)[0, 2] == 0.0
    deep = down.copy()
    deep[1] += 0.2
    rover.command(order(1, 0, deep, 0.5 / speed, "LEG_LOWER", force=100.0))
    said, force = [], []
    while not said:
        said = rover.step(TIME_STEP)
        force.append(wheel_forces(rover)[0, 2])
    assert said[0].state == "done"
    assert rover.time - 1005.0 < 0.5 / speed - 1.0
    # it stops soon after the force has risen by what was asked, averaged over a tenth of a second
    assert 90.0 <= max(force) <= 400.0
    frozen = rover.commanded.copy()
    rover.step(1.0)
    assert np.array_equal(rover.commanded, frozen)
    assert wheel_forces(rover)[0, 2] > 50.0


def test_lowering_in_mid_air_ends_at_its_target(athlete, flat, standing):
    rover = PhysicalRover(athlete, flat, standing, PhysicsSettings(gravity=MOON, noise=Noise(force=10.0)))
    down = rover.commanded[:6]
    rover.command(order(0, 0, raised(athlete, 0, down, 0.25), 4.0))
    rover.step(4.5)
    target = raised(athlete, 0, down, 0.15)
    rover.command(order(1, 0, target, 2.0, "LEG_LOWER", force=100.0))
    rover.step(2.0)
    assert rover.mode == "idle"
    assert np.array_equal(rover.commanded[:6], target)


def test_stop_freezes_the_set_points(athlete, rover):
    target = raised(athlete, 1, rover.commanded[6:12], 0.2)
    rover.command(order(0, 1, target, 4.0))
    rover.step(2.0)
    frozen = rover.commanded.copy()
    (ack,) = rover.stop()
    assert (ack.state, ack.reason) == ("refused", "stopped after 50% of the motion")
    assert rover.stop() == []
    rover.step(1.0)
    assert np.array_equal(rover.commanded, frozen)
    still = rover.posture.copy()
    rover.step(1.0)
    assert np.abs(rover.posture - still).max() < 1e-4
    (ack,) = rover.command(order(1, 1, target, 4.0))
    assert "clear the stop first" in ack.reason
    rover.clear_stop()
    assert rover.mode == "idle"
    assert rover.command(order(2, 1, target, 1.0))[-1].state == "started"


def test_an_id_is_executed_at_most_once(athlete, rover):
    command = order(0, 2, raised(athlete, 2, rover.commanded[12:18], 0.1), 1.0)
    rover.command(command)
    (again,) = rover.command(command)
    assert again.state == "started"
    assert rover.became("c0") == again
    rover.step(5.0)
    here = rover.commanded.copy()
    (again,) = rover.command(command)
    assert again.state == "done"
    rover.step(0.5)
    assert np.array_equal(rover.commanded, here)
    assert rover.refuse("c0", "unreadable").state == "done"
    assert rover.became("c0").state == "done"
    assert rover.became("never").state == "unknown"
    assert rover.refuse("c9", "unreadable").reason == "unreadable"


def test_refusals_say_why(athlete, rover):
    here = athlete.posture("stand")
    beyond = here.copy()
    beyond[14] = athlete.upper[14] + 0.01
    cases = [
        (order(1, 6, here[:6], 1.0), "no leg 6"),
        (order(2, None, here[:6], 1.0), "no leg None"),
        (order(3, 0, here[:5], 1.0), "LEG_MOVE needs six finite"),
        (order(4, 0, [np.nan] * 6, 1.0), "six finite"),
        (order(5, 2, beyond[12:18], 1.0), "joint 2 of leg 2 .* 0.0100 rad beyond"),
        (order(6, None, beyond, 1.0, "POSTURE_MOVE"), "joint 2 of leg 2 .* 0.0100 rad beyond"),
        (order(7, 0, here, 1.0, "POSTURE_MOVE"), "takes no leg"),
        (order(8, None, here[:6], 1.0, "POSTURE_MOVE"), "needs 36 finite"),
        (order(9, 0, here[:6], 1.0, "LEG_LOWER"), "force above zero that ends it, not None N"),
        (order(10, 0, here[:6], 1.0, "LEG_LOWER", force=-5.0), "force above zero that ends it, not -5.0 N"),
        (order(11, 0, here[:6], 1.0, "LEG_MOVE", force=5.0), "LEG_MOVE takes no force"),
        (order(12, 0, here[:6], np.inf), "duration"),
        (order(13, 0, here[:6], 1.0, "JUMP"), "no command"),
        (order(14, 0, None, 1.0, "WAIT"), "WAIT takes no leg"),
    ]
    for command, reason in cases:
        (ack,) = rover.command(command)
        assert ack.state == "refused"
        assert re.search(reason, ack.reason), ack.reason
    rover.command(order(20, None, None, 1.0, "WAIT"))
    (ack,) = rover.command(order(21, None, None, 1.0, "WAIT"))
    assert "busy with command c20" in ack.reason
    assert rover.step(1.0)[0].state == "done"


def test_equal_seeds_give_equal_telemetry_to_the_bit(athlete, flat, standing):
    noise = Noise(encoder=0.005, position=0.003, orientation=0.002, force=20.0)

    def run(seed: int) -> list[str]:
        rover = PhysicalRover(athlete, flat, standing, PhysicsSettings(noise=noise, stiffness_spread=0.1, seed=seed))
        rover.command(order(0, 0, raised(athlete, 0, rover.posture[:6], 0.2), 2.0))
        digests = []
        for _ in range(5):
            rover.step(0.3)
            digests.append(rover.frame().digest)
        return digests

    first = run(3)
    assert first == run(3)
    assert not set(first) & set(run(4))


def test_noise_is_as_wide_as_it_says_and_no_other_number_moves(athlete, flat, standing):
    rover = PhysicalRover(athlete, flat, standing, PhysicsSettings(noise=Noise(encoder=0.005, force=20.0)))
    rover.step(2.0)
    assert rover.state().digest == rover.state().digest
    states = []
    for _ in range(50):
        rover.step(TIME_STEP)
        states.append(rover.state())
    spread = np.std([state.posture - rover.posture for state in states])
    assert spread == pytest.approx(0.005, rel=0.1)
    assert np.std([state.wheel_forces - wheel_forces(rover) for state in states]) == pytest.approx(20.0, rel=0.15)
    assert np.ptp([state.T_site_base[2, 3] for state in states]) < 1e-5


def test_a_rover_that_tips_is_in_fault(athlete, flat, standing):
    """Three neighbouring legs folded away: the chassis comes down on their side."""
    rover = PhysicalRover(athlete, flat, standing)
    target = rover.commanded.copy()
    for leg in (0, 1, 5):
        target[6 * leg + 1] = -1.5
    rover.command(order(0, None, target, 6.0, "POSTURE_MOVE"))
    said = []
    for _ in range(150):
        said += rover.step(0.1)
        if rover.mode == "fault":
            break
    assert rover.mode == "fault"
    assert said[-1].state == "refused"
    assert re.search("tipped|come down", said[-1].reason)
    assert rover.state().mode == "fault"
    (ack,) = rover.command(order(1, None, None, 1.0, "WAIT"))
    assert "in fault: the rover has" in ack.reason
    assert rover.stop() == []


def test_a_state_in_which_nothing_stands_is_refused(athlete, flat, standing):
    high = np.array(standing.T_site_base)
    high[2, 3] += 1.5
    floating = RobotState("athlete", 0.0, standing.posture, high, standing.wheel_forces, standing.joint_torques, "idle")
    with pytest.raises(InvalidInput, match="does not stay in that state"):
        PhysicalRover(athlete, flat, floating)
    far = np.array(standing.T_site_base)
    far[0, 3] = 40.0
    lost = RobotState("athlete", 0.0, standing.posture, far, standing.wheel_forces, standing.joint_torques, "idle")
    with pytest.raises(InvalidInput, match="off the map"):
        PhysicalRover(athlete, flat, lost)


def test_time_runs_forward_in_whole_steps(rover):
    with pytest.raises(InvalidInput, match="forward"):
        rover.step(-0.1)
    for _ in range(1000):
        rover.step(0.0011)
    assert rover.time - 1000.0 == pytest.approx(1.1, abs=TIME_STEP)


def test_wheels_give_way_by_weight_over_stiffness(athlete, flat, standing):
    """Wheel springs and scales: the level chassis sinks by mass · gravity / (6 · stiffness)."""
    robot = Robot(with_payload(athlete.description, 300.0))
    for settings in (PhysicsSettings(), PhysicsSettings(wheel_scale=0.7, mass_scale=0.9, gravity=3.71)):
        rover = PhysicalRover(robot, flat, standing, settings)
        weight = settings.mass_scale * robot.mass * settings.gravity
        sunk = weight / (6 * settings.wheel_scale * robot.description.wheel_stiffness)
        # the contact itself gives way by less than half a millimetre, and the rim bears its own weight
        lighter = settings.mass_scale * 20.0 * settings.gravity / (settings.wheel_scale * 60e3)
        assert rover.settled.moved[2] == pytest.approx(-sunk + lighter, abs=6e-4)
        assert wheel_forces(rover)[:, 2].sum() == pytest.approx(weight, abs=1.0)


def test_a_simulation_that_diverges_is_a_fault_and_telemetry_goes_on(rover):
    before = rover.T_site_base
    rover._data.qvel[3] = np.nan
    rover.step(0.1)
    assert rover.mode == "fault"
    assert "diverged" in rover.fault
    rover.step(0.5)
    assert np.abs(rover.frame().state.T_site_base - before).max() < 1e-6
    assert rover.time == pytest.approx(1000.6, abs=TIME_STEP)
