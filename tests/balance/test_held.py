"""The compiled check of a standing rover: never kinder than the exact check, and by a floating model and HiGHS."""

from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

from footfall.balance import held_kernel
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.cones import generators
from footfall.balance.held import held_tables, postures_held
from footfall.balance.held_kernel import held_within
from footfall.balance.torques import torque_check
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation, rotation_rpy, transform
from footfall.robot.description import with_payload
from footfall.robot.ik import contact_point
from footfall.robot.leg_frames import PART_COUNT, leg_lengths
from footfall.robot.model import Robot
from footfall.robot.proof.leg_clearance_kernel import place_leg
from tests.support.kept_arrays import read_only

GRAVITY = 9.81
ROUNDING = 1e-9


def as_walks_ask(kernel, poses, T_site_base, contacts, normals, *others):
    """Contacts and normals are those of a Stance, which nobody may write."""
    return kernel(poses, T_site_base, read_only(contacts), read_only(normals), *others)


held_ratio = partial(as_walks_ask, held_kernel.held_ratio)
least_held_ratio = partial(as_walks_ask, held_kernel.least_held_ratio)
held_by_some_forces = partial(as_walks_ask, held_kernel.held_by_some_forces)


def stances(robot, rng, count, least_feet=3):
    """Postures, poses, standing legs and normals on ground from even to 40°, the chassis along it or level."""
    qs = robot.posture("stand") + rng.uniform(0.0, 0.3, (count, 1)) * rng.normal(size=(count, 36))
    Ts, normals, standing = np.empty((count, 4, 4)), np.empty((count, 6, 3)), np.zeros((count, 6), bool)
    for i in range(count):
        R = rotation("z", rng.uniform(-3, 3)) @ rotation("y", np.radians(rng.uniform(0, 40)))
        chassis = R if rng.random() < 0.7 else np.eye(3)
        roll, pitch = 0.08 * rng.normal(size=2)
        Ts[i] = transform(chassis @ rotation_rpy(roll, pitch, rng.uniform(-3, 3)), rng.normal(size=3))
        around = np.column_stack([rng.uniform(0, 0.3) * rng.normal(size=(6, 2)), np.ones(6)])
        normals[i] = around @ R.T
        standing[i, rng.permutation(6)[: rng.integers(least_feet, 7)]] = True
    return qs, Ts, standing, normals


def upward(normals, settings):
    return bool((settings.level(normals)[:, 2] > 0).all())


def placed(robot, posture, T_site_base, standing, normals):
    """Poses of the links and contacts as a planner has them, not by the call for many postures."""
    poses, contacts = np.empty((robot.leg_count * PART_COUNT, 3, 4)), np.full((robot.leg_count, 3), np.nan)
    for leg in robot.legs:
        spec = robot.description.legs[leg]
        T_site_hip = (T_site_base @ spec.T_base_hip)[:3]
        own = poses[PART_COUNT * leg : PART_COUNT * leg + PART_COUNT]
        place_leg(np.array(posture[6 * leg : 6 * leg + 6]), np.ascontiguousarray(T_site_hip), leg_lengths(spec), own)
        if standing[leg]:
            contacts[leg] = contact_point(robot, posture, leg, T_site_base, normals[leg])
    return poses, T_site_base, contacts, normals, standing


def settings_of(rng):
    """Friction, gravity, its direction, payload and pyramids, at random."""
    loaded = rng.random() < 0.5
    return BalanceSettings(
        friction=rng.uniform(0.3, 1.1),
        gravity=rng.choice([3.71, GRAVITY, GRAVITY]),
        slope=rng.choice([0.0, rng.uniform(0, 0.3)]),
        uphill=rng.uniform(-3, 3),
        payload_mass=rng.uniform(0, 300) if loaded else None,
        payload_position=rng.uniform(-0.5, 0.5, 3) if loaded else None,
        sides=int(rng.choice([4, 8, 16])),
    )


def test_nothing_is_held_that_the_exact_check_does_not_hold(athlete, rng):
    """And what it clearly holds is held; bounds and refusals of the quick part are right, too."""
    heavy = Robot(with_payload(athlete.description, 120.0, position=(0.2, -0.1, 0.4)))
    slipping = overloaded = total = 0
    for trial in range(30):
        robot, settings = (heavy if trial % 3 == 0 else athlete), settings_of(rng)
        tables, most = held_tables(robot, settings), rng.uniform(0.2, 0.55)
        qs, Ts, standing, normals = stances(robot, rng, 50)
        held = postures_held(robot, qs, Ts, standing, normals, settings, most)
        for i in range(len(qs)):
            legs = np.flatnonzero(standing[i]).tolist()
            if not upward(normals[i, legs], settings):
                assert not held[i]
                continue
            exact = torque_check(robot, qs[i], Ts[i], legs, normals[i, legs], settings)
            if held[i]:
                assert exact.ratio <= most + ROUNDING
            else:
                assert not exact.ratio <= 0.98 * most
            args = (*placed(robot, qs[i], Ts[i], standing[i], normals[i]), tables)
            assert held_within(*args, most) == held[i]
            ratio, sure = held_ratio(*args)
            if sure:
                assert ratio >= exact.ratio - ROUNDING
            least = least_held_ratio(*args)
            assert least == pytest.approx(exact.ratio, abs=ROUNDING)
            total += 1
            slipping += not exact.feasible
            overloaded += exact.feasible and exact.ratio > most
    assert slipping > total / 3
    assert overloaded > total / 3


def floating_ratio(robot, posture, T_site_base, legs, normals, settings):
    """The least ratio with a floating chassis, whose six rows are the equilibrium, by HiGHS; inf where infeasible.

    Everything is pin's: a free-flyer model, its gravity, its Jacobians. Unknown are the weights of the pyramids' edges.
    """
    model = pin.buildModelFromXML(robot.description.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    R = settings.R_level_site
    T = transform(R @ T_site_base[:3, :3], R @ T_site_base[:3, 3])
    q = np.concatenate([pin.SE3ToXYZQUAT(pin.SE3(T)), posture])
    model.gravity = pin.Motion(np.array([0.0, 0.0, -settings.gravity]), np.zeros(3))
    still = pin.computeGeneralizedGravity(model, data, q)
    pin.computeJointJacobians(model, data, q)
    edges, effects = generators(settings.level(normals), settings.friction, settings.sides), []
    for leg, normal, own in zip(legs, normals, edges, strict=True):
        contact = R @ contact_point(robot, posture, leg, T_site_base, normal)
        joint = model.getJointId(robot.joint_names[6 * leg + 5])
        J = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        J = J[:3] + np.cross(J[3:].T, contact - data.oMi[joint].translation).T
        effects.append(-J.T @ own.T * robot.mass * settings.gravity)
    effect = np.hstack(effects)
    scale = np.concatenate([np.full(6, robot.mass * settings.gravity), robot.torque_limits])
    effect, still = effect / scale[:, None], still / scale
    ones = np.ones((robot.torque_limits.size, 1))
    solved = linprog(
        np.append(np.zeros(effect.shape[1]), 1.0),
        A_ub=np.block([[effect[6:], -ones], [-effect[6:], -ones]]),
        b_ub=np.concatenate([-still[6:], still[6:]]),
        A_eq=np.hstack([effect[:6], np.zeros((6, 1))]),
        b_eq=-still[:6],
        method="highs",
    )
    assert solved.status in (0, 2)
    return solved.fun if solved.status == 0 else np.inf


def test_the_ratio_is_that_of_a_floating_model(athlete, rng):
    """The second method knows nothing of ours: neither the centre of mass, nor torques, nor the elimination."""
    held = slipping = 0
    for _ in range(100):
        settings = BalanceSettings(friction=rng.uniform(0.2, 1.0), slope=rng.uniform(0, 0.1), uphill=rng.uniform(-3, 3))
        (q,), (T,), (standing,), (normals,) = stances(athlete, rng, 1)
        legs = np.flatnonzero(standing).tolist()
        if not upward(normals[legs], settings):
            continue
        expected = floating_ratio(athlete, q, T, legs, normals[legs], settings)
        args = (*placed(athlete, q, T, standing, normals), held_tables(athlete, settings))
        assert least_held_ratio(*args) == pytest.approx(expected, abs=1e-6)
        ratio, sure = held_ratio(*args)
        if sure:
            assert ratio >= expected - 1e-6
        if np.isfinite(expected):
            assert held_within(*args, 1.001 * expected)
            assert not held_within(*args, 0.999 * expected)
            held += 1
        else:
            assert not held_within(*args, 1e6)
            slipping += 1
    assert held > 30
    assert slipping > 30


def standing_rover(athlete, count=6):
    """As it stands on even ground: one of each, for postures_held."""
    standing = np.zeros((1, 6), bool)
    standing[0, :count] = True
    return athlete.posture("stand")[None], np.eye(4)[None], standing, np.tile([0.0, 0.0, 1.0], (1, 6, 1))


def test_little_friction_and_much_load_are_each_enough_to_fall(athlete):
    """What is broken on purpose is seen: ice under a slope, a load beyond the motors, too few legs."""
    q, T, standing, up = standing_rover(athlete)
    tilt = rotation("y", -np.radians(10))
    sloped = (q, (transform(tilt, [0, 0, 0]))[None], standing, up @ tilt.T)
    assert postures_held(athlete, *sloped, BalanceSettings()).all()
    ice = BalanceSettings(friction=0.05)
    assert not postures_held(athlete, *sloped, ice).any()
    args = (*placed(athlete, q[0], sloped[1][0], standing[0], sloped[3][0]), held_tables(athlete, ice))
    assert held_ratio(*args) == (np.inf, True)
    assert least_held_ratio(*args) == np.inf

    three = np.array([[True, False] * 3])
    q = q.copy()
    q[0, 1::6] = 0.2
    bare = BalanceSettings(payload_mass=0.0)
    full = BalanceSettings(payload_mass=300.0, payload_position=np.array([1.2, 0.0, 0.3]))
    assert postures_held(athlete, q, T, three, up, bare, 0.9).all()
    args = (*placed(athlete, q[0], T[0], three[0], up[0]), held_tables(athlete, full))
    assert least_held_ratio(*args) > 1.0
    assert not postures_held(athlete, q, T, three, up, full, 1.0).any()
    assert held_ratio(*args)[0] >= least_held_ratio(*args)

    assert not postures_held(athlete, *standing_rover(athlete, 2), BalanceSettings()).any()
    assert not postures_held(athlete, *standing_rover(athlete, 0), BalanceSettings()).any()
    # three feet on one side don't carry the other
    assert not postures_held(athlete, *standing_rover(athlete, 3), BalanceSettings()).any()


def test_a_hanging_leg_may_be_what_is_too_much(athlete):
    """Stretched out level, a leg in the air hangs on its hip; the largest share of all is then that joint's."""
    q, T, standing, up = standing_rover(athlete, 5)
    q = q.copy()
    q[0, 31:33] = 0.0
    exact = torque_check(athlete, q[0], T[0], range(5), up[0, :5], BalanceSettings())
    args = (*placed(athlete, q[0], T[0], standing[0], up[0]), held_tables(athlete, BalanceSettings()))
    alone = held_tables(athlete, BalanceSettings())
    alone.limits[5, 1] *= 1e-2
    assert held_within(*args, exact.ratio + ROUNDING)
    assert not held_within(*args[:-1], alone, exact.ratio + ROUNDING)
    assert least_held_ratio(*args[:-1], alone) > 10 * exact.ratio


def test_ground_beyond_upright_carries_nothing(athlete):
    """One foot on an overhang or a plumb wall is not counted on, not even where the other five would do."""
    q, T, standing, normals = standing_rover(athlete)
    assert postures_held(athlete, q, T, standing, normals, BalanceSettings()).all()
    for wrong in ([0, 0, -1.0], [1.0, 0, -0.2], [0.0, 0, 0], [np.nan, 0, 1], [0, 0, np.inf]):
        bad = normals.copy()
        bad[0, 4] = wrong
        assert not postures_held(athlete, q, T, standing, bad, BalanceSettings()).any()
        # what a hanging leg's row says is not read
        hanging = standing.copy()
        hanging[0, 4] = False
        assert postures_held(athlete, q, T, hanging, bad, BalanceSettings()).all()


def test_which_ground_points_up_is_for_gravity_to_say(athlete):
    """In a site that is tilted by the settings, not the site's z: of two walls one carries a little, one nothing."""
    q, T, standing, normals = standing_rover(athlete)
    tilted = BalanceSettings(slope=0.2)
    for wall, carries in (([1.0, 0.0, -0.1], True), ([-1.0, 0.0, 0.1], False)):
        normals[0, 4] = wall
        assert (tilted.level(np.array(wall))[2] > 0) == carries
        assert postures_held(athlete, q, T, standing, normals, tilted).all() == carries
    with pytest.raises(InvalidInput):
        torque_check(athlete, q[0], T[0], range(6), normals[0], tilted)


def test_numbers_that_are_not_finite_are_not_held(athlete):
    q, T, standing, normals = standing_rover(athlete)
    tables = held_tables(athlete, BalanceSettings())
    poses, _, contacts, up, stands = placed(athlete, q[0], T[0], standing[0], normals[0])
    for broken in (poses, T[0], contacts):
        for wrong in (np.nan, np.inf):
            at = np.unravel_index(7, broken.shape)
            kept = broken[at]
            assert held_within(poses, T[0], contacts, up, stands, tables, 1.0)
            broken[at] = wrong
            assert not held_within(poses, T[0], contacts, up, stands, tables, 1.0)
            assert held_ratio(poses, T[0], contacts, up, stands, tables) == (np.inf, True)
            assert least_held_ratio(poses, T[0], contacts, up, stands, tables) == np.inf
            broken[at] = kept
    assert not held_within(poses, T[0], contacts, up, stands, tables, np.nan)


def test_wrong_shapes_are_refused(athlete):
    q, T, standing, up = standing_rover(athlete)
    few, flat = q[:, :35], up[:, :, :2]
    for bad in ((few, T, standing, up), (q, T[0], standing, up), (q, T, standing[:, :5], up), (q, T, standing, flat)):
        with pytest.raises(InvalidInput):
            postures_held(athlete, *bad, BalanceSettings())
