"""Where a walk to a far goal is planned to first: where every leg comes to footfalls on ground that is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components
from shapely import LineString, Point

from footfall.core.frames import apply, inverse, transform
from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.route.problem import Corridor, NoGo, Route, RouteResult, RouteSettings
from footfall.planning.walk.choices import way_ahead
from footfall.planning.walk.footfalls import unknown_away
from footfall.planning.walk.legs_kernel import pose_of
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import Place, WalkGoal, WalkResult, WalkSettings
from footfall.planning.walk.reach import come_to
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk_execution.stage import SEEDS, Stage, came_nearest, next_goal, stage
from footfall.planning.walk_execution.way_on import arrived
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import wheel_centers
from footfall.terrain.ground.surface import height_at, normal_at
from tests.support.chassis_ground import wavy

GOAL = WalkGoal(2.0, 0.5)
AS_FOUND = WalkSettings(seed=1, smoothing=Smoothing(rounds=0))
NOWHERE = Provenance({}, WalkSettings())


@pytest.fixture(scope="module")
def ground():
    return wavy(half=5.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return stand(athlete, ground)


def known_to(ground, edge):
    """The ground west of ``edge`` [m], the rest unknown."""
    grid = ground.geometry
    east = grid.x0 + grid.resolution * np.arange(grid.cols)
    return replace(ground, heights=np.where(east[None, :] > edge, np.float32(np.nan), ground.heights))


def reached(robot, dem, T_site_base, leg, places):
    """Whether a leg reaches any of these places (n, 2), by the inverse kinematics alone."""
    x, y = places[:, 0], places[:, 1]
    contacts, normals = np.column_stack([places, height_at(dem, x, y)]), normal_at(dem, x, y, robot.wheel_radius)
    sure = np.isfinite(contacts).all(axis=1) & np.isfinite(normals).all(axis=1)
    hip = (T_site_base @ robot.description.legs[leg].T_base_hip)[:3]
    outward = np.full(int(sure.sum()), np.arctan2(*(hip[:2, 3] - T_site_base[:2, 3])[::-1]))
    wheels = wheel_pose_for_contact(robot, contacts[sure], normals[sure], outward, np.eye(4))
    q = solve_leg(robot, leg, inverse(T_site_base) @ wheels).q
    return bool(np.isfinite(q).all(axis=-1).any())


@settings(max_examples=3, derandomize=True, deadline=None)
@given(edge=st.floats(1.6, 4.0), farthest=st.floats(0.5, 3.0))
def test_a_stage_lies_on_the_way_and_every_leg_reaches_known_ground_there(athlete, ground, stood, edge, farthest):
    """Second method: the inverse kinematics on a dense grid of places, without spans."""
    dark = known_to(ground, edge)
    found = stage(athlete, dark, stood, GOAL, farthest, AS_FOUND)
    here = stood.T_site_base[:2, 3]
    if isinstance(found, str):
        # not even the nearest place that is asked for is fit for the foot ahead
        assert "on known ground" in found
        assert edge < here[0] + athlete.leg_length(0) + 1.0
        return
    on, way = np.array([found.goal.x, found.goal.y]) - here, np.array([GOAL.x, GOAL.y]) - here
    assert np.hypot(*on) <= farthest + 1e-9
    assert on[0] * way[1] == pytest.approx(on[1] * way[0], abs=1e-9)
    assert (found.goal is GOAL) == (not found.short)
    assert not arrived(found.goal, stood.T_site_base)
    through = np.array([here, here + on])
    ahead = way_ahead(athlete, dark, stood, through, found.settings)
    assert ahead is not None
    assert ahead.choices(found.settings.seed)[-1].min() >= 1
    T = np.eye(4)
    pose_of(ahead.way.vectors[-1], T[:3])
    grid = np.stack(np.meshgrid(np.arange(-1.0, 5.0, 0.2), np.arange(-3.5, 3.5, 0.2)), axis=-1).reshape(-1, 2)
    places = grid[unknown_away(dark, grid) > athlete.wheel_radius]
    assert all(reached(athlete, dark, T, leg, places) for leg in athlete.legs)


def test_a_walk_to_a_stage_at_the_edge_of_known_ground_is_found_and_one_beyond_refused_at_once(athlete, ground, stood):
    dark = known_to(ground, 2.6)
    found = stage(athlete, dark, stood, WalkGoal(3.0, 0.0), 3.0, AS_FOUND)
    assert isinstance(found, Stage)
    assert "on known ground" in found.short
    walk = plan_walk(athlete, dark, stood, found.goal, settings=found.settings)
    assert walk.status is Status.FOUND, walk.reason
    beyond = plan_walk(athlete, dark, stood, WalkGoal(2.5, 0.0), settings=AS_FOUND)
    assert (beyond.status, beyond.partial) == (Status.GOAL_INVALID, None)
    assert "leg 0 has no footfall on which it stands with the chassis at the goal" in beyond.reason
    assert found.goal.x < 2.5


def test_a_foot_that_comes_to_no_footfall_ahead_by_moves_not_too_long_keeps_the_stage_back(athlete, ground, stood):
    """Ground that no wheel may be put on lies around where a foot stands, wider than one move."""
    x, y = (float(at) for at in apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[0, :2])
    caught = replace(AS_FOUND, forbidden=(Place(x, y, AS_FOUND.longest + 0.01),))
    free = stage(athlete, ground, stood, GOAL, 2.0, AS_FOUND)
    kept = stage(athlete, ground, stood, GOAL, 2.0, caught)
    assert isinstance(free, Stage)
    assert isinstance(kept, str)
    assert "leg 0 has no footfalls" in kept
    # ground that is forbidden to that leg alone keeps it back as well, and no other leg's does
    own = replace(AS_FOUND, forbidden=(replace(caught.forbidden[0], leg=0),))
    others = replace(AS_FOUND, forbidden=(replace(caught.forbidden[0], leg=3),))
    assert stage(athlete, ground, stood, GOAL, 2.0, own) == kept
    stepping = stage(athlete, ground, stood, GOAL, 2.0, others)
    assert isinstance(stepping, Stage)
    assert stepping.goal.digest == free.goal.digest
    result = plan_walk(athlete, ground, stood, WalkGoal(1.5, 0.0), settings=caught)
    assert result.status is Status.GOAL_INVALID
    assert "leg 0 has no footfall" in result.reason


def test_the_seed_that_leads_farthest_is_taken_where_ground_is_lacking_and_the_first_where_it_is_not(
    athlete, ground, stood
):
    """Second method: each seed alone, by the footfalls that there are at each place."""
    dark, goal = known_to(ground, 2.6), WalkGoal(3.0, 0.0)
    through = np.array([stood.T_site_base[:2, 3], (goal.x, goal.y)])
    far = {}
    for seed in range(5, 5 + SEEDS):
        one = way_ahead(athlete, dark, stood, through, AS_FOUND)
        assert one is not None
        far[seed] = float(one.way.vectors[(one.choices(seed) >= 2).all(axis=1), 0].max())
    found = stage(athlete, dark, stood, goal, 5.0, replace(AS_FOUND, seed=5))
    assert isinstance(found, Stage)
    assert found.goal.x == pytest.approx(max(far.values()), abs=1e-9)
    assert far[found.settings.seed] == max(far.values())
    near = stage(athlete, ground, stood, GOAL, 1.0, replace(AS_FOUND, seed=5))
    assert isinstance(near, Stage)
    assert (near.settings.seed, near.left) == (5, 0.0)


@settings(max_examples=40, derandomize=True, deadline=None)
@given(seed=st.integers(0, 1000), count=st.integers(0, 60), longest=st.floats(0.1, 3.0))
def test_a_foot_comes_to_the_places_that_a_graph_of_moves_joins_to_where_it_stands(seed, count, longest):
    """Second method: the parts that a whole graph falls into (scipy)."""
    xy = np.random.default_rng(seed).uniform(-4.0, 4.0, (count + 1, 2))
    near = np.linalg.norm(xy[:, None] - xy[None], axis=2) <= longest
    _, part = connected_components(near)
    assert (come_to(xy[:-1], xy[-1], longest) == (part[:-1] == part[-1])).all()


def test_footfalls_that_a_leg_reaches_from_no_pose_from_which_it_reaches_where_it_stands_count_for_nothing(
    athlete, ground, stood
):
    """Second method: seen from the way's end, the place where the foot stands lies behind the leg's own hip."""
    x, y = (float(at) for at in apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[0, :2])
    ring = replace(AS_FOUND, forbidden=(Place(x, y, AS_FOUND.longest - 0.01, leg=0),))
    through = np.array([stood.T_site_base[:2, 3], (GOAL.x, GOAL.y)])
    ahead = way_ahead(athlete, ground, stood, through, ring)
    assert ahead is not None
    near, all_ = ahead.choices(1), ahead.choices(1, np.inf)
    assert (near <= all_).all()
    assert (near[:, 1:] == all_[:, 1:]).all()
    assert near[:, 0].max() == 0 < all_[-1, 0]
    T = np.eye(4)
    pose_of(ahead.way.vectors[-1], T[:3])
    hip, foot = athlete.description.legs[0].T_base_hip[:2, 3], (inverse(T) @ (x, y, ground.heights.mean(), 1.0))[:2]
    assert foot @ hip < hip @ hip
    # the rover may still get on beside the way, so a place is named all the same
    assert isinstance(stage(athlete, ground, stood, GOAL, 2.0, ring), Stage)


@settings(max_examples=5, derandomize=True, deadline=None)
@given(farthest=st.floats(0.05, 2.0), within=st.floats(0.05, 2.0))
def test_on_known_ground_there_is_always_a_stage_and_the_rover_is_not_there_yet(
    athlete, ground, stood, farthest, within
):
    goal = WalkGoal(2.0, 0.5, within=within)
    found = stage(athlete, ground, stood, goal, farthest, AS_FOUND)
    assert isinstance(found, Stage)
    assert np.hypot(*(np.array([found.goal.x, found.goal.y]) - stood.T_site_base[:2, 3])) <= farthest + 1e-9
    assert found.goal.within <= goal.within
    if found.goal is not goal:
        assert not arrived(found.goal, stood.T_site_base)


def test_a_goal_on_a_route_lies_as_far_along_it_and_the_route_goes_where_the_rover_can_stand(athlete, ground, stood):
    asked, way = [], np.array([(0.0, 0.0), (0.0, 1.0), (2.0, 1.0)])
    at_origin = replace(stood, T_site_base=transform(np.eye(3), (0.0, 0.0, stood.T_site_base[2, 3])))

    def routed(place):
        asked.append(place)
        plan = Route(way, 3.0, NOWHERE) if len(asked) > 1 else None
        return RouteResult(
            Status.FOUND if plan else Status.GOAL_INVALID, plan, "bad ground", place, NOWHERE, (1.9, 1.0)
        )

    # of a goal that is not known yet, the route leads near a place that is
    goal = WalkGoal(50.0, 0.0, within=0.2)
    found = next_goal(athlete, ground, at_origin, goal, 1.5, AS_FOUND, routed)
    assert isinstance(found, Stage)
    assert (found.goal.x, found.goal.y, found.goal.yaw) == (pytest.approx(0.5), pytest.approx(1.0), None)
    assert found.short == "it goes first to (0.50, 1.00): 1.5 m are planned at once"
    assert asked[1] == (1.9, 1.0)
    assert asked[0][0] < ground.geometry.bounds[2]
    beside = replace(at_origin, T_site_base=transform(np.eye(3), (0.1, 0.8, stood.T_site_base[2, 3])))
    found = next_goal(athlete, ground, beside, goal, 0.6, AS_FOUND, routed)
    assert isinstance(found, Stage)
    # straight to the corner, √0.05 away, then along the second part
    assert (found.goal.x, found.goal.y) == (pytest.approx(0.6 - np.sqrt(0.05)), pytest.approx(1.0))
    straight = next_goal(athlete, ground, at_origin, goal, 1.5, AS_FOUND)
    staged = stage(athlete, ground, at_origin, goal, 1.5, AS_FOUND)
    assert isinstance(straight, Stage)
    assert isinstance(staged, Stage)
    assert straight.goal.digest == staged.goal.digest


@pytest.mark.parametrize(
    "keeps",
    [
        RouteSettings(no_go=(NoGo(0.5, 0.5, 0.3),)),
        RouteSettings(corridors=(Corridor(0.0, 0.0, 0.0, 1.0, 0.25), Corridor(0.0, 1.0, 2.0, 1.0, 0.3))),
    ],
    ids=["no-go", "corridors"],
)
def test_the_straight_way_to_a_goal_on_a_route_keeps_off_what_the_route_keeps_off(athlete, ground, stood, keeps):
    way = np.array([(0.0, 0.0), (0.0, 1.0), (2.0, 1.0)])
    at_origin = replace(stood, T_site_base=transform(np.eye(3), (0.0, 0.0, stood.T_site_base[2, 3])))

    def first(keeps, farthest=1.5):
        routed = RouteResult(Status.FOUND, Route(way, 3.0, NOWHERE), "", (2.0, 1.0), NOWHERE)
        found = next_goal(athlete, ground, at_origin, WalkGoal(2.0, 1.0), farthest, AS_FOUND, lambda _: routed, keeps)
        assert isinstance(found, Stage)
        return found

    def cuts_in(x):
        straight = LineString([(0.0, 0.0), (x, 1.0)])
        if keeps.no_go:
            return straight.distance(Point(0.5, 0.5)) < 0.3
        legs = (LineString(way[:2]).buffer(0.25, 64), LineString(way[1:]).buffer(0.3, 64))
        return not straight.within(legs[0].union(legs[1]).buffer(1e-3))

    assert cuts_in(first(None).goal.x)
    found = first(keeps)
    assert found.goal.y == pytest.approx(1.0)
    assert found.goal.x > 0.2
    assert not cuts_in(found.goal.x)
    assert cuts_in(found.goal.x + 0.1)
    assert "leads through a no-go area or out of the corridors" in found.short
    # where the rover stands in such ground already, it is led out of it
    assert first(RouteSettings(no_go=(NoGo(0.0, 0.0, 0.3),))).goal.digest == first(None).goal.digest


def test_where_a_goal_that_is_known_is_cut_off_no_route_goes_beside_it(athlete, ground, stood):
    def routed(place):
        return RouteResult(Status.GOAL_INVALID, None, "bad ground", place, NOWHERE, (1.0, 0.0))

    near = WalkGoal(0.5, 0.1)
    assert next_goal(athlete, ground, stood, near, 1.0, AS_FOUND, routed) == "no route leads on: bad ground"


def test_only_a_search_that_found_no_walk_and_came_on_says_where_to_go(athlete, ground, stood):
    walk = plan_walk(athlete, ground, stood, WalkGoal(0.5, 0.1), settings=AS_FOUND).plan
    assert walk is not None
    far = float(np.hypot(*(walk.Ts_site_base[-1, :2, 3] - walk.Ts_site_base[0, :2, 3])))

    def found(status, partial, plan=None):
        return came_nearest(WalkResult(status, plan, "", (), GOAL, NOWHERE, partial))

    for status in (Status.TIME_LIMIT, Status.NO_PATH):
        nearest = found(status, walk)
        assert nearest is not None
        assert (nearest.x, nearest.y) == pytest.approx(walk.Ts_site_base[-1, :2, 3])
        assert nearest.within <= far / 2.0
        assert found(status, None) is None
    assert found(Status.FOUND, None, walk) is None
    stayed = replace(walk, Ts_site_base=np.repeat(walk.Ts_site_base[:1], len(walk.Ts_site_base), axis=0))
    assert found(Status.TIME_LIMIT, stayed) is None
