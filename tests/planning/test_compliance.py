"""Sag: equilibria that are right by other means, contacts that only push, starts from telemetry."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import footfall
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.torques import holding_torques
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, transform
from footfall.planning.compliance.calibrate import calibrated, sag_ratio
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import ALIKE, DOUBT, MOST_SOFTER, UNEXPLAINED, measured, softer_by
from footfall.planning.compliance.predict import advanced, predict
from footfall.planning.scene.lift import vertical
from footfall.robot.description import with_payload
from footfall.robot.kinematics import center_of_mass, gravity_torques, wheel_centers
from footfall.robot.model import Robot
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane
from tests.support.chassis_ground import wavy

MOON = BalanceSettings(gravity=1.62)


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy()
    return dem, footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def rover(athlete, scene):
    return CompliantRover(athlete, scene[0])


@pytest.fixture(scope="module")
def stood(rover, scene):
    return rover.let_down(scene[1].posture, scene[1].T_site_base)


def lift_of(robot, rest, leg, height):
    """Set points, row by row, that lift a wheel straight up if nothing gives way."""
    own = slice(6 * leg, 6 * leg + 6)
    up = vertical(robot, leg, rest.T_site_base, rest.commanded[own], height)
    assert not isinstance(up, str), up
    rows = np.tile(rest.commanded, (len(up), 1))
    rows[:, own] = up
    return rows


@pytest.fixture(scope="module")
def walked(athlete, rover, stood):
    """After a leg was lifted and put down a little elsewhere: strained, as after walking."""
    rest = stood
    for leg in (0, 3):
        rest = predict(rover, rest, lift_of(athlete, stood, leg, 0.35)).rests[-1]
        back = rest.commanded.copy()
        back[6 * leg : 6 * leg + 6] = stood.commanded[6 * leg : 6 * leg + 6] + np.array(
            [0.02, 0.0, 0.01, 0.0, -0.01, 0.0]
        )
        rest = advanced(rover, rest, back)
    assert rest.settled
    return rest


def require_balance(robot, rest, gravity=9.81, mass=None):
    """The whole rover's forces and moments, and each joint's torque, by other means."""
    weight = (mass or robot.mass) * gravity
    com = apply(rest.T_site_base, center_of_mass(robot, rest.posture))
    points = rest.hubs - robot.wheel_radius * rest.normals
    assert np.abs(rest.forces.sum(axis=0) - (0, 0, weight)).max() < 1e-3
    assert np.abs(np.cross(points - com, rest.forces).sum(axis=0)).max() < 1e-2
    held = holding_torques(robot, rest.posture, rest.T_site_base, list(robot.legs), points, rest.forces, gravity)
    spring = robot.stiffness * (rest.commanded + rest.bias - rest.posture)
    assert np.abs(spring - held).max() < 1e-3
    assert np.allclose(rest.torques, spring)


def require_contacts(rover, rest):
    """Wheels push only, as hard as they are pressed in, inside friction; what is off the ground feels nothing."""
    gaps, loads = rover.gaps(rest), rest.loads
    assert (loads >= 0).all()
    assert np.allclose(loads, np.maximum(-gaps, 0) * rover.wheel_stiffness, atol=1e-3)
    sideways = np.linalg.norm(rest.forces - loads[:, None] * rest.normals, axis=1)
    assert (sideways <= rover.settings.balance.friction * loads + 1e-3).all()


def test_a_standing_rover_is_in_balance_and_has_sagged(athlete, scene, rover, stood):
    require_balance(athlete, stood)
    require_contacts(rover, stood)
    assert stood.touching.all()
    sank = scene[1].T_site_base[2, 3] - stood.T_site_base[2, 3]
    # more than its wheels alone would, less than anything would break
    assert athlete.mass * 9.81 / 6 / athlete.description.wheel_stiffness < sank < 0.08


def test_a_walked_rover_is_in_balance_at_every_waypoint(athlete, rover, walked):
    motion = predict(rover, walked, lift_of(athlete, walked, 1, 0.3))
    assert motion.reason == ""
    for rest in motion.rests:
        require_balance(athlete, rest)
        require_contacts(rover, rest)
    assert motion.rests[0].touching[1]
    assert not motion.rests[-1].touching[1]
    assert np.array_equal(motion.gaps > 0, ~np.array([rest.touching for rest in motion.rests]))


def test_a_hanging_leg_bends_by_its_own_weight_alone(athlete, rover, stood):
    rest = predict(rover, stood, lift_of(athlete, stood, 2, 0.35)).rests[-1]
    own = slice(12, 18)
    G = gravity_torques(athlete, rest.posture, rest.T_site_base[:3, :3])
    assert not rest.touching[2]
    assert np.allclose(rest.posture[own] - rest.commanded[own], -G[own] / athlete.stiffness[own], atol=1e-7)


def test_a_wheel_on_a_rigid_leg_is_one_spring(athlete):
    """With joints 20 times as stiff, level and symmetric, each wheel's spring carries a sixth of the weight."""
    dem = plane(size=10.0, resolution=0.1)
    state = footfall.stand(athlete, dem)
    rover = CompliantRover(athlete, dem, ComplianceSettings(joint_scale=20.0))
    rest = rover.let_down(state.posture, state.T_site_base)
    share = athlete.mass * 9.81 / 6
    assert np.allclose(rest.loads, share, rtol=1e-3)
    assert np.allclose(-rover.gaps(rest), share / 60e3, rtol=1e-3)
    sank = state.T_site_base[2, 3] - rest.T_site_base[2, 3]
    assert share / 60e3 < sank < 1.1 * share / 60e3


def energy(robot, rest, wheel_stiffness):
    """Potential energy [J] of a rover whose wheels stick and don't roll, over (42,) changes from ``rest``."""

    def at(x):
        T = transform(
            Rotation.from_rotvec(x[3:6]).as_matrix() @ rest.T_site_base[:3, :3], rest.T_site_base[:3, 3] + x[:3]
        )
        q = rest.posture + x[6:]
        strain = apply(T, wheel_centers(robot, q)) - rest.rims
        pressed = rest.touching & (np.sum(strain * rest.normals, axis=1) < 0)
        springs = 0.5 * np.sum(robot.stiffness * (q - rest.commanded) ** 2)
        height = apply(T, center_of_mass(robot, q))[2]
        return springs + robot.mass * 9.81 * height + 0.5 * wheel_stiffness * np.sum(strain[pressed] ** 2)

    return at


@pytest.mark.parametrize("lifted", [None, 4])
def test_where_wheels_neither_roll_nor_slip_the_energy_is_least(athlete, scene, lifted, rng):
    """scipy minimises the energy over all 42 coordinates with kinematics of another library."""
    dem, state = scene
    rover = CompliantRover(athlete, dem, ComplianceSettings(rolling=False))
    rest = rover.let_down(state.posture, state.T_site_base)
    if lifted is not None:
        rest = predict(rover, rest, lift_of(athlete, rest, lifted, 0.35)).rests[-1]
        assert not rest.touching[lifted]
    of = energy(athlete, rest, rover.wheel_stiffness)
    step = 1e-6
    slope = np.array([(of(step * e) - of(-step * e)) / (2 * step) for e in np.eye(42)])
    assert np.abs(slope).max() < 0.01
    found = minimize(of, 1e-3 * rng.standard_normal(42), method="L-BFGS-B", options={"maxiter": 3000, "ftol": 1e-15})
    assert found.fun >= of(np.zeros(42)) - 1e-6
    assert np.abs(found.x).max() < 2e-4


def test_a_commanded_lift_of_20_cm_rises_by_a_third_on_earth_and_not_at_all_when_half_as_stiff(athlete):
    dem = plane(size=10.0, resolution=0.1)
    state = footfall.stand(athlete, dem)

    def rise(settings):
        rover = CompliantRover(athlete, dem, settings)
        rest = rover.let_down(state.posture, state.T_site_base)
        end = predict(rover, rest, lift_of(athlete, rest, 0, 0.2)).rests[-1]
        return end.hubs[0, 2] - rest.hubs[0, 2], end.touching[0]

    earth, moon = rise(ComplianceSettings()), rise(ComplianceSettings(balance=MOON))
    soft = rise(ComplianceSettings(joint_scale=0.5))
    rigid_wheels = rise(ComplianceSettings(wheel_scale=20.0))
    assert 0.25 * 0.2 < earth[0] < 0.4 * 0.2
    assert not earth[1]
    assert moon[0] > 0.8 * 0.2
    assert soft[1]
    assert 0.35 * 0.2 < rigid_wheels[0] < 0.6 * 0.2


def test_a_wheel_comes_down_where_the_ground_is(athlete):
    """Lowered over a slab of 6 cm it touches at the slab's height, and the load grows from there on."""
    x = np.arange(-5, 5.05, 0.1)
    heights = np.where(x > 1.5, 0.06, 0.0)[None, :].repeat(len(x), 0).astype(np.float32)
    state = footfall.stand(athlete, plane(size=10.0, resolution=0.1))
    flat = CompliantRover(athlete, plane(size=10.0, resolution=0.1))
    up = lift_of(athlete, flat.let_down(state.posture, state.T_site_base), 0, 0.4)
    lifted = predict(flat, flat.let_down(state.posture, state.T_site_base), up).rests[-1]
    rover = CompliantRover(athlete, from_heights(heights, 0.1, -5.0, -5.0))
    down = predict(rover, lifted, up[::-1])
    touching = np.array([rest.touching[0] for rest in down.rests])
    first = int(np.argmax(touching))
    assert 0 < first < len(up) - 1
    assert touching[first:].all()
    assert down.rests[first].contacts[0, 2] == pytest.approx(0.06, abs=1e-6)
    loads = np.array([rest.loads[0] for rest in down.rests])[first:]
    assert (np.diff(loads) > 0).all()


def test_telemetry_gives_the_springs_back(athlete, rover, walked):
    state = rover.state(walked)
    blind = replace(state, wheel_forces=np.zeros((6, 3)))
    for told, newtons, radians in ((state, 1e-3, 1e-7), (blind, 2.0, 2e-4)):
        start = measured(rover, told, walked.commanded)
        # without forces not exactly: the rims were pressed to where the waves have another normal
        assert np.abs(start.forces - walked.forces).max() < newtons
        assert np.abs(start.bias).max() < radians
        assert np.abs(start.posture - walked.posture).max() < 1e-7
    assert np.allclose(measured(rover, state).commanded, walked.commanded, atol=1e-7)
    rows = lift_of(athlete, walked, 5, 0.2)
    true, again = predict(rover, walked, rows), predict(rover, measured(rover, state, walked.commanded), rows)
    assert np.abs(true.postures - again.postures).max() < 3e-4


def test_a_wrong_model_starts_where_the_rover_was_measured(athlete, scene, rover, walked, rng):
    wrong = CompliantRover(athlete, scene[0], ComplianceSettings(joint_scale=0.7, wheel_scale=1.4))
    state = replace(rover.state(walked), wheel_forces=walked.forces + rng.normal(0, 30, (6, 3)))
    start = measured(wrong, state, walked.commanded)
    assert start.settled
    assert np.abs(start.posture - walked.posture).max() < 1e-6
    assert np.abs(start.T_site_base - walked.T_site_base).max() < 1e-6
    assert np.array_equal(start.commanded, walked.commanded)
    assert np.abs(start.bias).max() > 1e-3
    # forces are changed to balance, by little
    assert np.abs(start.forces.sum(axis=0) - (0, 0, athlete.mass * 9.81)).max() < 1e-3
    assert np.abs(start.forces - state.wheel_forces).max() < 100


def test_payload_and_slope_are_those_of_the_balance_settings(athlete, scene):
    dem, state = scene
    at = (0.3, -0.1, 0.35)
    setting = BalanceSettings(payload_mass=150.0, payload_position=np.array(at))
    one = CompliantRover(athlete, dem, ComplianceSettings(balance=setting))
    other = CompliantRover(Robot(with_payload(athlete.description, 150.0, position=at)), dem)
    rests = [each.let_down(state.posture, state.T_site_base) for each in (one, other)]
    assert np.allclose(rests[0].posture, rests[1].posture, atol=1e-9)
    assert rests[0].forces.sum(axis=0)[2] == pytest.approx((athlete.mass + 150.0) * 9.81, abs=1e-3)
    tilted = CompliantRover(athlete, dem, ComplianceSettings(balance=BalanceSettings(slope=0.1, uphill=0.5)))
    rest = tilted.let_down(state.posture, state.T_site_base)
    weight = athlete.mass * 9.81
    uphill = np.array([np.cos(0.5), np.sin(0.5), 0.0])
    assert np.allclose(rest.forces.sum(axis=0), weight * (np.sin(0.1) * uphill + (0, 0, np.cos(0.1))), atol=1e-3)


def test_a_rover_that_tips_is_told(athlete, rover, stood):
    rows = np.tile(stood.commanded, (2, 1))
    for leg in (0, 1, 2, 5):
        rows[1, 6 * leg + 1] -= 0.9
    motion = predict(rover, stood, rows)
    assert len(motion.rests) == 1
    assert "waypoint 1" in motion.reason
    assert not advanced(rover, stood, rows[1]).settled


def test_bad_inputs_are_named(athlete, scene, rover, stood):
    with pytest.raises(InvalidInput, match="n × 36 finite"):
        predict(rover, stood, np.zeros((3, 6)))
    with pytest.raises(InvalidInput, match="joint_scale must be between"):
        ComplianceSettings(joint_scale=0.0)
    state = rover.state(stood)
    forces = np.array(state.wheel_forces)
    forces[2:] = 0.0
    with pytest.raises(InvalidInput, match=r"three legs must be pressed.*here: 0, 1"):
        measured(rover, replace(state, wheel_forces=forces))
    with pytest.raises(InvalidInput, match="the state is of other"):
        measured(rover, replace(state, robot="other"))
    high = np.array(scene[1].T_site_base)
    high[2, 3] += 1.0
    with pytest.raises(InvalidInput, match="here: none"):
        rover.let_down(scene[1].posture, high)


@pytest.mark.parametrize(
    ("scales", "share"),
    # each its own, within the doubt; all alike softer or stiffer
    [(None, 0.6), (0.8, 0.2), (1.25, 0.2)],
)
def test_telemetry_tells_how_stiff_joints_are(athlete, scene, rover, rng, scales, share):
    dem, state = scene
    off = {True: [], False: []}
    for leg in range(6 if scales is None else 1):
        true = CompliantRover(athlete, dem)
        true.stiffness = true.stiffness * (rng.uniform(0.8, 1.25, len(true.stiffness)) if scales is None else scales)
        rest = true.let_down(state.posture, state.T_site_base)
        rows = lift_of(athlete, rest, leg, 0.3)
        seen = predict(true, rest, rows).rests[-1]
        for fitted, found in off.items():
            start = measured(rover, true.state(rest), rest.commanded, fitted=fitted)
            assert np.abs(start.posture - rest.posture).max() < 1e-6
            end = predict(rover, start, rows).rests[-1]
            found.append(np.linalg.norm(end.hubs - seen.hubs, axis=1).max())
    assert np.median(off[False]) > 0.003
    # joints that bear little don't show how stiff they are
    assert np.median(off[True]) < share * np.median(off[False])


def test_what_is_not_explained_of_a_leg_goes_when_its_wheel_is_lifted(athlete, scene, rover, rng):
    state = scene[1]
    rest = rover.let_down(state.posture, state.T_site_base)
    rows = lift_of(athlete, rest, 3, 0.3)
    seen = predict(rover, rest, rows).rests[-1]
    # the ground's push on leg 3 goes through another point of its wheel than the map says: its joints yield otherwise
    pushed = rest.posture.copy()
    pushed[18:24] += rng.uniform(-0.004, 0.004, 6)
    told = replace(rover.state(rest), posture=pushed)
    start = measured(rover, told, rest.commanded, fitted=False)
    assert np.abs(start.posture - pushed).max() < 1e-6
    assert np.abs(start.bias[18:24]).max() > 0.001
    end = predict(rover, start, rows).rests[-1]
    before, there, hung, told_at = (
        wheel_centers(athlete, q)[3] for q in (rest.posture, seen.posture, end.posture, pushed)
    )
    # in the air the leg is where its set points hold it, not as much off as it was on the ground
    assert np.linalg.norm(hung - there) < 0.3 * np.linalg.norm(told_at - before)


def test_a_deflection_is_stiffness_where_it_is_large_and_an_error_where_it_is_small():
    # of the two normal distributions the one that is wider takes the excess
    assert softer_by(np.array([0.2]), np.array([0.24])) == pytest.approx([1.2], rel=0.01)
    assert softer_by(np.array([1e-4, -1e-4, 0.0]), np.array([2e-3, 2e-3, 2e-3])) == pytest.approx([1.0] * 3, abs=0.01)
    even = UNEXPLAINED / DOUBT
    assert softer_by(np.array([-even]), np.array([-1.3 * even])) == pytest.approx([1.15])
    assert softer_by(np.array([0.1, 0.1]), np.array([0.9, -0.9])).tolist() == [MOST_SOFTER, 1 / MOST_SOFTER]


def test_what_all_joints_show_is_believed_of_those_that_show_little(rng):
    expected = rng.uniform(0.01, 0.03, 36) * rng.choice([-1, 1], 36)
    expected[:6] *= 0.01
    found = softer_by(expected, 1.25 * expected)
    assert found[6:] == pytest.approx(np.full(30, 1.25), abs=0.07)
    assert found[:6] == pytest.approx(np.full(6, 1.2), abs=0.05)
    # one that differs is told from the others, and says little of them
    alone = softer_by(expected, np.where(np.arange(36) == 7, 1.4 * expected, expected))
    assert alone[7] > 1.1
    assert np.delete(alone, 7) == pytest.approx(np.ones(35), abs=0.02)


def test_stiffness_from_deflections_is_the_least_squares_of_all_that_is_believed(rng):
    expected, seen = rng.normal(0, 0.02, 12), rng.normal(0, 0.02, 12)
    seen = expected * rng.uniform(0.9, 1.1) + 0.001 * seen / 0.02
    n = len(expected)
    own, common = DOUBT * np.sqrt(1 - ALIKE), DOUBT * np.sqrt(ALIKE)
    rows = np.block(
        [
            [np.diag(expected) / UNEXPLAINED, expected[:, None] / UNEXPLAINED],
            [np.eye(n) / own, np.zeros((n, 1))],
            [np.zeros((1, n)), np.array([[1 / common]])],
        ]
    )
    right = np.concatenate([(seen - expected) / UNEXPLAINED, np.zeros(n + 1)])
    parts = np.linalg.lstsq(rows, right, rcond=None)[0]
    assert softer_by(expected, seen) == pytest.approx(1 + parts[:n] + parts[n])


@pytest.mark.parametrize("scale", [0.8, 1.25])
def test_the_sag_that_was_measured_calibrates_the_stiffness(athlete, scene, rover, scale):
    dem, state = scene
    true = CompliantRover(athlete, dem, ComplianceSettings(joint_scale=scale))
    rest = true.let_down(state.posture, state.T_site_base)
    rows = lift_of(athlete, rest, 3, 0.3)
    seen = predict(true, rest, rows).postures
    start = measured(rover, true.state(rest), rest.commanded, fitted=False)
    expected = predict(rover, start, rows).postures
    ratio = sag_ratio(rows, seen, expected)
    # a leg in the air tells nothing: it hangs where its set points hold it
    assert ratio == pytest.approx(1 / scale, rel=0.06)
    assert calibrated(ComplianceSettings(wheel_scale=1.1), ratio).joint_scale == pytest.approx(scale, rel=0.06)
    assert sag_ratio(rows, expected, expected) == pytest.approx(1.0)
    assert calibrated(ComplianceSettings(), 100.0).joint_scale == 0.5
    with pytest.raises(InvalidInput, match=r"yield by 0\.0000 rad"):
        sag_ratio(rows[:1].repeat(3, 0), seen[:3], expected[:1].repeat(3, 0))
    with pytest.raises(InvalidInput, match="one shape"):
        sag_ratio(rows, seen[:-1], expected)
    with pytest.raises(InvalidInput, match="above zero"):
        calibrated(ComplianceSettings(), -0.1)
