"""The compiled inverse kinematics against the same equations in arrays, pin, and finite differences."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core.frames import apply, inverse, rotation, transform
from footfall.robot import ik, ik_kernel
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import leg_link_poses, leg_wheel_pose
from footfall.robot.leg_frames import PART_COUNT, leg_frames, leg_lengths, manipulability, wheel_axles
from tests.support.kept_arrays import read_only

LEG = 4


@pytest.fixture(scope="module")
def spec(athlete):
    return athlete.description.legs[LEG]


@pytest.fixture(scope="module")
def limits(athlete):
    return athlete.lower[6 * LEG : 6 * LEG + 6], athlete.upper[6 * LEG : 6 * LEG + 6]


def solved_by_arrays(spec, lower, upper, Ts_base_wheel):
    """All branches in whole-array steps: q (n, 8, 6) and valid (n, 8)."""
    Ts = inverse(spec.T_base_hip) @ Ts_base_wheel
    R, ankle = Ts[:, :3, :3], Ts[:, :3, 3] - spec.foot * Ts[:, :3, 0]
    q = np.empty((len(Ts), 2, 2, 2, 6))
    for shoulder in (0, 1):
        q0 = np.arctan2(ankle[:, 1], ankle[:, 0]) + math.pi * shoulder
        out = np.hypot(ankle[:, 0], ankle[:, 1]) * (1 - 2 * shoulder) - spec.hip_offset[0]
        down = spec.hip_offset[2] - ankle[:, 2]
        cosine = (out**2 + down**2 - spec.thigh**2 - spec.shank**2) / (2 * spec.thigh * spec.shank)
        with np.errstate(invalid="ignore"):
            bend = np.arccos(np.where(np.abs(cosine) < 1 + 1e-12, np.clip(cosine, -1, 1), np.nan))
        for elbow, q2 in enumerate((bend, -bend)):
            q1 = np.arctan2(down, out) - np.arctan2(spec.shank * np.sin(q2), spec.thigh + spec.shank * np.cos(q2))
            left = np.swapaxes(rotation("z", q0) @ rotation("y", q1 + q2), -1, -2) @ R
            sine = np.hypot(left[:, 1, 0], left[:, 2, 0])
            b = np.arctan2(sine, left[:, 0, 0])
            a = np.where(sine > 1e-12, np.arctan2(left[:, 1, 0], -left[:, 2, 0]), 0.0)
            rest = np.swapaxes(rotation("x", a) @ rotation("y", b), -1, -2) @ left
            c = np.arctan2(rest[:, 2, 1], rest[:, 1, 1])
            q[:, shoulder, elbow, 0] = np.stack([q0, q1, q2, a, b, c], axis=-1)
            q[:, shoulder, elbow, 1] = np.stack([q0, q1, q2, a + math.pi, -b, c + math.pi], axis=-1)
    q = q.reshape(len(Ts), 8, 6)
    q[np.isnan(q).any(axis=-1)] = np.nan
    q -= 2 * math.pi * np.ceil((q - math.pi) / (2 * math.pi))
    for turn in (2 * math.pi, -2 * math.pi):
        outside = (q < lower - 1e-9) | (q > upper + 1e-9)
        fits = (q + turn >= lower - 1e-9) & (q + turn <= upper + 1e-9)
        q = np.where(outside & fits, q + turn, q)
    inside = (q >= lower - 1e-9) & (q <= upper + 1e-9)
    return np.where(inside, np.clip(q, lower, upper), q), inside.all(axis=-1)


def test_the_kernel_is_the_array_solution(athlete, spec, limits, rng):
    n = 20_000
    Ts = np.tile(np.eye(4), (n, 1, 1))
    Ts[:, :3, :3] = Rotation.random(n, rng=np.random.default_rng(3)).as_matrix()
    Ts[:, :3, 3] = spec.T_base_hip[:3, 3] + rng.uniform(-2.2, 2.2, (n, 3))
    # and poses that surely have solutions, straight wrists and stretched knees among them
    for i, q in enumerate(rng.uniform(*limits, (n // 4, 6))):
        q[4] *= i % 4 > 0
        q[2] *= i % 5 > 0
        Ts[i] = leg_wheel_pose(athlete, q, LEG)
    q, valid = solved_by_arrays(spec, limits[0], limits[1], Ts)
    found = ik.solve_leg(athlete, LEG, Ts)
    assert (np.isnan(found.q) == np.isnan(q)).all()
    # where a joint is at ±π or at a limit to the last bit, rounding decides
    edge = np.abs(np.stack([q - end for end in (*limits, math.pi, -math.pi)])).min(axis=0).min(axis=-1) < 1e-7
    assert (found.valid == valid)[~edge].all()
    straight = np.abs(np.sin(q[..., 4])) < 1e-6
    assert np.nanmax(np.abs(found.q - q)[~edge & ~straight]) < 1e-8
    assert valid.sum() > n // 4


def solve_upright(athlete, contacts, normals, T_site_base, lower, upper, present):
    n = len(contacts)
    spec = athlete.description.legs[LEG]
    out = np.empty((n, 8, 6)), np.empty((n, 8)), np.empty(n, np.uint8), np.empty(n), np.empty(n)
    T_hip_site = inverse(T_site_base @ spec.T_base_hip)
    ik_kernel.solve_upright(
        leg_lengths(spec),
        athlete.wheel_radius,
        T_hip_site,
        contacts,
        normals,
        read_only(lower),
        read_only(upper),
        np.asarray(present, float),
        ik_kernel.UprightLegs(*out),
    )
    return out


@pytest.fixture(scope="module")
def places(athlete, spec):
    """Contacts about the leg on tilted ground, under a tilted rover."""
    rng = np.random.default_rng(5)
    T_site_base = transform(Rotation.from_euler("xyz", [0.1, -0.07, 0.4]).as_matrix(), (3.0, -1.0, 1.2))
    contacts = apply(T_site_base, spec.T_base_hip[:3, 3]) + rng.uniform((-2, -2, -1.6), (2, 2, -0.3), (800, 3))
    normals = rng.normal(size=(800, 3)) * (0.25, 0.25, 0) + (0, 0, 1)
    return T_site_base, contacts, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_free_heading_is_the_union_of_all_headings(athlete, limits, places):
    """Narrow limits of the last joint too: it can be turned to the middle of whatever it has."""
    T_site_base, contacts, normals = places
    for lower, upper in (limits, (limits[0] * (1, 1, 1, 0.5, 0.3, 0.1), limits[1] * (1, 1, 1, 0.5, 0.3, 0.1))):
        q, margin, _, _, _ = solve_upright(athlete, contacts, normals, T_site_base, lower, upper, np.zeros(6))
        any_heading = np.zeros((len(contacts), 8), bool)
        for heading in np.deg2rad(np.arange(0, 360, 12)):
            Ts = ik.wheel_pose_for_contact(athlete, contacts, normals, np.full(len(contacts), heading), T_site_base)
            _, valid = solved_by_arrays(athlete.description.legs[LEG], lower, upper, Ts)
            any_heading |= valid
        assert (np.isfinite(margin) == any_heading).all()
        assert (np.isfinite(q).all(axis=2) == any_heading).all()
        assert any_heading.any(axis=1).sum() > 50


def test_every_solution_stands_on_its_contact_inside_the_limits(athlete, limits, places):
    T_site_base, contacts, normals = places
    present = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    q, margin, joint, excess, dexterity = solve_upright(
        athlete, contacts, normals, T_site_base, limits[0], limits[1], present
    )
    for i, branch in np.argwhere(np.isfinite(margin)):
        T = T_site_base @ leg_wheel_pose(athlete, q[i, branch], LEG)
        assert np.abs(T[:3, 3] + athlete.wheel_radius * T[:3, 0] - contacts[i]).max() < 1e-9
        assert np.abs(T[:3, 0] + normals[i]).max() < 1e-9
        assert q[i, branch, 5] == present[5]
    five = q[..., :5]
    room = np.minimum(five - limits[0][:5], limits[1][:5] - five).min(axis=2)
    has = np.isfinite(margin)
    assert (room[has] >= 0).all()
    np.testing.assert_allclose(margin[has], np.minimum(room, (limits[1][5] - limits[0][5]) / 2)[has], atol=1e-12)
    some = has.any(axis=1)
    assert (excess[some] == 0).all()
    assert (np.isfinite(dexterity) == some).all()
    assert (joint[some] == ik_kernel.NO_JOINT).all()


def test_the_joint_that_is_blamed_is_the_one_to_widen(athlete, limits, places):
    T_site_base, contacts, normals = places
    _, _, joint, excess, _ = solve_upright(athlete, contacts, normals, T_site_base, limits[0], limits[1], np.zeros(6))
    blamed = np.flatnonzero(excess > 1e-6)
    assert len(blamed) > 20
    for i in blamed:
        one = contacts[i : i + 1], normals[i : i + 1]
        # with every limit wider by just that much there is a solution, by a little less there is none
        assert np.isfinite(
            solve_upright(
                athlete,
                one[0],
                one[1],
                T_site_base,
                limits[0] - excess[i] - 1e-8,
                limits[1] + excess[i] + 1e-8,
                np.zeros(6),
            )[1]
        ).any()
        less = excess[i] - 1e-8
        narrow = solve_upright(athlete, one[0], one[1], T_site_base, limits[0] - less, limits[1] + less, np.zeros(6))
        assert not np.isfinite(narrow[1]).any()
        assert narrow[2][0] == joint[i]


def test_a_straight_wrist_leaves_the_knee_roll_free(athlete, spec, limits):
    q = np.array([0.0, 0.25, math.pi / 2 - 0.25, 0.0, 0.0, 0.0])
    T = leg_wheel_pose(athlete, q, LEG)
    contact = T[:3, 3] + athlete.wheel_radius * T[:3, 0]
    normal = -T[:3, 0]
    for present in (-1.3, 0.9, 5.0):
        angles = np.full(6, present)
        found, margin, _, _, _ = solve_upright(
            athlete, contact[None], normal[None], np.eye(4), limits[0], limits[1], angles
        )
        there = np.flatnonzero(np.isfinite(margin[0]))
        straight = [b for b in there if abs(found[0, b, 4]) < 1e-9]
        # one solution, not the two that a bent wrist has
        assert len(straight) == 1
        roll = found[0, straight[0], 3]
        assert roll == np.clip(present, limits[0][3], limits[1][3])
        for b in there:
            back = leg_wheel_pose(athlete, found[0, b], LEG)
            np.testing.assert_allclose(back[:3, 3] + athlete.wheel_radius * back[:3, 0], contact, atol=1e-9)
            np.testing.assert_allclose(back[:3, 0], -normal, atol=1e-9)


def test_nothing_comes_of_nan(athlete, limits):
    bad = np.full((2, 3), np.nan)
    q, margin, joint, excess, dexterity = solve_upright(athlete, bad, bad, np.eye(4), limits[0], limits[1], np.zeros(6))
    assert np.isnan(q).all()
    assert np.isneginf(margin).all()
    assert (joint == ik_kernel.NO_JOINT).all()
    assert np.isnan(excess).all()
    assert np.isnan(dexterity).all()


def test_frames_are_those_of_pin(athlete, spec, limits, rng):
    rotations, origins = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    for q in rng.uniform(*limits, (50, 6)):
        leg_frames(leg_lengths(spec), q, rotations, origins)
        for k, part in enumerate(PARTS):
            T = inverse(spec.T_base_hip) @ leg_link_poses(athlete, q, LEG)[link_name(LEG, part)]
            np.testing.assert_allclose(rotations[k], T[:3, :3], atol=1e-12)
            np.testing.assert_allclose(origins[k], T[:3, 3], atol=1e-12)
        np.testing.assert_allclose(wheel_axles(leg_lengths(spec), q[None])[0], T[:3, 1], atol=1e-12)


def test_manipulability_is_that_of_differences(athlete, spec, limits, rng):
    rotations, origins = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))

    def contact(q):
        T = leg_wheel_pose(athlete, q, LEG)
        return T[:3, 3] + athlete.wheel_radius * T[:3, 0]

    for q in rng.uniform(*limits, (50, 6)):
        J = np.column_stack([(contact(q + d) - contact(q - d)) / 2e-6 for d in 1e-6 * np.eye(6)])
        leg_frames(leg_lengths(spec), q, rotations, origins)
        expected = math.sqrt(max(np.linalg.det(J @ J.T), 0.0))
        assert manipulability(rotations, origins, athlete.wheel_radius) == pytest.approx(expected, abs=1e-6)


def test_raised_postures_carry_the_same_wheel_higher(athlete, spec, limits, rng):
    qs = rng.uniform(*limits, (2000, 6))
    branch = np.array([_branch(athlete, q, leg_wheel_pose(athlete, q, LEG)) for q in qs])
    up = np.array([0.02, -0.03, 0.2])
    above = np.empty_like(qs)
    ik_kernel.solve_raised(leg_lengths(spec), up, branch, limits[0], limits[1], qs, above)
    there = np.isfinite(above[:, 0])
    assert 0.3 < there.mean() < 0.99
    for q, high, b in zip(qs, above, branch, strict=True):
        T = leg_wheel_pose(athlete, q, LEG)
        T[:3, 3] += spec.T_base_hip[:3, :3] @ up
        if np.isnan(high[0]):
            # no wrist of that shoulder and elbow is inside the limits
            assert not ik.solve_leg(athlete, LEG, T[None]).valid[0][2 * (b // 2) : 2 * (b // 2) + 2].any()
            continue
        np.testing.assert_allclose(leg_wheel_pose(athlete, high, LEG), T, atol=1e-9)
        assert (high >= limits[0]).all()
        assert (high <= limits[1]).all()
        assert _branch(athlete, high, T) // 2 == b // 2


def _branch(athlete, q, T_base_wheel):
    found = ik.solve_leg(athlete, LEG, T_base_wheel[None]).q[0]
    return int(np.nanargmin(np.abs(found - q).max(axis=1)))


def test_a_headed_wheel_is_one_of_solve_leg(athlete, spec, limits, places):
    T_site_base, contacts, normals = places
    q, margin, _, _, _ = solve_upright(athlete, contacts, normals, T_site_base, limits[0], limits[1], np.zeros(6))
    cell, branch = np.nonzero(np.isfinite(margin))
    R_hip_site = inverse(T_site_base @ spec.T_base_hip)[:3, :3]
    turned_back = 0
    for azimuth in (0.3, 2.9, -2.0):
        for half_turn in (False, True):
            turned = q[cell, branch]
            done = ik_kernel.head_wheels(R_hip_site, normals[cell], azimuth, half_turn, limits[0], limits[1], turned)
            np.testing.assert_array_equal(turned[~done], q[cell, branch][~done])
            np.testing.assert_array_equal(turned[:, :5], q[cell, branch][:, :5])
            for i, b, one, yes in zip(cell, branch, turned, done, strict=True):
                headings = np.array([azimuth, azimuth + np.pi])
                Ts = ik.wheel_pose_for_contact(athlete, contacts[i], normals[i], headings, T_site_base)
                found = ik.solve_leg(athlete, LEG, Ts)
                if found.valid[0, b]:
                    np.testing.assert_allclose(one, found.q[0, b], atol=1e-6)
                assert yes == (found.valid[0, b] or (half_turn and found.valid[1, b]))
                if yes and not found.valid[0, b]:
                    turned_back += 1
                    np.testing.assert_allclose(one, found.q[1, b], atol=1e-6)
    assert turned_back
