"""Routes of robots that others described go around what their feet can't stand on, and their walks go along them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, box

import footfall
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.guide import guide_to
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.walk import THIN
from footfall.planning.legged.way_round import way_round
from footfall.planning.route.problem import NoGo, RouteSettings, settings_by_leg
from footfall.planning.walk.problem import WalkGoal
from footfall.robot.legged.posture import chassis_pose
from tests.support.described import robot_of
from tests.support.legged_recheck import Recheck, faults
from tests.support.walled import GOAL, HALF, WALL, walled

UNHURRIED = LeggedSettings(time_limit=1e6)
ONCE = replace(UNHURRIED, least_margin=THIN)
"""With the margin that a walk is looked for with once more."""


@pytest.fixture(scope="module")
def ground():
    return walled()


@pytest.fixture(scope="module")
def robot():
    return robot_of(6)[1]


@pytest.fixture(scope="module")
def start(robot, ground):
    return footfall.stand(robot, ground)


@pytest.fixture(scope="module")
def found(robot, ground, start):
    result = footfall.plan_route(robot, ground, start, GOAL)
    assert result.plan is not None, result.reason
    return result


def test_it_keeps_what_feet_cannot_stand_on_out_of_their_reach(robot, ground, found):
    ease = at_ease(robot)
    feet = np.linalg.norm(ease.soles[:, :2], axis=1).max() + ease.stroke
    way = LineString(found.plan.points)
    np.testing.assert_allclose(found.plan.points[[0, -1]], [(0.0, 0.0), GOAL], atol=1e-9)
    assert LineString([(0.0, 0.0), GOAL]).distance(WALL) < ease.stroke
    assert way.distance(WALL) >= feet - found.provenance.settings.resolution
    low = footfall.plan_route(robot, walled(0.0), footfall.stand(robot, walled(0.0)), GOAL).plan
    assert low is not None
    assert low.length == pytest.approx(np.hypot(*GOAL), abs=1e-6)
    assert way.length > 1.1 * low.length


@pytest.fixture(scope="module")
def along(robot, ground, start, found):
    result = footfall.plan_walk(robot, ground, start, GOAL, UNHURRIED, route=found.plan)
    assert result.status is Status.FOUND, result.reason
    return result


def test_a_walk_along_it_arrives_and_holds_before_judges_of_its_own(robot, ground, found, along):
    path, _ = robot_of(6)
    np.testing.assert_allclose(along.plan.end.T_site_base[:2, 3], GOAL, atol=0.15)
    assert faults(Recheck(path, robot, []).walk(ground, along.plan, 60)) == []
    way = LineString(found.plan.points)
    off = max(way.distance(Point(T[:2, 3])) for T in along.plan.Ts_site_base)
    assert off <= 0.15 * robot.length
    assert LineString(along.plan.Ts_site_base[:, :2, 3]).hausdorff_distance(way) <= 0.2 * robot.length


def test_a_straight_walk_that_ends_at_the_wall_says_that_a_route_leads_around(robot, ground, start, found):
    straight = footfall.plan_walk(robot, ground, start, GOAL, ONCE)
    assert straight.status is Status.NO_PATH
    assert straight.reason.endswith(
        f"; a route of {found.plan.length:.2f} m leads around: plan it, then the walk along it"
    )


def test_nothing_is_said_of_routes_where_none_leads_around_and_where_one_goes_straight(robot, start):
    barred = walled(wall=box(0.6, -HALF, 0.7, HALF))
    assert [way_round(robot, dem, start, WalkGoal(*GOAL)) for dem in (barred, walled(0.0))] == ["", ""]


def test_it_is_among_what_the_walk_was_made_of(start, found, along):
    assert along.provenance.parents["route"] == found.plan.digest
    assert along.provenance.parents["state"] == start.digest


def test_a_route_that_leads_elsewhere_is_refused_with_how_far(robot, ground, start, found):
    with pytest.raises(InvalidInput, match=r"the route ends 1\.43 m from the goal: plan one to it"):
        footfall.plan_walk(robot, ground, start, (0.0, 0.0), UNHURRIED, route=found.plan)
    moved = replace(start, T_site_base=chassis_pose(-0.5, 0.0, 0.4, 0.0))
    with pytest.raises(InvalidInput, match=r"the route begins 0\.50 m from the chassis: plan it anew from here"):
        footfall.plan_walk(robot, ground, moved, GOAL, UNHURRIED, route=found.plan)


def test_no_go_areas_count_and_no_way_is_an_answer(robot, ground, start):
    usual = settings_by_leg(robot.length)
    end = replace(usual, no_go=(NoGo(0.65, -1.2, 0.85),))
    answer = footfall.plan_route(robot, ground, start, GOAL, end)
    assert answer.status is Status.NO_PATH, answer.reason
    assert "no way leads to the goal: it ends at (" in answer.reason
    unknown = footfall.plan_route(robot, ground, start, (9.0, 0.0))
    assert unknown.status is Status.OFF_MAP


def test_the_cost_that_is_of_athletes_legs_is_refused_by_name(robot, ground, start):
    with pytest.raises(InvalidInput, match='routes of ring cost by "goodness"'):
        footfall.plan_route(robot, ground, start, GOAL, RouteSettings(cost="feasible"))
    with pytest.raises(InvalidInput, match="the state is of elsewhere, the robot is ring"):
        footfall.plan_route(robot, ground, replace(start, robot="elsewhere"), GOAL)


def test_lengths_as_delivered_go_by_the_leg(athlete, robot):
    assert settings_by_leg(athlete.leg_length(0)).highest == pytest.approx(RouteSettings().highest, rel=1e-3)
    own, whole = settings_by_leg(robot.length), RouteSettings()
    share = robot.length / athlete.leg_length(0)
    for name in ("resolution", "highest"):
        assert getattr(own, name) / getattr(whole, name) == pytest.approx(share, rel=1e-3)
    for name in ("window", "roughness_limit", "step_limit"):
        assert getattr(own.maps, name) / getattr(whole.maps, name) == pytest.approx(share, rel=1e-3)
    assert (own.worst, own.maps.slope_limit) == (whole.worst, whole.maps.slope_limit)


@given(
    corners=st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), max_size=5),
    goal=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    yaw=st.none() | st.floats(-3, 3),
)
def test_a_guide_leads_through_all_corners_without_a_gap(robot, ground, corners, goal, yaw):
    T = chassis_pose(0.1, -0.2, 0.4, 0.5)
    route = np.array(corners).reshape(-1, 2) if corners else None
    guide = guide_to(Ground(robot, ground, LeggedSettings()), T, WalkGoal(*goal, yaw=yaw), route)
    behind, passed = 0.0, [guide.at(0.0)[:2]]
    for part in guide.parts:
        behind += part.length
        passed.append(guide.at(behind)[:2])
    np.testing.assert_allclose(passed, [(0.1, -0.2), *corners, goal], atol=1e-9)
    ends = guide.at(0.0)[2], guide.at(guide.length)[2]
    turned = 0.0 if yaw is None else (yaw - 0.5 + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(ends, (0.5, 0.5 + turned), atol=1e-9)
    places = np.array([guide.at(s) for s in np.linspace(0.0, guide.length, 200)])
    steps = np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)
    assert (steps <= guide.length / 199 + 1e-9).all()
