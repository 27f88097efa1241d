"""Walks with legs that pass through the body: judged by other means, and by the laws they are made of."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, heading
from footfall.io.any_robot import load_legged
from footfall.io.robot_files import robot_toml
from footfall.planning.answers import Status
from footfall.planning.legged.circulate import MARGIN, plan_circulating
from footfall.planning.legged.footfalls import footfalls
from footfall.planning.legged.guide import Guide
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.rhythm import CirculatingRhythm
from footfall.planning.legged.stacks import crescent, ring_margins, stacks_of
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.stand import stand
from footfall.planning.legged.through_body import around
from footfall.robot.legged.posture import placed
from footfall.terrain.generate import fractal, plane
from tests.support.described import robot_of
from tests.support.legged_recheck import Recheck, faults

UNHURRIED = LeggedSettings(least_margin=MARGIN, time_limit=1e5)


@pytest.fixture(scope="module")
def ambler():
    return load_legged("ambler")


@pytest.fixture(scope="module")
def walks(ambler):
    """Ground and answer: straight over gentle ground, and a turn in place on level ground."""
    rough, level = fractal((24, 12), 0.1, roughness=0.1, seed=3), plane((12, 12), 0.1)
    asked = {"straight": (rough, (4.0, 0.0)), "turn": (level, (0.0, 0.0, 1.0))}
    made = {name: (dem, stand(ambler, dem), goal) for name, (dem, goal) in asked.items()}
    return {
        name: (dem, plan_circulating(ambler, dem, state, goal, UNHURRIED)) for name, (dem, state, goal) in made.items()
    }


def through(robot, plan):
    """For each foot move: leg, by how much its foot turns about its stack, and whether it passes the inner side."""
    left, right = stacks_of(robot)
    told = []
    for leg, rows in moves_of(plan):
        own, other = (left, right) if leg in left.legs else (right, left)
        angles, inner = [], False
        for row in rows:
            T = plan.Ts_site_base[row]
            foot = apply(np.linalg.inv(T), apply(T, placed(robot, plan.waypoints[row]).soles[leg]))[:2] - own.axis
            angles.append(np.arctan2(foot[1], foot[0]))
            way = other.axis - own.axis
            inner |= bool(foot @ way > 0.99 * np.linalg.norm(foot) * np.linalg.norm(way))
        told.append((leg, float(np.ptp(np.unwrap(angles))), inner))
    return told


def moves_of(plan):
    rows, found = np.arange(len(plan.legs)), []
    for row in rows:
        leg = int(plan.legs[row])
        if leg < 0:
            continue
        if not found or found[-1][0] != leg or found[-1][1][-1] != row - 1:
            found.append((leg, []))
        found[-1][1].append(row)
    return found


@pytest.mark.parametrize("name", ["straight", "turn"])
def test_a_walk_holds_when_it_is_judged_by_other_means(walks, ambler, name):
    dem, result = walks[name]
    assert result.status is Status.FOUND, result.reason
    recheck = Recheck(robot_toml("ambler").with_name("ambler.urdf"), ambler, [])
    assert faults(recheck.walk(dem, result.plan, 25)) == []


def test_it_arrives(walks):
    plans = {name: result.plan for name, (_, result) in walks.items()}
    np.testing.assert_allclose(plans["straight"].Ts_site_base[-1, :2, 3], (4.0, 0.0), atol=0.11)
    assert heading(plans["turn"].Ts_site_base[-1]) == pytest.approx(1.0)
    np.testing.assert_allclose(plans["turn"].Ts_site_base[-1, :2, 3], 0.0, atol=0.11)


@pytest.mark.parametrize("name", ["straight", "turn"])
def test_the_body_is_level_from_the_first_foot_move_on(walks, name):
    plan = walks[name][1].plan
    first = int(np.argmax(plan.legs >= 0))
    np.testing.assert_allclose(plan.Ts_site_base[first:, 2, 2], 1.0, atol=1e-12)


@pytest.mark.parametrize("name", ["straight", "turn"])
def test_legs_pass_between_the_stacks(walks, ambler, name):
    told = through(ambler, walks[name][1].plan)
    passing = [leg for leg, turned, inner in told if inner and turned > np.pi]
    assert len(passing) >= 3
    # the others only settle into the rhythm: they stay on the outer side
    assert all(turned < np.pi / 2 for _, turned, inner in told if not inner)


def test_the_rearmost_leg_comes_to_the_front_and_both_stacks_take_turns(walks, ambler):
    plan = walks["straight"][1].plan
    soles = plan.start.soles.copy()
    inner = [one for *_, one in through(ambler, plan)]
    steps = footfalls(ambler, plan)
    assert len(steps) == len(inner)
    passed = []
    for step, passes in zip(steps, inner, strict=True):
        own = next(stack.legs for stack in stacks_of(ambler) if step.leg in stack.legs)
        if passes:
            assert soles[step.leg, 0] == soles[list(own), 0].min()
        soles[step.leg] = step.point
        if passes:
            assert soles[step.leg, 0] == soles[list(own), 0].max()
            passed.append(own)
    assert all(one != following for one, following in pairwise(passed))


def test_in_a_turn_one_stack_goes_backward(walks, ambler):
    """Turning left the right stack goes forward; feet of the left one come to stand behind the others."""
    plan = walks["turn"][1].plan
    left, right = stacks_of(ambler)
    ahead = {left.legs: [], right.legs: []}
    for step, (_, _, passes) in zip(footfalls(ambler, plan), through(ambler, plan), strict=True):
        if passes:
            T = plan.Ts_site_base[step.row]
            own = left.legs if step.leg in left.legs else right.legs
            ahead[own].append(float(apply(np.linalg.inv(T), step.point)[0]))
    assert ahead[left.legs]
    assert ahead[right.legs]
    assert max(ahead[left.legs]) < 0 < min(ahead[right.legs])


def test_with_all_feet_down_the_weight_stays_where_any_foot_may_be_lost(walks, ambler):
    """The chain of conservative polygons, by shapely: hulls of all feet but one."""
    least = UNHURRIED.least_margin * ambler.length
    for _, result in walks.values():
        plan, soles, seen = result.plan, result.plan.start.soles.copy(), 0
        for row in range(len(plan.legs)):
            leg = int(plan.legs[row])
            if leg >= 0:
                soles[leg] = apply(plan.Ts_site_base[row], placed(ambler, plan.waypoints[row]).soles[leg])
                continue
            com = apply(plan.Ts_site_base[row], placed(ambler, plan.waypoints[row]).com)[:2]
            for lost in ambler.legs:
                hull = MultiPoint(np.delete(soles, lost, axis=0)[:, :2]).convex_hull
                assert hull.contains(Point(com))
                assert hull.boundary.distance(Point(com)) >= least - 1e-9
            seen += 1
        assert seen > 10


def test_stacks_stay_in_their_reachable_space_and_crescents_bound_it(ambler, rng):
    stacks = stacks_of(ambler)
    ease = Ground(ambler, plane((12, 12), 0.1), UNHURRIED).ease
    for stack in stacks:
        pieces = crescent(stack, ease.soles, tuple(ambler.legs))
        assert len(pieces)
        rings = [
            Point(*ease.soles[leg, :2])
            .buffer(stack.farthest, quad_segs=256)
            .difference(Point(*ease.soles[leg, :2]).buffer(stack.nearest, quad_segs=256))
            for leg in stack.legs
        ]
        shared = rings[0].intersection(rings[1]).intersection(rings[2])
        grown = shared.buffer(1e-3)
        assert all(grown.contains(Point(*corner)) for corner in pieces.reshape(-1, 2))
        places = stack.axis + rng.uniform(-1.5, 1.5, (400, 2))
        inside = ring_margins(stack, ease.soles, places, tuple(ambler.legs)) > 0
        edge = np.array([shared.boundary.distance(Point(*place)) for place in places]) < 1e-2
        by_shapely = np.array([shared.contains(Point(*place)) for place in places])
        assert (inside == by_shapely)[~edge].all()
        assert inside.any()
        # a leg reaches its foot from everywhere in there
        for place in places[inside][:20]:
            for leg in stack.legs:
                foot = ease.soles[leg] - [*(place - stack.axis), 0.0]
                assert ambler.limbs[leg].solve(foot[None]).counts[0] >= 1


def test_a_way_around_goes_by_the_side_it_is_to_go_by_and_no_nearer():
    axis, toward = np.zeros(2), np.array([0.0, -2.0])
    for start, end in (((-1.8, 1.4), (1.8, 1.4)), ((1.8, 1.4), (-1.8, 1.4)), ((0.1, 1.5), (-0.1, 1.5))):
        way = around(axis, toward, np.array(start), np.array(end), 1.0, 0.1)
        np.testing.assert_allclose(way[[0, -1]], (start, end), atol=1e-12)
        assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() <= 0.1 + 1e-9
        assert np.linalg.norm(way, axis=1).min() > 0.99
        assert (way[np.abs(way[:, 0]) < 0.5, 1] < 0).sum() > 3


@pytest.mark.parametrize("change", [(7.0, 0.0, 0.0), (-3.0, 4.0, 0.0), (0.0, 0.0, 1.4), (0.0, 0.0, -0.8)])
def test_a_foot_is_abeam_where_the_rhythm_says(ambler, change, rng):
    ease = Ground(ambler, plane((12, 12), 0.1), UNHURRIED).ease
    length = float(np.hypot(*change[:2])) or abs(change[2]) * 2.8
    yaw = float(np.arctan2(change[1], change[0]))
    rhythm = CirculatingRhythm(
        ease.soles, stacks_of(ambler), Guide(np.array([1.0, 2.0, yaw]), np.array(change), length)
    )
    for leg in ambler.legs:
        for s in rng.uniform(-1.7, 1.7, 5):
            assert rhythm.along(leg, rhythm.home(leg, s)) == pytest.approx(s, abs=1e-9)
    soles = np.array([[*rhythm.home(leg, s), 0.0] for leg, s in zip(ambler.legs, (1.5, 0.1, -1.2) * 2, strict=True)])
    at = rhythm.begun(soles)
    for stack in stacks_of(ambler):
        np.testing.assert_allclose(np.diff(sorted(at[leg] for leg in stack.legs)), rhythm.stride / 3)
        assert sorted(stack.legs, key=lambda leg: at[leg]) == sorted(
            stack.legs, key=lambda leg: rhythm.along(leg, soles[leg, :2])
        )
    offset = (min(at[leg] for leg in range(3)) - min(at[leg] for leg in range(3, 6))) % (rhythm.stride / 3)
    assert offset == pytest.approx(rhythm.stride / 6)


def test_a_robot_without_stacks_is_refused(walks):
    dem, result = walks["turn"]
    with pytest.raises(InvalidInput, match="does not turn about an upright axis"):
        plan_circulating(robot_of(6)[1], dem, result.plan.start, (1.0, 0.0))


def test_ground_that_is_not_known_ends_the_walk_with_what_was_found(ambler):
    dem = plane((18, 12), 0.1)
    heights = dem.heights.copy()
    heights[:, (dem.geometry.xs > 3.0) & (dem.geometry.xs < 6.0)] = np.nan
    broken = replace(dem, heights=heights)
    result = plan_circulating(ambler, broken, stand(ambler, broken), (7.0, 0.0), UNHURRIED)
    assert result.status is Status.NO_PATH
    assert result.plan is None
    assert result.partial is not None
    assert result.partial.moves
    assert result.partial.end.soles[:, 0].max() < 3.0
    assert "foot moves leg" in result.reason


def test_a_goal_off_the_map_is_refused_at_once(ambler, walks):
    dem, result = walks["turn"]
    refused = plan_circulating(ambler, dem, result.plan.start, (8.0, 0.0), UNHURRIED)
    assert refused.status is Status.OFF_MAP


def test_a_goal_of_four_numbers_is_no_goal(ambler, walks):
    dem, turned = walks["turn"]
    with pytest.raises(InvalidInput, match="a goal needs x and y"):
        plan_circulating(ambler, dem, turned.plan.start, (4.0, 0.0, 0.0, 9.0), UNHURRIED)


def test_the_clock_ends_a_walk(ambler, walks):
    dem, turned = walks["turn"]
    result = plan_circulating(ambler, dem, turned.plan.start, (4.0, 0.0), LeggedSettings(time_limit=1e-9))
    assert result.status is Status.TIME_LIMIT
    assert "no walk within 1e-09 s" in result.reason
