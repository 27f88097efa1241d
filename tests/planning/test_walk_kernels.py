"""The compiled part of the walk planner, each against pin, the inverse kinematics or a plain loop."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import footfall
from footfall.balance.support import margins
from footfall.core.frames import inverse
from footfall.planning.between_rows import base_path
from footfall.planning.body.follow import DRIFT
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.lift import branch_of
from footfall.planning.scene.rover_kernel import leg_too_near_itself
from footfall.planning.walk.body_kernel import waypoints_of
from footfall.planning.walk.body_way import BODY_STEP, FARTHEST, At, BodyWay, Fails, body_way, feet_of
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.guide import guide
from footfall.planning.walk.legs_kernel import (
    KNEE_ROLL,
    UNREACHED,
    WRIST,
    between,
    leg_at,
    legs_at,
    pose_of,
    turn_between,
)
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.reach import LEAST, reaches
from footfall.planning.walk.spans_kernel import Reaching, Spans, poses_of, spans
from footfall.planning.walk.start import start_of
from footfall.planning.walk.transition_kernel import IGNORED, PREFERRED, REQUIRED, margin_without, vector_of
from footfall.planning.walk.world import World
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import leg_wheel_pose
from tests.support.chassis_ground import wavy
from tests.support.kept_arrays import read_only

LEGS = 6
SETTINGS = WalkSettings(least_margin=0.02)
LEG = st.integers(0, LEGS - 1)
SEED = st.integers(0, 2**32 - 1)


def stood(robot, dem):
    """A rover that stands on all its feet."""
    at = start_of(robot, dem, footfall.stand(robot, dem))
    assert isinstance(at, At), at
    return at


def world_of(robot, dem, at):
    """What a search asks where all the ground is known."""
    return World(robot, Nearby(dem, np.isnan(dem.heights)), SETTINGS, at.T_site_base)


@pytest.fixture(scope="module")
def ground():
    return wavy()


@pytest.fixture(scope="module")
def at(athlete, ground):
    return stood(athlete, ground)


@pytest.fixture(scope="module")
def world(athlete, ground, at):
    return world_of(athlete, ground, at)


def any_pose(rng, far=0.5, turned=0.5):
    """A chassis pose, (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("ZYX", rng.uniform(-turned, turned, 3)).as_matrix()
    T[:3, 3] = rng.uniform(-far, far, 3)
    return T


def rows(T):
    """A pose as kernels take it."""
    return np.ascontiguousarray(T[..., :3, :])


def any_angles(robot, leg, rng):
    own = slice(6 * leg, 6 * leg + 6)
    return rng.uniform(robot.lower[own], robot.upper[own])


def held(world, T, T_site_wheel, branch, leg):
    """What leg_at writes and returns."""
    q = np.full(6, 9.0)
    return q, leg_at(rows(T), rows(T_site_wheel), branch, leg, world.legs, q)


def parts_of_spare(robot, q, leg):
    """What a posture of a leg has to spare of straight, folded, limits, wrist and knee roll, from its angles alone."""
    spec = robot.description.legs[leg]
    far = abs(spec.thigh + spec.shank * np.exp(1j * q[2]))
    own = slice(6 * leg, 6 * leg + 6)
    return {
        "straight": spec.thigh + spec.shank - far - SETTINGS.reach_reserve,
        "folded": far - abs(spec.thigh - spec.shank) - SETTINGS.reach_reserve,
        "limits": min((q - robot.lower[own]).min(), (robot.upper[own] - q).min()) - SETTINGS.joint_reserve,
        "wrist": abs(math.sin(q[4])) - WRIST,
        "knee roll": KNEE_ROLL - abs(q[3]),
    }


@given(LEG, SEED)
def test_the_joints_of_a_standing_leg_hold_its_wheel_where_it_stands(athlete, world, leg, seed):
    rng = np.random.default_rng(seed)
    wanted, T = any_angles(athlete, leg, rng), any_pose(rng)
    # a straight or folded leg and a straight wrist have no branch of their own
    assume(abs(math.sin(wanted[4])) > 0.01 and abs(math.sin(wanted[2])) > 0.01)
    T_site_wheel = T @ leg_wheel_pose(athlete, wanted, leg)
    q, spare = held(world, T, T_site_wheel, branch_of(athlete, leg, wanted), leg)
    np.testing.assert_allclose(np.exp(1j * q), np.exp(1j * wanted), atol=1e-8)
    np.testing.assert_allclose(T @ leg_wheel_pose(athlete, q, leg), T_site_wheel, atol=1e-9)
    assert spare == pytest.approx(min(parts_of_spare(athlete, q, leg).values()), abs=1e-7)


@given(LEG, st.integers(0, 7), SEED)
def test_a_standing_leg_is_where_the_inverse_kinematics_has_its_branch(athlete, world, leg, branch, seed):
    rng = np.random.default_rng(seed)
    T, T_site_wheel = any_pose(rng), any_pose(rng, 2.5, 3.0)
    T_site_wheel[:3, 3] += T[:3, :3] @ athlete.description.legs[leg].T_base_hip[:3, 3]
    found = solve_leg(athlete, leg, (inverse(T) @ T_site_wheel)[None])
    q, spare = held(world, T, T_site_wheel, branch, leg)
    assert (spare >= -UNREACHED) == bool(found.valid[0, branch])
    if found.valid[0, branch]:
        np.testing.assert_allclose(q, found.q[0, branch], atol=1e-9)
    else:
        assert np.isnan(q).all()


@pytest.mark.parametrize("part", ["straight", "folded", "limits", "wrist", "knee roll"])
def test_each_part_of_what_a_leg_has_to_spare_decides_its_sign(athlete, world, part):
    """Of postures of which that part alone is short, the spare is negative; where none is, it is not."""
    rng = np.random.default_rng(5)
    short = fine = 0
    while short < 20 or fine < 5:
        q = athlete.posture("stand")[:6] + rng.normal(0.0, [0.8, 0.8, 1.2, 0.8, 0.8, 1.5])
        if not ((q > athlete.lower[:6]) & (q < athlete.upper[:6])).all():
            continue
        parts = parts_of_spare(athlete, q, 0)
        lacking = {name for name, spare in parts.items() if spare < 0.0}
        T = any_pose(rng)
        found, spare = held(world, T, T @ leg_wheel_pose(athlete, q, 0), branch_of(athlete, 0, q), 0)
        assert (spare < 0.0) == bool(lacking), (found, parts)
        assert np.isfinite(found).all()
        short, fine = short + (lacking == {part}), fine + (not lacking)


def test_a_wheel_out_of_reach_or_outside_limits_has_no_joints(athlete, world):
    q = np.array(athlete.posture("stand")[:6])
    T_wheel = leg_wheel_pose(athlete, q, 0)
    far = T_wheel.copy()
    far[0, 3] += 3.0
    found, spare = held(world, np.eye(4), far, 0, 0)
    assert np.isnan(found).all()
    assert spare < -UNREACHED - 1.0
    beyond = q.copy()
    beyond[0] = athlete.upper[0] + 0.1
    found, spare = held(world, np.eye(4), leg_wheel_pose(athlete, beyond, 0), branch_of(athlete, 0, q), 0)
    assert np.isnan(found).all()
    assert spare == pytest.approx(-UNREACHED - 0.1, abs=1e-9)


def test_all_legs_at_once_are_each_leg_by_itself(athlete, world, at):
    rng = np.random.default_rng(11)
    feet = feet_of(at.stance)
    for _ in range(20):
        T = at.T_site_base @ any_pose(rng, 0.3, 0.1)
        q, spares = np.empty(36), np.empty(LEGS)
        least = legs_at(rows(T), feet, world.legs, q, spares)
        alone = [held(world, T, at.stance.Ts_site_wheel[leg], 0, leg) for leg in range(LEGS)]
        np.testing.assert_array_equal(q, np.concatenate([one[0] for one in alone]))
        np.testing.assert_array_equal(spares, [one[1] for one in alone])
        assert least == spares.min()


@given(SEED)
def test_a_chassis_pose_is_its_six_numbers_and_back(seed):
    rng = np.random.default_rng(seed)
    vector = rng.uniform([-9, -9, -9, -3, -1.5, -3], [9, 9, 9, 3, 1.5, 3])
    T = np.empty((3, 4))
    pose_of(vector, T)
    np.testing.assert_allclose(vector_of(T), vector, atol=1e-9)
    np.testing.assert_allclose(T[:, :3], Rotation.from_euler("ZYX", vector[5:2:-1]).as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(T[:, 3], vector[:3])


@given(SEED, st.floats(0.0, 1.0), st.sampled_from([1e-9, 0.01, 1.0]))
def test_between_two_chassis_poses_is_the_way_of_a_chassis_move(seed, share, turned):
    rng = np.random.default_rng(seed)
    T_from, T_to = any_pose(rng, turned=3.0), np.eye(4)
    T_to[:3, :3] = T_from[:3, :3] @ Rotation.from_rotvec(turned * rng.normal(size=3)).as_matrix()
    T_to[:3, 3] = rng.uniform(-1, 1, 3)
    out, turn = np.empty((3, 4)), turn_between(rows(T_from), rows(T_to))
    assume(np.linalg.norm(turn) < 3.1)
    between(rows(T_from), rows(T_to), turn, share, out)
    np.testing.assert_allclose(out, base_path(T_from, T_to, np.array([share]))[0, :3], atol=1e-9)


@given(SEED, st.integers(-1, LEGS - 1))
def test_the_margin_without_a_foot_is_that_of_the_others(at, seed, leg):
    rng = np.random.default_rng(seed)
    contacts = read_only(at.stance.contacts + rng.normal(0.0, 0.2, (LEGS, 3)))
    com, others = rng.normal(0.0, 0.5, 3), np.delete(contacts, leg, axis=0) if leg >= 0 else contacts
    for support in (IGNORED, PREFERRED, REQUIRED):
        expected = margins(others, com[None, :2], support == REQUIRED)[0]
        assert margin_without(contacts, leg, com, support) == pytest.approx(expected, abs=1e-9)


def moved(at, by, turn=(0.0, 0.0, 0.0)):
    """Where the chassis is, moved and turned in site."""
    T = np.array(at.T_site_base)
    T[:3, 3] += by
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return T


def wheels_off(robot, way, at):
    """How far the rim of a standing wheel is at most from where it stands, over a dense look at a chassis' way [m]."""
    radius, most = robot.wheel_radius, 0.0
    rim = np.array([(radius * c, 0.0, radius * s, 1.0) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1), (0, 0))]).T
    for i in range(len(way.postures) - 1):
        shares = np.linspace(0.0, 1.0, 9)
        Ts = base_path(way.Ts_site_base[i], way.Ts_site_base[i + 1], shares)
        for share, T in zip(shares, Ts, strict=True):
            q = (1 - share) * way.postures[i] + share * way.postures[i + 1]
            for leg in robot.legs:
                there = T @ leg_wheel_pose(robot, q[6 * leg : 6 * leg + 6], leg) @ rim
                off = np.linalg.norm((there - at.stance.Ts_site_wheel[leg] @ rim)[:3], axis=0)
                most = max(most, float(off.max()))
    return most


@pytest.mark.parametrize(
    ("by", "turn"),
    [
        ((0.0, 0.0, -0.2), (0.0, 0.0, 0.0)),
        ((0.06, 0.04, -0.2), (0.0, 0.03, 0.08)),
        ((0.0, 0.0, -0.15), (0.05, 0.0, -0.15)),
    ],
)
def test_wheels_stand_still_while_the_chassis_moves(athlete, world, at, by, turn):
    T = moved(at, by, turn)
    way = body_way(world.first.checks, at, T)
    assert not isinstance(way, Fails), way
    assert wheels_off(athlete, way, at) < DRIFT
    np.testing.assert_array_equal(way.postures[0], at.posture)
    np.testing.assert_array_equal(way.Ts_site_base[[0, -1]], [at.T_site_base, T])
    np.testing.assert_array_less(
        np.linalg.norm(np.diff(way.Ts_site_base[:, :3, 3], axis=0), axis=1), FARTHEST * BODY_STEP
    )
    assert np.isfinite([way.margins, way.torques]).all()


def test_waypoints_as_far_apart_as_they_may_be_keep_wheels_where_they_stand(athlete, world, at):
    T_to, feet = moved(at, (0.06, 0.04, -0.4), (0.0, 0.03, 0.08)), feet_of(at.stance)
    Ts = base_path(at.T_site_base, T_to, np.linspace(0.0, 1.0, 200))
    qs = np.empty((len(Ts), 36))
    for q, T in zip(qs, Ts, strict=True):
        assert legs_at(rows(T), feet, world.legs, q, np.empty(LEGS)) > -UNREACHED
    kept = waypoints_of(qs, len(qs))
    assert 3 < len(kept) < 100
    way = BodyWay(qs[kept], Ts[kept], np.zeros(len(kept)), np.zeros(len(kept)))
    assert wheels_off(athlete, way, at) < DRIFT
    # fewer would not: the ends alone are far off
    assert wheels_off(athlete, BodyWay(qs[[0, -1]], Ts[[0, -1]], np.zeros(2), np.zeros(2)), at) > 5 * DRIFT


def test_where_joints_bend_more_waypoints_are_kept():
    t = np.linspace(0.0, 1.0, 41)[:, None]
    straight = t * np.linspace(-0.5, 0.5, 36)
    assert waypoints_of(straight, FARTHEST).tolist() == [*range(0, 41, FARTHEST)]
    bent = straight + 0.05 * np.sin(8 * t)
    kept = waypoints_of(bent, FARTHEST)
    assert kept[[0, -1]].tolist() == [0, 40]
    assert 6 < len(kept) <= 41


def test_a_rock_under_the_chassis_stops_its_way_down_as_much_sooner_as_it_is_higher(athlete):
    free, step = [], 0.05
    for height in (0.6, 0.9):
        dem = wavy([(0.0, 0.0, 0.6, height)])
        at = stood(athlete, dem)
        checks = world_of(athlete, dem, at).first.checks
        depths = np.arange(0.4, 1.2, step)
        ways = [body_way(checks, at, moved(at, (0.0, 0.0, -depth))) for depth in depths]
        stopped = [isinstance(way, Fails) for way in ways]
        assert stopped == sorted(stopped)
        refused = [way for way in ways if isinstance(way, Fails)]
        assert {way.check for way in refused} == {"collision of chassis and the terrain on the body's way"}
        free.append(depths[stopped.index(True)] - step)
    assert free[0] - free[1] == pytest.approx(0.3, abs=1.01 * step)


def test_a_way_of_the_chassis_out_of_reach_is_refused_with_the_leg(world, at):
    found = body_way(world.first.checks, at, moved(at, (0.0, 0.0, 1.2)))
    assert isinstance(found, Fails)
    assert found.check == "reach on the body's way"
    assert 0 <= found.leg < LEGS
    ahead = body_way(world.first.checks, at, moved(at, (1.5, 0.0, 0.0)))
    assert isinstance(ahead, Fails)
    assert ahead.check == "reach on the body's way"


def longest_run(good):
    """First and last of the longest run, the earliest of those as long; (n, −1) without any."""
    best, begin = (len(good), -1), None
    for i, one in enumerate([*good, False]):
        if one and begin is None:
            begin = i
        if not one and begin is not None:
            if i - 1 - begin > best[1] - best[0]:
                best = begin, i - 1
            begin = None
    return best


@pytest.mark.parametrize("leg", [0, 4])
def test_spans_are_those_of_a_plain_loop(athlete, world, at, leg):
    rng = np.random.default_rng(21)
    x, lift, least = np.linspace(-1.5, 1.5, 31), 0.15, -0.02
    vectors = np.tile(vector_of(rows(at.T_site_base)) - (0, 0, 0.3, 0, 0, 0), (len(x), 1))
    vectors[:, 0], vectors[:, 5] = x, 0.3 * x
    Ts, count = np.empty((len(x), 3, 4)), 60
    poses_of(vectors, Ts)
    contacts = at.stance.contacts[leg] + rng.normal(0.0, 0.8, (count, 3)) * (1, 1, 0.1)
    headings = np.full(count, math.atan2(at.stance.contacts[leg, 1], at.stance.contacts[leg, 0]))
    wheels = wheel_pose_for_contact(athlete, contacts, np.tile([0.0, 0.0, 1.0], (count, 1)), headings, np.eye(4))
    first, last, best = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
    rover, far, branches = world.first.checks.rover, athlete.leg_length(leg), np.zeros(count, np.int64)
    asked = Reaching(lift, least, far, np.zeros(count, np.int64), len(x))
    spans(Ts, rows(wheels), branches, leg, asked, world.legs, rover, Spans(first, last, best))
    poses, runs = np.empty((7 * LEGS, 3, 4)), []
    for j in range(count):
        spares = []
        for T in Ts:
            found = []
            for up in (0.0, lift):
                T_site_wheel, q = rows(wheels[j]).copy(), np.empty(6)
                T_site_wheel[2, 3] += up
                found.append(leg_at(T, T_site_wheel, 0, leg, world.legs, q))
                if found[-1] >= least:
                    found.append(leg_too_near_itself(q, leg, T, rover, poses))
            spares.append(min(found))
        runs.append(longest_run(np.array(spares) >= least))
        if runs[-1][1] >= 0:
            assert best[j] == pytest.approx(max(spares))
    assert runs == [*zip(first.tolist(), last.tolist(), strict=True)]
    assert 10 < sum(run[1] >= 0 for run in runs) < count


@pytest.mark.parametrize(("ahead", "turned"), [(9.0, 0.4), (0.0, 1.5)])
def test_spans_look_at_every_pose_that_a_wheel_may_be_reached_from(athlete, ground, world, at, ahead, turned):
    x, y, yaw = vector_of(rows(at.T_site_base))[[0, 1, 5]]
    way = guide(ground, np.array([x, y, yaw]), np.array([x + ahead, y, yaw + turned]), footprint(athlete))
    places = footfalls(athlete, ground, np.array([-4.0, -4.0]), np.array([4.0, 4.0]), SETTINGS)
    Ts, count = np.empty((len(way.ways), 3, 4)), len(places.contacts)
    poses_of(way.vectors, Ts)
    reached = 0
    for leg, found in enumerate(reaches(world, way, places)):
        first, last, best = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
        wheels, branches, every = rows(found.Ts_site_wheel), np.zeros(count, np.int64), np.zeros(count, np.int64)
        asked = Reaching(SETTINGS.lift, LEAST, athlete.leg_length(leg), every, len(Ts))
        spans(Ts, wheels, branches, leg, asked, world.legs, world.first.checks.rover, Spans(first, last, best))
        good = last >= 0
        assert np.array_equal(np.isfinite(found.low), good)
        assert found.low[good] == pytest.approx(way.ways[first[good]])
        assert found.high[good] == pytest.approx(way.ways[last[good]])
        reached += int(good.sum())
    assert reached > 100
