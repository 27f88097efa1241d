"""A tether in the balance: the compiled checks, the exact one, and a floating model solved by HiGHS agree."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.cones import generators
from footfall.balance.held import held_tables, postures_held
from footfall.balance.held_kernel import held_within
from footfall.balance.tether import Tether
from footfall.balance.torques import torque_check
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, rotation_rpy, transform
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass
from tests.balance.test_held import held_by_some_forces, held_ratio, least_held_ratio, placed

ROUNDING = 1e-7
SETTINGS = BalanceSettings()


def hanging(robot, rng, count, steepest=80.0):
    """Postures, poses, standing legs, normals and tethers on slopes up to ``steepest`` [deg], the anchor uphill."""
    qs = robot.posture("stand") + rng.uniform(0.0, 0.2, (count, 1)) * rng.normal(size=(count, 36))
    Ts, normals, standing = np.empty((count, 4, 4)), np.empty((count, 6, 3)), np.zeros((count, 6), bool)
    tethers = []
    for i in range(count):
        R = rotation("z", rng.uniform(-3, 3)) @ rotation("y", np.radians(rng.uniform(0, steepest)))
        tilt = 0.08 * rng.normal(), 0.08 * rng.normal()
        Ts[i] = transform(R @ rotation_rpy(*tilt, rng.uniform(-3, 3)), rng.normal(size=3))
        around = np.column_stack([rng.uniform(0, 0.4) * rng.normal(size=(6, 2)), np.ones(6)])
        normals[i] = around @ R.T
        standing[i, rng.permutation(6)[: rng.integers(3, 7)]] = True
        # y-rotation by a positive angle makes x point downhill
        anchor = Ts[i, :3, 3] + R @ np.array([-rng.uniform(3, 9), rng.uniform(-2, 2), rng.uniform(-0.5, 1.5)])
        attachment = np.array([*rng.uniform(-1, 1, 2), rng.uniform(-0.3, 0.3)])
        tethers.append(Tether(anchor, attachment, float(rng.uniform(2000, 15000))))
    return qs, Ts, standing, normals, tethers


def floating(robot, posture, T_site_base, legs, normals, settings, tether, pull=None):
    """The least ratio, drum included, of a free-flyer model on a tether by HiGHS; inf where infeasible.

    Everything is pin's: gravity, Jacobians, and the tether as a force on a frame of the chassis. pull: its force [N] if
    that is given; then the drum's share does not count.
    """
    model = pin.buildModelFromXML(robot.description.urdf, pin.JointModelFreeFlyer())
    data, R = model.createData(), settings.R_level_site
    T = transform(R @ T_site_base[:3, :3], R @ T_site_base[:3, 3])
    q = np.concatenate([pin.SE3ToXYZQUAT(pin.SE3(T)), posture])
    model.gravity = pin.Motion(np.array([0.0, 0.0, -settings.gravity]), np.zeros(3))
    still = pin.computeGeneralizedGravity(model, data, q)
    pin.computeJointJacobians(model, data, q)

    def effect_at(joint, point, forces):
        J = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        moved = J[:3] + np.cross(J[3:].T, point - data.oMi[joint].translation).T
        return -moved.T @ forces * robot.mass * settings.gravity

    edges, effects = generators(settings.level(normals), settings.friction, settings.sides), []
    for leg, normal, own in zip(legs, normals, edges, strict=True):
        contact = R @ contact_point(robot, posture, leg, T_site_base, normal)
        effects.append(effect_at(model.getJointId(robot.joint_names[6 * leg + 5]), contact, own.T))
    if tether is not None:
        at = R @ apply(T_site_base, tether.attachment)
        toward = R @ tether.anchor - at
        effects.append(effect_at(1, at, (toward / np.linalg.norm(toward))[:, None]))
    effect = np.hstack(effects)
    weight = robot.mass * settings.gravity
    scale = np.concatenate([np.full(6, weight), robot.torque_limits])
    effect, still = effect / scale[:, None], still / scale
    above, below = np.hstack([effect[6:], -np.ones((36, 1))]), np.hstack([-effect[6:], -np.ones((36, 1))])
    bounds = [(0, None)] * effect.shape[1] + [(None, None)]
    ratios, levels = [above, below], [-still[6:], still[6:]]
    if tether is not None and pull is None:
        drum = np.zeros(effect.shape[1] + 1)
        drum[-2], drum[-1] = weight / tether.most_force, -1.0
        ratios, levels = [*ratios, drum[None]], [*levels, np.zeros(1)]
    if pull is not None:
        bounds[-2] = (pull / weight, pull / weight)
    solved = linprog(
        np.append(np.zeros(effect.shape[1]), 1.0),
        A_ub=np.vstack(ratios),
        b_ub=np.concatenate(levels),
        A_eq=np.hstack([effect[:6], np.zeros((6, 1))]),
        b_eq=-still[:6],
        bounds=bounds,
        method="highs",
    )
    assert solved.status in (0, 2)
    return solved.fun if solved.status == 0 else np.inf


def test_the_exact_check_is_that_of_a_floating_model(athlete, rng):
    held = slipping = drum = 0
    for q, T, standing, normals, tether in zip(*hanging(athlete, rng, 120), strict=True):
        legs = np.flatnonzero(standing).tolist()
        settings = BalanceSettings(friction=rng.uniform(0.3, 1.0), sides=int(rng.choice([4, 8, 16])))
        found = torque_check(athlete, q, T, legs, normals[legs], settings, tether)
        wanted = floating(athlete, q, T, legs, normals[legs], settings, tether)
        assert found.ratio == pytest.approx(wanted, rel=1e-6, abs=1e-6)
        if not found.feasible:
            slipping += 1
            continue
        held += found.ratio <= 1
        drum += found.pull >= (found.ratio - 1e-6) * tether.most_force
        assert 0.0 <= found.pull <= found.ratio * tether.most_force * (1 + 1e-6)
        # with that very pull the joints bear what is told
        fixed = floating(athlete, q, T, legs, normals[legs], settings, tether, found.pull)
        assert fixed <= found.ratio + 1e-6
    assert held > 20
    assert slipping > 5
    assert drum > 3


def test_forces_and_pull_balance_the_weight(athlete, rng):
    """Newton and Euler, by hand."""
    seen = 0
    for q, T, standing, normals, tether in zip(*hanging(athlete, rng, 30), strict=True):
        legs = np.flatnonzero(standing).tolist()
        found = torque_check(athlete, q, T, legs, normals[legs], SETTINGS, tether)
        if not found.feasible:
            continue
        seen += 1
        at = apply(T, tether.attachment)
        pull = found.pull * (tether.anchor - at) / np.linalg.norm(tether.anchor - at)
        com = apply(T, center_of_mass(athlete, q))
        contacts = [contact_point(athlete, q, leg, T, normals[leg]) for leg in legs]
        total = found.forces.sum(axis=0) + pull - [0.0, 0.0, athlete.mass * SETTINGS.gravity]
        moment = np.cross(at - com, pull) + sum(
            np.cross(c - com, found.forces[leg]) for leg, c in zip(legs, contacts, strict=True)
        )
        assert np.abs(total).max() < 1e-3
        assert np.abs(moment).max() < 1e-3
    assert seen > 10


def test_the_compiled_checks_agree_with_the_exact_one(athlete, rng):
    held = refused = 0
    for trial in range(150):
        q, T, standing, normals, tether = (one[0] for one in hanging(athlete, rng, 1))
        slope = rng.choice([0.0, rng.uniform(0, 0.8)])
        settings = BalanceSettings(friction=rng.uniform(0.3, 1.0), slope=slope, uphill=rng.uniform(-3, 3))
        legs, most = np.flatnonzero(standing).tolist(), rng.uniform(0.3, 1.0)
        exact = torque_check(athlete, q, T, legs, normals[legs], settings, tether).ratio
        unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        args = (*placed(athlete, q, T, standing, unit), held_tables(athlete, settings, tether))
        assert least_held_ratio(*args) == pytest.approx(exact, rel=1e-6, abs=ROUNDING), trial
        ratio, sure = held_ratio(*args)
        if sure:
            assert ratio >= exact - ROUNDING
        answer = held_within(*args, most)
        assert postures_held(athlete, q[None], T[None], standing[None], normals[None], settings, most, tether) == answer
        assert exact <= most + ROUNDING if answer else not exact <= 0.98 * most
        held, refused = held + answer, refused + (not answer)
    assert held > 20
    assert refused > 20


def slack(com, contacts, unit, settings, tether, T_site_base, weight):
    """The least pull [N] with which any forces inside friction balance a weight [N], by HiGHS; inf where none do."""
    feet = generators(unit, settings.friction, settings.sides)
    rays = np.concatenate([feet.reshape(-1, 3), np.zeros((1, 3))])
    at, rays[-1] = tether.pull(T_site_base)
    places = np.concatenate([np.repeat(contacts, feet.shape[1], axis=0), at[None]])
    wrench = np.vstack([rays.T, np.cross(places - com, rays).T])
    up = np.concatenate([settings.R_level_site[2], np.zeros(3)])
    found = linprog(np.append(np.zeros(len(rays) - 1), 1.0), A_eq=wrench, b_eq=up, bounds=(0.0, None), method="highs")
    assert found.status in (0, 2)
    return weight * found.x[-1] if found.status == 0 else np.inf


def test_a_drum_that_is_too_weak_is_not_counted_on_whatever_motors_bear(athlete, rng):
    """Where no motor is asked, some forces hold exactly where the least pull that would do is the drum's."""
    seen = set()
    for q, T, standing, normals, tether in zip(*hanging(athlete, rng, 60, 75.0), strict=True):
        unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        args = placed(athlete, q, T, standing, unit)
        com, weight = apply(T, center_of_mass(athlete, q)), athlete.mass * SETTINGS.gravity
        least = slack(com, args[2][standing], unit[standing], SETTINGS, tether, T, weight)
        for share in (0.5, 0.98, 1.02, 2.0):
            most = share * least if 1.0 < least < np.inf else tether.most_force
            drum = Tether(tether.anchor, tether.attachment, most)
            holds = held_by_some_forces(*args, held_tables(athlete, SETTINGS, drum))
            assert holds == (least <= most), (least, most)
            seen.add((holds, 1.0 < least < np.inf))
    assert seen >= {(True, True), (False, True), (False, False)}


def test_a_tether_only_helps_and_never_pushes(athlete, rng):
    """Less drum is never better, none is as without a tether, and an anchor downhill holds nothing on a steep slope."""
    for q, T, standing, normals, tether in zip(*hanging(athlete, rng, 40, 40.0), strict=True):
        legs = np.flatnonzero(standing).tolist()
        without = torque_check(athlete, q, T, legs, normals[legs], SETTINGS).ratio
        strong = Tether(tether.anchor, tether.attachment, 2 * tether.most_force)
        ratios = [torque_check(athlete, q, T, legs, normals[legs], SETTINGS, one).ratio for one in (strong, tether)]
        assert ratios[0] <= ratios[1] + ROUNDING
        assert ratios[1] <= without + ROUNDING
    slope = transform(rotation("y", np.radians(60.0)))
    up, down = slope[:3, 0] * -5.0, slope[:3, 0] * 5.0
    q, normals = athlete.posture("stand"), np.tile(slope[:3, 2], (6, 1))
    attachment = np.array([0.0, 0.0, -0.3])
    tethers = [Tether(at + slope[:3, :3] @ attachment, attachment) for at in (up, down)]
    ratios = [torque_check(athlete, q, slope, range(6), normals, SETTINGS, one).ratio for one in tethers]
    assert ratios[0] < 1.0
    assert ratios[1] == np.inf


def test_normals_that_point_down_are_for_the_program_with_a_tether_alone(athlete):
    slope = transform(rotation("y", np.radians(95.0)))
    q, normals = athlete.posture("stand"), np.tile(slope[:3, 2], (6, 1))
    tether = Tether(np.array([0.0, 0.0, 6.0]), np.array([-1.2, 0.0, 0.0]))
    with pytest.raises(InvalidInput, match="must point up"):
        torque_check(athlete, q, slope, range(6), normals, SETTINGS)
    found = torque_check(athlete, q, slope, range(6), normals, SETTINGS, tether)
    assert found.ratio == pytest.approx(floating(athlete, q, slope, range(6), normals, SETTINGS, tether), abs=1e-6)


def test_lengths_and_pull_of_a_tether():
    tether = Tether(np.array([0.0, 0.0, 5.0]), np.array([1.0, 0.0, 0.0]))
    T = transform(rotation("z", np.pi / 2), (0.0, -1.0, 1.0))
    assert tether.lengths(T[None])[0] == pytest.approx(4.0)
    at, toward = tether.pull(T)
    assert np.allclose(at, [0.0, 0.0, 1.0])
    assert np.allclose(toward, [0.0, 0.0, 1.0])
    with pytest.raises(InvalidInput, match="no direction"):
        Tether(at, tether.attachment).pull(T)
    with pytest.raises(InvalidInput, match="above zero"):
        Tether(at, at, most_force=0.0)
    with pytest.raises(InvalidInput, match="three finite"):
        Tether(np.zeros(2), at)
