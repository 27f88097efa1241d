"""Static torques: virtual work, a free-flying second model, and optimality against other force choices."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from footfall.balance.balance_settings import SIDES, BalanceSettings
from footfall.balance.cones import generators
from footfall.balance.forces import distribute, equilibrium_matrix
from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.posture_statics import PostureStatics
from footfall.balance.torque_candidates import (
    StandingLegs,
    torque_ratios_for_postures,
    torque_ratios_in_the_air,
)
from footfall.balance.torque_kernel import hull_rows
from footfall.balance.torques import contact_points, holding_torques, torque_check, torque_margin
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse, rotation_rpy, transform
from footfall.robot.description import with_payload
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass, gravity_torques, leg_link_poses
from footfall.robot.model import Robot

GRAVITY = 9.81


def body_centers(robot, posture):
    """Mass and centre in base of every body, chassis included, by plain forward kinematics."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, posture)
    bodies = [
        (inertia.mass, data.oMi[i] * inertia.lever) for i, inertia in enumerate(robot.model.inertias) if inertia.mass
    ]
    payload = robot.description.payload
    return bodies + ([(payload.mass, payload.position)] if payload else [])


@pytest.fixture
def pose():
    return transform(rotation_rpy(0.08, -0.05, 0.7), [3.0, -2.0, 1.6])


@pytest.fixture
def posture(athlete, rng):
    return athlete.posture("stand") + 0.15 * rng.normal(size=36)


def free_flying_torques(robot, posture, T_site_base, legs, contacts, forces):
    """Generalised forces of the rover with a floating chassis: six of the chassis, then the joints."""
    model = pin.buildModelFromXML(robot.description.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    q = np.concatenate([pin.SE3ToXYZQUAT(pin.SE3(T_site_base)), posture])
    total = pin.computeGeneralizedGravity(model, data, q)
    pin.computeJointJacobians(model, data, q)
    for leg, contact, force in zip(legs, contacts, forces, strict=True):
        joint = model.getJointId(robot.joint_names[6 * leg + 5])
        J = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        arm = contact - data.oMi[joint].translation
        total = total - (J[:3] + np.cross(J[3:].T, arm).T).T @ force
    return total


@pytest.mark.parametrize("legs", [(0, 1, 2, 3, 4, 5), (0, 1, 2, 4, 5), (1, 3, 5)])
def test_torques_agree_with_a_free_flying_model_and_leave_the_chassis_unloaded(athlete, posture, pose, rng, legs):
    normals = np.column_stack([0.15 * rng.normal(size=(len(legs), 2)), np.ones(len(legs))])
    check = torque_margin(athlete, posture, pose, legs, normals)
    assert check.feasible
    contacts = contact_points(athlete, posture, pose, legs, normals)
    total = free_flying_torques(athlete, posture, pose, legs, contacts, check.forces[list(legs)])
    assert np.abs(total[:6]).max() < 1e-6 * athlete.mass * GRAVITY
    assert np.abs(total[6:] - check.torques).max() < 1e-6
    ratios = np.abs(total[6:]) / athlete.torque_limits
    assert ratios.max() == pytest.approx(check.ratio, abs=1e-9)
    assert ratios[check.joint] == pytest.approx(check.ratio, abs=1e-6)
    assert athlete.joint_names[check.joint] == check.joint_name
    in_the_air = [leg for leg in athlete.legs if leg not in legs]
    assert not check.forces[in_the_air].any()


def test_torques_are_the_gradient_of_energy_less_the_work_of_the_ground(athlete, posture, pose, rng):
    legs = (0, 2, 3, 5)
    contacts = contact_points(athlete, posture, pose, legs, np.tile([0, 0, 1.0], (4, 1)))
    forces = 1000 * rng.normal(size=(4, 3))
    torques = holding_torques(athlete, posture, pose, legs, contacts, forces)
    fixed_in_ankle = [
        apply(inverse(leg_link_poses(athlete, posture[6 * leg : 6 * leg + 6], leg)[f"leg{leg}_ankle_roll"]), p)
        for leg, p in zip(legs, apply(inverse(pose), contacts), strict=True)
    ]

    def work(q):
        energy = sum(m * GRAVITY * apply(pose, c)[2] for m, c in body_centers(athlete, q))
        for leg, point, force in zip(legs, fixed_in_ankle, forces, strict=True):
            T_base_ankle = leg_link_poses(athlete, q[6 * leg : 6 * leg + 6], leg)[f"leg{leg}_ankle_roll"]
            energy -= force @ apply(pose, apply(T_base_ankle, point))
        return energy

    h = 1e-5
    numeric = [(work(posture + h * e) - work(posture - h * e)) / (2 * h) for e in np.eye(36)]
    assert torques == pytest.approx(np.array(numeric), abs=2e-3)


def test_contact_jacobians_against_finite_differences(athlete, posture):
    legs = (4, 0)
    points = np.array([[-1.0, -2.0, -1.4], [2.0, 0.3, -1.5]])
    found = PostureStatics(athlete, posture).contact_jacobians(legs, points)
    h = 1e-6
    for leg, point, J in zip(legs, points, found, strict=True):
        own, link = posture[6 * leg : 6 * leg + 6], f"leg{leg}_ankle_roll"
        local = apply(inverse(leg_link_poses(athlete, own, leg)[link]), point)
        numeric = np.column_stack(
            [
                apply(leg_link_poses(athlete, own + h * e, leg)[link], local)
                - apply(leg_link_poses(athlete, own - h * e, leg)[link], local)
                for e in np.eye(6)
            ]
        ) / (2 * h)
        assert pytest.approx(numeric, abs=1e-8) == J


def test_one_pass_agrees_with_the_robot_s_kinematics(athlete, posture, pose, rng):
    for robot in (athlete, Robot(with_payload(athlete.description, 90.0))):
        statics = PostureStatics(robot, posture)
        assert statics.com == pytest.approx(center_of_mass(robot, posture), abs=1e-9)
        expected = gravity_torques(robot, posture, pose[:3, :3], 3.71)
        assert statics.gravity_torques(pose[2, :3], 3.71) == pytest.approx(expected, abs=1e-8)
    normals = np.column_stack([0.2 * rng.normal(size=(6, 2)), np.ones(6)])
    found = contact_points(athlete, posture, pose, range(6), normals)
    expected = [contact_point(athlete, posture, leg, pose, normal) for leg, normal in enumerate(normals)]
    assert found == pytest.approx(np.array(expected), abs=1e-9)
    # a wheel that lies flat, its axle along the normal
    T_base_wheel = leg_link_poses(athlete, posture[:6], 0)["leg0_wheel"]
    axle = pose[:3, :3] @ T_base_wheel[:3, 1]
    flat = contact_points(athlete, posture, pose, [0], [axle])[0]
    centre = apply(pose, T_base_wheel[:3, 3])
    assert flat == pytest.approx(centre + athlete.wheel_radius * pose[:3, :3] @ T_base_wheel[:3, 0])


def least_ratio_by_highs(robot, posture, T_site_base, legs, normals, friction, gravity):
    """The program of the module's docstring over the weights of the pyramids' edges, by HiGHS; None: infeasible."""
    contacts = np.array(
        [contact_point(robot, posture, leg, T_site_base, n) for leg, n in zip(legs, normals, strict=True)]
    )
    com = apply(T_site_base, center_of_mass(robot, posture))
    edges = generators(normals, friction)
    wide = SIDES * len(legs)
    spread = np.zeros((3 * len(legs), wide))
    for foot in range(len(legs)):
        spread[3 * foot : 3 * foot + 3, SIDES * foot : SIDES * foot + SIDES] = edges[foot].T
    still = holding_torques(robot, posture, T_site_base, legs, contacts, np.zeros((len(legs), 3)), gravity)
    weight = robot.mass * gravity
    effect = np.column_stack(
        [
            holding_torques(robot, posture, T_site_base, legs, contacts, weight * column.reshape(-1, 3), gravity)
            - still
            for column in spread.T
        ]
    )
    constant, effect = still / robot.torque_limits, effect / robot.torque_limits[:, None]
    ones = np.ones((len(constant), 1))
    solved = linprog(
        np.append(np.zeros(wide), 1.0),
        A_ub=np.block([[effect, -ones], [-effect, -ones]]),
        b_ub=np.concatenate([-constant, constant]),
        A_eq=np.hstack([equilibrium_matrix(contacts, com) @ spread, np.zeros((6, 1))]),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        method="highs",
    )
    return solved.fun if solved.status == 0 else None


def test_the_ratio_is_that_of_the_linear_program(athlete, rng):
    feasible = []
    for trial in range(120):
        k = int(rng.integers(2, 7))
        legs = sorted(rng.permutation(6)[:k].tolist())
        q = athlete.posture("stand") + rng.uniform(0, 0.4) * rng.normal(size=36)
        T = transform(rotation_rpy(0.1 * rng.normal(), 0.1 * rng.normal(), rng.uniform(-3, 3)), 5 * rng.normal(size=3))
        normals = np.column_stack([rng.uniform(0, 0.3) * rng.normal(size=(k, 2)), np.ones(k)])
        if trial % 6 == 0:
            normals = np.tile([0, 0, 1.0], (k, 1))
        friction, gravity = rng.uniform(0.1, 1.0), rng.choice([1.62, 9.81])
        check = torque_margin(athlete, q, T, legs, normals, friction, gravity)
        expected = least_ratio_by_highs(athlete, q, T, legs, normals, friction, gravity)
        assert check.feasible == (expected is not None)
        if expected is not None:
            assert check.ratio == pytest.approx(expected, abs=1e-6)
        feasible.append(check.feasible)
    assert 0.3 < np.mean(feasible) < 0.9


def test_a_tilted_site_is_a_tilted_rover(athlete, posture, pose, rng):
    """Tilting gravity by the settings is the same as tilting rover and ground the other way."""
    normals = np.column_stack([0.1 * rng.normal(size=(5, 2)), np.ones(5)])
    legs = (0, 1, 2, 4, 5)
    settings = BalanceSettings(slope=0.15, uphill=0.8)
    R = settings.R_level_site
    tilted = torque_check(athlete, posture, pose, legs, normals, settings)
    turned = torque_check(athlete, posture, transform(R) @ pose, legs, normals @ R.T, BalanceSettings())
    assert tilted.ratio == pytest.approx(turned.ratio, abs=1e-9)
    assert tilted.torques == pytest.approx(turned.torques, abs=1e-5)
    assert tilted.forces @ R.T == pytest.approx(turned.forces, abs=1e-5)
    up_site = R[2]
    assert tilted.forces.sum(axis=0) == pytest.approx(athlete.mass * GRAVITY * up_site, abs=1e-5)


def test_a_payload_of_the_settings_is_one_of_the_robot(athlete, posture, pose):
    up = np.tile([0, 0, 1.0], (6, 1))
    place = np.array([0.3, 0.2, 0.4])
    carrying = Robot(with_payload(athlete.description, 200.0, position=place))
    expected = torque_margin(carrying, posture, pose, range(6), up)
    found = torque_check(
        athlete, posture, pose, range(6), up, BalanceSettings(payload_mass=200.0, payload_position=place)
    )
    assert found.ratio == pytest.approx(expected.ratio, abs=1e-9)
    assert found.ratio > torque_margin(athlete, posture, pose, range(6), up).ratio


@pytest.mark.parametrize("legs", [(0, 1, 3, 4, 5), (0, 3, 4), (0, 4)])
def test_many_postures_of_a_leg_get_the_ratio_of_each(athlete, posture, pose, rng, legs):
    settings = BalanceSettings(friction=0.5, slope=0.08, uphill=-0.5, payload_mass=100.0)
    normals = np.column_stack([0.1 * rng.normal(size=(len(legs), 2)), np.ones(len(legs))])
    qs = posture[12:18] + 0.3 * rng.normal(size=(60, 6))
    own = np.column_stack([0.2 * rng.normal(size=(60, 2)), np.ones(60)])
    qs[7, 3] = np.nan
    own[8] = np.nan
    own[9] = [0.0, 0.0, -2.0]
    found = torque_ratios_for_postures(athlete, posture, pose, legs, normals, 2, qs, own, settings)
    assert np.flatnonzero(np.isnan(found)).tolist() == [7, 8]
    assert found[9] == np.inf
    for i in set(range(60)) - {7, 8, 9}:
        q = posture.copy()
        q[12:18] = qs[i]
        one = torque_check(athlete, q, pose, [*legs, 2], np.vstack([normals, own[i]]), settings)
        # approx calls two infinities equal
        assert found[i] == pytest.approx(one.ratio, abs=1e-8)
    assert np.isfinite(found).sum() > 3
    again = torque_ratios_for_postures(athlete, posture, pose, legs, normals, 2, qs, own, settings)
    assert again.tobytes() == found.tobytes()


def test_no_other_forces_spare_the_motors_more(athlete, posture, pose, rng):
    legs = (0, 1, 2, 3, 5)
    normals = np.tile([0, 0, 1.0], (5, 1))
    check = torque_margin(athlete, posture, pose, legs, normals)
    contacts = contact_points(athlete, posture, pose, legs, normals)
    com = apply(pose, center_of_mass(athlete, posture))
    weight = athlete.mass * GRAVITY

    def ratio(forces):
        return np.max(np.abs(holding_torques(athlete, posture, pose, legs, contacts, forces)) / athlete.torque_limits)

    least_norm = distribute(contacts, normals, com, athlete.mass, friction=0.6)
    assert ratio(least_norm) >= check.ratio - 1e-9
    edges = generators(normals, 0.6)
    spread = np.zeros((15, 5 * SIDES))
    for foot in range(5):
        spread[3 * foot : 3 * foot + 3, SIDES * foot : SIDES * foot + SIDES] = edges[foot].T
    balance = equilibrium_matrix(contacts, com) @ spread
    for _ in range(40):
        solved = linprog(rng.normal(size=5 * SIDES) + 1.5, A_eq=balance, b_eq=[0, 0, 1, 0, 0, 0], method="highs")
        if solved.status == 0:
            assert ratio(weight * (spread @ solved.x).reshape(-1, 3)) >= check.ratio - 1e-7


def test_ratio_scales_with_gravity_and_more_legs_never_hurt(athlete, posture, pose):
    up = np.tile([0, 0, 1.0], (6, 1))
    six = torque_margin(athlete, posture, pose, range(6), up)
    moon = torque_margin(athlete, posture, pose, range(6), up, gravity=1.62)
    assert moon.ratio == pytest.approx(six.ratio * 1.62 / 9.81, rel=1e-6)
    assert six.holds


def test_standing_is_held_and_two_legs_are_told_infeasible(athlete):
    stand = athlete.posture("stand")
    check = torque_margin(athlete, stand, np.eye(4), range(6), np.tile([0, 0, 1.0], (6, 1)))
    assert check.holds
    assert check.forces.sum(axis=0) == pytest.approx([0, 0, athlete.mass * GRAVITY], abs=1e-6)
    two = torque_margin(athlete, stand, np.eye(4), [0, 1], np.tile([0, 0, 1.0], (2, 1)))
    assert not two.feasible
    assert not two.holds
    assert two.ratio == np.inf
    assert np.isnan(two.forces).all()
    assert not torque_margin(athlete, stand, np.eye(4), [], np.zeros((0, 3))).feasible


def test_bad_input_is_refused_by_name(athlete):
    stand, up = athlete.posture("stand"), np.tile([0, 0, 1.0], (6, 1))
    with pytest.raises(InvalidInput, match="one normal"):
        torque_margin(athlete, stand, np.eye(4), range(6), up[:5])
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        torque_margin(athlete, stand, np.eye(4), [0, 1, 6], up[:3])
    with pytest.raises(InvalidInput, match="only once"):
        torque_margin(athlete, stand, np.eye(4), [0, 1, 1], up[:3])
    with pytest.raises(InvalidInput, match="normal of contact 2 must point up"):
        torque_margin(athlete, stand, np.eye(4), range(6), up * [[1], [1], [-1], [1], [1], [1]])
    with pytest.raises(InvalidInput, match="friction"):
        torque_margin(athlete, stand, np.eye(4), range(6), up, friction=0.0)
    with pytest.raises(InvalidInput, match="only once"):
        torque_ratios_for_postures(
            athlete, stand, np.eye(4), [0, 1, 2], up[:3], 2, stand[None, 12:18], up[:1], BalanceSettings()
        )
    with pytest.raises(InvalidInput, match="six angles and one normal"):
        torque_ratios_for_postures(
            athlete, stand, np.eye(4), [0, 1], up[:2], 2, stand[None, 12:18], up[:2], BalanceSettings()
        )
    with pytest.raises(InvalidInput, match="finite joint angles"):
        torque_margin(athlete, stand * np.nan, np.eye(4), range(6), up)


def test_centres_of_mass_agree_with_a_sum_over_bodies(athlete, posture, rng):
    qs = rng.uniform(-1.0, 1.0, (20, 6))
    found = centers_of_mass(athlete, posture, 4, qs)
    for q_leg, center in zip(qs, found, strict=True):
        q = posture.copy()
        q[24:30] = q_leg
        bodies = body_centers(athlete, q)
        expected = sum(m * c for m, c in bodies) / sum(m for m, _ in bodies)
        assert center == pytest.approx(expected, abs=1e-9)
    assert np.isnan(centers_of_mass(athlete, posture, 4, np.full((1, 6), np.nan))).all()
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        centers_of_mass(athlete, posture, 6, qs)


@pytest.mark.parametrize("friction", [0.6, 0.3])
@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_the_worst_torque_in_the_air_is_the_largest_of_all(athlete, rng, friction, slope):
    posture = athlete.posture("stand")
    settings = BalanceSettings(friction=friction, slope=slope, uphill=0.7)
    standing, normals = [0, 1, 3, 4, 5], np.tile((0.0, 0.0, 1.0), (5, 1))
    start = posture[12:18]
    for _ in range(6):
        ends = start + rng.normal(0, 0.5, (4, 6))
        qs = np.concatenate([a + np.linspace(0, 1, 25)[:, None] * (b - a) for a, b in itertools.pairwise(ends)])
        ratios = torque_ratios_in_the_air(athlete, posture, np.eye(4), standing, normals, 2, qs, settings)
        at, worst = StandingLegs(athlete, posture, np.eye(4), standing, normals, 2, settings).worst(qs)
        assert worst == pytest.approx(ratios.max(), rel=1e-9)
        assert ratios[at] == pytest.approx(worst, rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 40, 300])
def test_hull_rows_are_farthest_in_every_direction(rng, count):
    general = rng.normal(size=(count, 2))
    on_a_line = np.column_stack([general[:, 0], 2 * general[:, 0]])
    for points in (general, np.round(general), on_a_line, np.tile(general[:1], (count, 1))):
        rows = hull_rows(points, np.lexsort((points[:, 1], points[:, 0])))
        assert len(set(rows.tolist())) == len(rows) >= 1
        directions = rng.normal(size=(200, 2))
        assert (points[rows] @ directions.T).max(axis=0) == pytest.approx((points @ directions.T).max(axis=0))
    if count > 3:
        rows = hull_rows(general, np.lexsort((general[:, 1], general[:, 0])))
        assert set(rows.tolist()) == set(ConvexHull(general).vertices.tolist())
