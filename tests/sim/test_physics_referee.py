"""The referee sees what happens: steps that work and that don't, planted collisions, slips and falls."""

import re

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, transform
from footfall.core.value import Provenance
from footfall.robot.ik import contact_point, solve_leg
from footfall.robot.kinematics import leg_wheel_pose, wheel_centers
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.predict import predict
from footfall.sim.physics.physics_settings import TIME_STEP, Noise, PhysicsSettings
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.run_observer import RunObserver
from footfall.sim.physics.verdict import RefereeReport, RefereeSettings
from footfall.telemetry.link import CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

MOON = RefereeSettings(PhysicsSettings(gravity=1.62))


def moved(robot, leg: int, joints: np.ndarray, shift) -> np.ndarray:
    """Joint angles that have the wheel elsewhere by ``shift`` (3,) in base, turned as it was."""
    T = leg_wheel_pose(robot, joints, leg)
    T[:3, 3] += shift
    solutions = solve_leg(robot, leg, T[None])
    found = solutions.q[0][solutions.valid[0]]
    return found[np.argmin(np.abs(found - joints).sum(axis=1))]


def sequence_of(standing, *commands: Command) -> Sequence:
    return Sequence(
        robot=standing.robot,
        commands=commands,
        start=standing.posture,
        predicted=predict(standing.posture, commands),
        T_site_base=standing.T_site_base,
        rules=(),
        provenance=Provenance({}),
    )


def at_rest(robot, posture: np.ndarray) -> RobotState:
    """A level rover whose lowest wheels touch the plane z = 0."""
    height = robot.wheel_radius - wheel_centers(robot, posture)[:, 2].min()
    T = transform(translation=(0.0, 0.0, height))
    return RobotState(robot.name, 0.0, posture, T, np.zeros((6, 3)), np.zeros(36), "idle")


@pytest.fixture(scope="module")
def on_flat(athlete) -> RobotState:
    return at_rest(athlete, athlete.posture("stand"))


@pytest.fixture(scope="module")
def bent(athlete) -> RobotState:
    """Knees bent, so that the wheels may go anywhere."""
    return at_rest(athlete, athlete.posture("crouch"))


@pytest.fixture(scope="module")
def step(athlete, on_flat) -> Sequence:
    """Leg 0 up, 25 cm to the left and down again."""
    ways = [(0, 0, 0.1), (0, 0, 0.2), (-0.02, 0.25, 0.2), (-0.02, 0.25, 0.1), (-0.02, 0.25, 0.0)]
    phases = ["lift", "lift", "swing", "lower", "lower"]
    joints = [moved(athlete, 0, on_flat.posture[:6], way) for way in ways]
    return sequence_of(
        on_flat, *(Command("LEG_MOVE", 0, q, 1.0, phase) for q, phase in zip(joints, phases, strict=True))
    )


@pytest.fixture(scope="module")
def on_the_moon(athlete, flat, step) -> RefereeReport:
    return referee(athlete, step, flat, MOON)


def test_a_step_on_the_moon_passes(athlete, step, on_the_moon):
    report = on_the_moon
    assert report.passed, report.failures
    assert report.commands == len(step.commands)
    assert [(event.kind, event.leg, event.planned) for event in report.events] == [
        ("lift-off", 0, True),
        ("touch-down", 0, True),
    ]
    lift, touch = report.events
    phases = [command.phase for command in step.commands]
    assert phases[lift.row] == "lift"
    assert phases[touch.row] == "lower"
    assert 0 < lift.time < touch.time < report.ended[-1]
    goal = contact_point(athlete, step.predicted[-1], 0, step.T_site_base)
    assert touch.off == pytest.approx(np.linalg.norm(touch.point[:2] - goal[:2]), abs=1e-6)
    assert np.isfinite(report.touch).tolist() == [True] + [False] * 5
    assert report.contacts == ()
    assert 0.1 < report.clearance < 0.25
    took = np.diff(report.ended, prepend=0.0)
    assert (took >= [command.duration - 1e-9 for command in step.commands]).all()
    assert report.settled[2] == pytest.approx(-athlete.mass * 1.62 / (6 * 60e3), abs=1e-3)


def test_a_step_of_whole_postures_and_pauses_is_known_by_its_leg(athlete, flat, on_flat, step, on_the_moon):
    """The same step with all legs commanded in every row, in between pauses, twice over."""
    rows = []
    for _ in range(2):
        for command in step.commands:
            posture = on_flat.posture.copy()
            posture[:6] = command.joints
            rows += [Command("POSTURE_MOVE", None, posture, 1.0, command.phase), Command("WAIT", None, None, 0.2)]
        back = on_flat.posture
        rows.append(Command("POSTURE_MOVE", None, back, 1.0, "shift"))
    report = referee(athlete, sequence_of(on_flat, *rows[:-1]), flat, RefereeSettings(MOON.physics, chassis=0.2))
    kinds = [(event.kind, event.leg, event.planned) for event in report.events]
    assert kinds[:2] == [("lift-off", 0, True), ("touch-down", 0, True)]
    assert all(planned and leg == 0 for _, leg, planned in kinds)
    assert report.events[0].point == pytest.approx(on_the_moon.events[0].point, abs=0.01)
    assert np.isnan(report.touch).all()


def test_equal_runs_give_equal_reports(athlete, flat, step, on_the_moon):
    assert referee(athlete, step, flat, MOON).digest == on_the_moon.digest


def test_on_earth_the_same_step_misses_its_goal_and_says_by_how_much(athlete, flat, step):
    report = referee(athlete, step, flat)
    assert not report.passed
    assert any(re.match(r"wheel 0 stands \d+ mm from its goal", text) for text in report.failures)
    assert report.touch[0] > 0.05
    assert 0.02 < report.sag.max() < 0.06
    # supporting wheels hold on the way
    assert report.slip.max() < 1e-3


def test_given_goals_and_poses_are_what_it_is_judged_by(athlete, flat, step, on_the_moon):
    end = next(event for event in on_the_moon.events if event.kind == "touch-down")
    poses = np.tile(np.array(step.T_site_base), (len(step.commands), 1, 1))
    poses[:, 2, 3] += 0.1
    report = referee(athlete, step, flat, MOON, goals={0: end.point[:2] + np.array([0.3, 0.0])}, poses=poses)
    assert report.touch[0] == pytest.approx(0.3, abs=0.01)
    assert report.sag == pytest.approx(0.1, abs=0.02)
    assert any("stands 30" in text or "stands 29" in text for text in report.failures)
    assert any("chassis was" in text for text in report.failures)


@pytest.mark.parametrize("side", [1, -1])
def test_a_pillar_in_the_way_of_the_swing_is_an_unplanned_contact(athlete, flat, on_flat, side):
    heights = np.array(flat.heights)
    x, y = np.moveaxis(flat.geometry.centers(), -1, 0)
    foot = contact_point(athlete, on_flat.posture, 0, on_flat.T_site_base)
    heights[(np.abs(x - foot[0]) < 0.3) & (np.abs(y - side * 0.7) < 0.15)] = 0.6
    dem = Dem(heights, flat.geometry, "pillar", Provenance({}))
    q = on_flat.posture[:6]
    up = moved(athlete, 0, q, (0, 0, 0.2))
    across = up.copy()
    across[0] += side * 0.5
    sequence = sequence_of(
        on_flat, Command("LEG_MOVE", 0, up, 2.0, "lift"), Command("LEG_MOVE", 0, across, 2.0, "swing")
    )
    report = referee(athlete, sequence, dem, MOON)
    assert not report.passed
    hit = report.contacts[0]
    assert hit.link_a == "leg0_wheel"
    assert hit.link_b == "terrain"
    assert hit.row == 1
    assert hit.force > 20
    assert report.ended[0] < hit.start < hit.end <= report.ended[-1] + MOON.rest + TIME_STEP
    assert referee(athlete, sequence, flat, MOON).contacts == ()


def test_two_legs_that_meet_are_named(athlete, flat, on_flat):
    """One leg in the air turned towards its neighbour until they touch."""
    up = moved(athlete, 0, on_flat.posture[:6], (0, 0, 0.25))
    across = up.copy()
    across[0] += 2.3
    sequence = sequence_of(
        on_flat, Command("LEG_MOVE", 0, up, 2.0, "lift"), Command("LEG_MOVE", 0, across, 2.0, "swing")
    )
    report = referee(athlete, sequence, flat, MOON)
    pairs = {frozenset((one.link_a[:4], one.link_b[:4])) for one in report.contacts}
    assert frozenset(("leg0", "leg1")) in pairs
    assert any("leg0" in text and "leg1" in text and "touched" in text for text in report.failures)


def watched(
    robot, dem, state, target, duration: float, settings: PhysicsSettings, leg: int | None = None
) -> tuple[RunObserver, np.ndarray]:
    """A posture move under watch, and how far each hub has gone in the site (legs, 3). leg: that it is said to move."""
    rover = PhysicalRover(robot, dem, state, settings)
    watch = RunObserver(rover, {})
    watch.row(0, leg, swings=False)
    hubs = apply(rover.T_site_base, wheel_centers(robot, rover.posture))
    rover.command(CommandMessage("c", "s", 0, "POSTURE_MOVE", None, target, duration))
    for _ in range(round((duration + 0.5) / TIME_STEP)):
        rover.step(TIME_STEP)
        watch.look()
    assert rover.mode == "idle"
    return watch, apply(rover.T_site_base, wheel_centers(robot, rover.posture)) - hubs


def test_slip_is_that_of_the_material_at_the_contact(athlete, flat, bent):
    """Feet pushed outward without turning slide as far as their hubs go; where friction holds they stay."""
    target = bent.posture.copy()
    for leg in athlete.legs:
        own = slice(6 * leg, 6 * leg + 6)
        target[own] = moved(athlete, leg, target[own], 0.12 * rotation("z", np.deg2rad(60.0 * leg))[:, 0])
    watch, went = watched(athlete, flat, bent, target, 3.0, PhysicsSettings(gravity=1.62, friction=0.05))
    went = np.linalg.norm(went[:, :2], axis=1)
    assert (went > 0.08).all()
    # feet turn a little as their joints give way: 1° of turn is 4 mm of rolling
    assert np.allclose(watch.slip, went, atol=0.008)
    holding, _ = watched(athlete, flat, bent, target, 3.0, PhysicsSettings(friction=1.5))
    assert holding.slip.max() < 0.1 * watch.slip.min()
    sequence = sequence_of(bent, Command("POSTURE_MOVE", None, target, 3.0))
    report = referee(athlete, sequence, flat, RefereeSettings(PhysicsSettings(gravity=1.62, friction=0.05)))
    assert [text for text in report.failures if re.match(r"the supporting wheel \d slipped 1\d\d\.\d mm", text)]


def test_what_a_wheel_is_dragged_as_it_is_put_down_is_no_slip_of_the_support_that_it_becomes(athlete, flat, bent):
    target = bent.posture.copy()
    for leg in athlete.legs:
        own = slice(6 * leg, 6 * leg + 6)
        target[own] = moved(athlete, leg, target[own], 0.12 * rotation("z", np.deg2rad(60.0 * leg))[:, 0])
    watch, _ = watched(athlete, flat, bent, target, 3.0, PhysicsSettings(gravity=1.62, friction=0.05), leg=2)
    assert watch.drag[2] > 0.08
    for row, leg in enumerate((None, 3, None), 1):
        watch.row(row, leg, swings=False)
        watch.look()
        assert watch.slip[2] < 1e-4
    assert watch.drag[3] == pytest.approx(watch.slip[3], abs=1e-4)
    assert np.delete(watch.slip, 2).min() > 0.08


def test_a_wheel_that_rolls_does_not_slip(athlete, flat, bent):
    """All feet turned about their hubs alike, as balls that roll along x: the rover goes radius × angle."""
    angle = 0.15
    target = bent.posture.copy()
    for leg in athlete.legs:
        own = slice(6 * leg, 6 * leg + 6)
        T = leg_wheel_pose(athlete, target[own], leg)
        T[:3, :3] = rotation("y", angle) @ T[:3, :3]
        solutions = solve_leg(athlete, leg, T[None])
        found = solutions.q[0][solutions.valid[0]]
        target[own] = found[np.argmin(np.abs(found - target[own]).sum(axis=1))]
    watch, went = watched(athlete, flat, bent, target, 3.0, PhysicsSettings())
    assert went[:, 0].mean() == pytest.approx(angle * athlete.wheel_radius, abs=0.006)
    assert watch.slip.max() < 0.1 * angle * athlete.wheel_radius


def test_a_planted_fall_is_seen(athlete, flat, on_flat):
    target = on_flat.posture.copy()
    for leg in (0, 1, 5):
        target[6 * leg + 1] = -1.5
    waiting = Command("WAIT", None, None, 1.0)
    sequence = sequence_of(on_flat, Command("POSTURE_MOVE", None, target, 6.0), waiting)
    report = referee(athlete, sequence, flat)
    assert re.search("tipped|come down", report.tipped)
    assert report.failures[0] == report.tipped
    assert report.commands == 0
    assert len(report.ended) == 1
    unplanned = {event.leg for event in report.events if event.kind == "lift-off" and not event.planned}
    assert unplanned & {0, 1, 5}


def test_a_leg_that_never_lifts_is_told(athlete, flat, on_flat):
    up = moved(athlete, 0, on_flat.posture[:6], (0, 0, 0.05))
    sequence = sequence_of(on_flat, Command("LEG_MOVE", 0, up, 2.0, "lift"))
    assert "wheel 0 never left the ground" in referee(athlete, sequence, flat).failures
    high = moved(athlete, 0, on_flat.posture[:6], (0, 0, 0.25))
    sequence = sequence_of(on_flat, Command("LEG_MOVE", 0, high, 2.0, "lift"))
    assert "wheel 0 did not come down again" in referee(athlete, sequence, flat).failures


def test_a_command_that_the_rover_refuses_is_told(athlete, flat, on_flat):
    beyond = np.array(on_flat.posture[:6])
    beyond[1] = 3.0
    report = referee(athlete, sequence_of(on_flat, Command("LEG_MOVE", 0, beyond, 3.0)), flat)
    assert report.commands == 0
    assert any(re.match(r"row 1 was not carried out: joint 1 of leg 0", text) for text in report.failures)


def test_lowering_until_touch_down_is_refereed(athlete, flat, on_flat):
    q = on_flat.posture[:6]
    up, deep = moved(athlete, 0, q, (0, 0, 0.2)), np.array(q)
    deep[1] += 0.1
    sequence = sequence_of(
        on_flat,
        Command("LEG_MOVE", 0, up, 2.0, "lift"),
        Command("LEG_LOWER", 0, deep, 6.0, "lower", force=100.0),
    )
    noisy = RefereeSettings(PhysicsSettings(gravity=1.62, noise=Noise(force=5.0)), touch=1.0)
    report = referee(athlete, sequence, flat, noisy)
    assert report.passed, report.failures
    assert report.ended[-1] < 8.0 - 0.5


def test_parts_that_do_not_fit_are_refused(athlete, flat, on_flat, step):
    with pytest.raises(InvalidInput, match="one 4 × 4 transform for each command"):
        referee(athlete, step, flat, poses=np.eye(4))
    other = Sequence("spider", step.commands, step.start, step.predicted, step.T_site_base, (), Provenance({}))
    with pytest.raises(InvalidInput, match="the sequence is for spider"):
        referee(athlete, other, flat)
    with pytest.raises(InvalidInput, match="slip must be above zero"):
        RefereeSettings(slip=0.0)


def test_clearance_is_the_least_height_of_the_leg_over_the_ground(athlete, flat, on_flat):
    """By an independent way: the wheel is the lowest part, a drum whose rim is known."""
    rover = PhysicalRover(athlete, flat, on_flat, PhysicsSettings(gravity=1.62))
    watch = RunObserver(rover, {})
    up = moved(athlete, 0, rover.commanded[:6], (0, 0, 0.2))
    rover.command(CommandMessage("c", "s", 0, "LEG_MOVE", 0, up, 2.0))
    rover.step(3.0)
    watch.row(0, 0, True)
    for _ in range(50):
        rover.step(TIME_STEP)
        watch.look()
    assert rover.mode == "idle"
    T = rover.T_site_base @ leg_wheel_pose(athlete, rover.posture[:6], 0)
    axle = T[:3, 1]
    lowest = T[2, 3] - athlete.wheel_radius * np.hypot(axle[0], axle[1]) - 0.5 * 0.22 * abs(axle[2])
    # the drum has 24 corners: its lowest one is up to r (1 − cos 7.5°) = 2 mm higher than a round rim; it sways a bit
    assert -0.001 <= watch.clearance - lowest <= 0.003
