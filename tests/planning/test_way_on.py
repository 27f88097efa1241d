"""What a walking rover does next: each reason not to go on is found, and nothing is tried for ever."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import MultiPoint, Point, Polygon

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.frames import apply, rotation, transform
from footfall.core.value import Provenance
from footfall.maps.standing import STANDING_GAP
from footfall.planning.body.stand import stand
from footfall.planning.walk.excerpt import parts_count, start_of
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk_execution.decision import Act, SoFar, WayOnSettings
from footfall.planning.walk_execution.ground_ahead import GROUND_MOVED, moved_ground, unknown_ground
from footfall.planning.walk_execution.off_walk import CHASSIS_MOVED, off_walk
from footfall.planning.walk_execution.pins_left import pins_left
from footfall.planning.walk_execution.way_on import arrived, way_on
from footfall.robot.description import with_payload
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from tests.support.chassis_ground import wavy

GOAL = WalkGoal(0.5, 0.1)
LIMITS = WayOnSettings()
NOWHERE = Provenance({}, WalkSettings())


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return stand(athlete, ground)


@pytest.fixture(scope="module")
def walk(athlete, ground, stood):
    found = plan_walk(athlete, ground, stood, GOAL, settings=WalkSettings(seed=1, smoothing=Smoothing(rounds=0)))
    assert found.plan is not None, found.reason
    assert found.plan.foot_moves > 2
    return found.plan


@pytest.fixture
def decides(athlete, ground, stood, walk):
    """decides(number=0, **what is otherwise) → the decision, of a rover that stands where that foot move begins."""

    def decide(number=0, *, dem=ground, goal=GOAL, plan=walk, so_far=None, limits=LIMITS, moved=None):
        posture, T = start_of(walk, min(number, parts_count(walk) - 1))
        T = T if moved is None else moved @ T
        state = replace(stood, posture=posture, T_site_base=T)
        return way_on(athlete, dem, state, goal, plan, number, so_far or SoFar(), limits)

    return decide


def raised(dem, by):
    return replace(dem, heights=(dem.heights + np.float32(by)).astype(np.float32))


def hole(dem, x, y, radius):
    grid = dem.geometry
    east = grid.x0 + grid.resolution * np.arange(grid.cols)
    north = grid.y0 + grid.resolution * np.arange(grid.rows)
    away = np.hypot(east[None, :] - x, north[:, None] - y)
    return replace(dem, heights=np.where(away <= radius, np.float32(np.nan), dem.heights))


def test_a_walk_that_fits_is_gone_on_with_from_each_of_its_foot_moves(decides, walk):
    for number in range(walk.foot_moves):
        found = decides(number)
        assert (found.act, found.reason) == (
            Act.GO,
            f"the walk fits: foot move {number + 1} of {walk.foot_moves} is next",
        )


def test_the_first_foot_move_of_a_walk_that_ends_before_the_goal_says_why(decides, walk):
    short = SoFar(short="it goes first to (1.00, 0.00): so it is")
    first = f"the walk fits: foot move 1 of {walk.foot_moves} is next; it goes first to (1.00, 0.00): so it is"
    assert decides(0, so_far=short).reason == first
    assert decides(1, so_far=short).reason == f"the walk fits: foot move 2 of {walk.foot_moves} is next"


def test_a_foot_that_comes_down_on_ground_of_memory_alone_is_told(decides, walk, ground):
    """The newest images show the ground but where the first foot comes down; no other foot move says so."""
    grid, there = ground.geometry, walk.stances[1].contacts[walk.legs[0]]
    rows, cols = np.mgrid[: grid.rows, : grid.cols]
    away = np.hypot(grid.x0 + grid.resolution * cols - there[0], grid.y0 + grid.resolution * rows - there[1])
    ones = np.ones(grid.shape, np.uint8)

    def dem(age):
        layers = {"variance": ones.astype(np.float32), "count": ones.astype(np.uint16), "source": ones}
        return replace(ground, time=1.7e9 - np.where(away < 0.1, age, 0.0), sources=("front",), **layers)

    old = f"; leg {walk.legs[0]} comes down on ground last seen 300 s before the newest"
    assert decides(0, dem=dem(300.0)).reason.endswith(old)
    assert decides(0, dem=dem(5.0)).reason == f"the walk fits: foot move 1 of {walk.foot_moves} is next"
    near = [np.hypot(*(walk.stances[at + 1].contacts[walk.legs[at]] - there)[:2]) for at in range(1, walk.foot_moves)]
    far = 1 + int(np.argmax(near))
    assert near[far - 1] > 0.6
    assert "last seen" not in decides(far, dem=dem(300.0)).reason


so_fars = st.builds(
    SoFar,
    moved=st.integers(0, 4),
    looked=st.booleans(),
    anew=st.integers(0, 5),
    refused=st.sampled_from(["", "no walk is found"]),
)
sooner = st.one_of(
    so_fars, st.builds(replace, so_fars, refused=st.just("no walk"), nearest=st.just(WalkGoal(1.0, 0.0)))
)


@settings(max_examples=60, derandomize=True, deadline=None)
@given(so_far=sooner, every=st.integers(0, 3), planned=st.booleans(), known=st.booleans())
def test_nothing_is_tried_for_ever_and_nothing_goes_unlooked_or_refused(
    athlete, ground, stood, walk, so_far, every, planned, known
):
    limits = WayOnSettings(look_every=every)
    dem, plan = ground if known else None, walk if planned else None
    posture, T = start_of(walk, 0)
    state = replace(stood, posture=posture, T_site_base=T)
    act = way_on(athlete, dem, state, GOAL, plan, 0, so_far, limits).act
    due = known and 0 < every <= so_far.moved
    goes_nearer = known and not due and so_far.nearest is not None and so_far.anew < limits.most_anew
    refused = bool(so_far.refused) and not goes_nearer
    assert (act is Act.LOOK) == (due or (not so_far.looked and (not known or refused)))
    if goes_nearer:
        assert act is Act.REPLAN
    if act is Act.REPLAN:
        assert so_far.anew < limits.most_anew
    assert (act is Act.GO) == (known and planned and not so_far.refused and not due)
    if act is Act.STOP:
        assert so_far.anew >= limits.most_anew


@settings(max_examples=20, derandomize=True, deadline=None)
@given(by=st.floats(-0.1, 0.1))
def test_a_walk_is_kept_on_ground_that_hardly_moved_and_on_no_other(walk, ground, by):
    lies_off = moved_ground(raised(ground, by), walk, 0)
    if abs(by) < GROUND_MOVED - 1e-4:
        assert lies_off == ""
    if abs(by) > GROUND_MOVED + 1e-4:
        assert f"{abs(by):.3f} m {'above' if by > 0 else 'below'}" in lies_off


def raised_under(dem, place, by):
    """Raised within 0.15 m of a place (2,)."""
    grid = dem.geometry
    rows, cols = np.mgrid[: grid.rows, : grid.cols]
    near = np.hypot(grid.x0 + grid.resolution * cols - place[0], grid.y0 + grid.resolution * rows - place[1]) < 0.15
    heights = dem.heights + np.where(near, np.float32(by), np.float32(0.0))
    return replace(dem, heights=heights.astype(np.float32))


def test_a_foot_that_stands_since_the_walk_began_is_asked_no_more_than_where_a_walk_begins(walk, ground):
    """Another walk from there would stand on the same place; one where the walk has put it is asked for more."""
    leg = walk.legs[-1]
    put = walk.legs.index(leg) + 1
    where = {number: walk.stances[number].contacts[leg] for number in (0, put)}
    between, beyond = 0.5 * (GROUND_MOVED + STANDING_GAP), STANDING_GAP + 0.01
    for number, by, holds in ((0, between, True), (0, beyond, False), (put, between, False)):
        later = [walk.stances[at + 1].contacts[walk.legs[at]] for at in range(number, walk.foot_moves)]
        others = np.vstack([np.delete(walk.stances[number].contacts, leg, axis=0), *later])
        assert np.hypot(*(others - where[number])[:, :2].T).min() > 0.15
        lies_off = moved_ground(raised_under(ground, where[number][:2], by), walk, number)
        assert (lies_off == "") == holds, lies_off
        if not holds:
            assert f"m above where leg {leg} stands in the walk" in lies_off


def test_a_walk_planned_on_the_ground_as_it_is_known_goes_on_whatever_it_is_off_the_feet_that_stand(
    decides, ground, walk
):
    """Planned anew it would stand as it does: only to look could help, and that was done."""
    higher = raised(ground, 1.5 * GROUND_MOVED)
    assert decides(0, dem=higher).act is Act.REPLAN
    parents = {**walk.provenance.parents, "dem": higher.digest}
    anew = replace(walk, provenance=replace(walk.provenance, parents=parents))
    assert decides(0, dem=higher, plan=anew).act is Act.GO


def test_ground_that_moved_under_one_later_footfall_makes_a_new_plan(decides, ground, walk):
    last = walk.foot_moves - 1
    x, y = walk.stances[-1].contacts[walk.legs[last], :2]
    found = decides(0, dem=raised_under(ground, (x, y), 0.06))
    assert found.act is Act.REPLAN
    assert f"0.060 m above where foot move {walk.foot_moves} puts its foot" in found.reason


def test_unknown_ground_under_the_next_foot_is_looked_at_and_that_of_later_ones_waits(athlete, decides, ground, walk):
    x, y = walk.stances[1].contacts[walk.legs[0], :2]
    dark = hole(ground, x, y, 0.5 * athlete.wheel_radius)
    found = decides(0, dem=dark)
    assert found.act is Act.LOOK
    assert f"foot of leg {walk.legs[0]}" in found.reason
    assert decides(0, dem=dark, so_far=SoFar(looked=True)).act is Act.REPLAN
    x, y = walk.stances[-1].contacts[walk.legs[-1], :2]
    later = hole(ground, x, y, 0.1)
    last = walk.foot_moves
    assert unknown_ground(athlete, later, walk, last - 1, last)
    if not unknown_ground(athlete, later, walk, 0, 1):
        assert decides(0, dem=later).act is Act.GO
        assert decides(0, dem=later, limits=WayOnSettings(foot_moves=last)).act is Act.LOOK


def test_every_place_that_a_walk_may_put_a_foot_on_is_known_enough_to_go_there(athlete, ground, walk):
    dark = ground
    for x, y in ((1.0, 0.3), (-1.2, 1.1), (0.2, -1.4)):
        dark = hole(dark, x, y, 0.3)
    places = footfalls(athlete, dark, np.array([-2.0, -2.0]), np.array([2.0, 2.0]), WalkSettings(spacing=0.1, seed=3))
    assert len(places.contacts) > 500
    stance, leg = walk.stances[1], walk.legs[0]
    for place in places.contacts:
        contacts = stance.contacts.copy()
        contacts[leg] = place
        there = replace(walk, stances=(walk.stances[0], replace(stance, contacts=contacts), *walk.stances[2:]))
        assert unknown_ground(athlete, dark, there, 0, 1) == ""


@pytest.mark.parametrize("up", [0.5 * CHASSIS_MOVED, 1.5 * CHASSIS_MOVED])
def test_a_rover_off_its_walk_plans_anew(decides, up):
    found = decides(0, moved=transform(translation=(0.0, 0.0, up)))
    assert found.act is (Act.REPLAN if up > CHASSIS_MOVED else Act.GO)
    assert ("off its walk" in found.reason) == (up > CHASSIS_MOVED)


def test_a_margin_under_its_limit_stops_by_the_polygon_of_the_feet(athlete, decides, stood, walk):
    """Second method: shapely, over the contacts that the walk itself names."""
    posture, T = start_of(walk, 0)
    com = apply(T, center_of_mass(athlete, posture))[:2]
    polygon = MultiPoint(walk.stances[0].contacts[:, :2]).convex_hull
    assert isinstance(polygon, Polygon)
    inside = polygon.exterior.distance(Point(com))
    assert "centre of mass is" not in decides(0, limits=WayOnSettings(least_margin=inside - 0.01)).reason
    found = decides(0, limits=WayOnSettings(least_margin=inside + 0.01))
    assert found.act is Act.STOP
    assert "centre of mass is" in found.reason


def test_limits_of_the_next_foot_moves_make_a_new_plan(decides, walk):
    rows = walk.moves == 0
    worst = float(walk.torques[rows].max())
    assert decides(0, limits=WayOnSettings(most_torque=worst + 0.001)).act is Act.GO
    found = decides(0, limits=WayOnSettings(most_torque=worst - 0.001))
    assert found.act is Act.REPLAN
    assert f"{worst:.0%} of its torque limit" in found.reason


def test_it_has_arrived_at_the_goal_alone(decides, walk):
    T = walk.Ts_site_base[-1]
    at = WalkGoal(float(T[0, 3]), float(T[1, 3]), 0.3, within=0.1, turned=0.2)
    for turn, there in ((0.3, True), (0.3 + 2 * np.pi, True), (0.45, True), (0.55, False), (-0.3, False)):
        assert arrived(at, transform(rotation("z", turn), T[:3, 3])) == there
    assert not arrived(at, transform(rotation("z", 0.3), T[:3, 3] + (0.0, 0.11, 0.0)))
    here = start_of(walk, 0)[1]
    assert decides(0, goal=WalkGoal(float(here[0, 3]), float(here[1, 3]))).act is Act.ARRIVED
    over = decides(parts_count(walk), goal=WalkGoal(3.0, 0.0))
    assert (over.act, over.reason) == (Act.REPLAN, "the walk is over, the goal is not reached")


def test_it_has_not_arrived_before_pinned_places_have_had_their_feet(decides, walk):
    here, last = (start_of(walk, number)[1] for number in (0, parts_count(walk) - 1))
    so_far = SoFar(unmet=(Place(3.0, 1.0), Place(-0.5, 0.25, leg=2)))
    assert decides(0, goal=WalkGoal(*map(float, here[:2, 3])), so_far=so_far).act is Act.GO
    over = decides(parts_count(walk), goal=WalkGoal(*map(float, last[:2, 3])), so_far=so_far)
    assert over.act is Act.REPLAN
    assert over.reason == "the walk is over, no foot is on the pinned places (3, 1), (-0.5, 0.25) yet"
    away = decides(parts_count(walk), goal=WalkGoal(3.0, 0.0), so_far=so_far)
    assert away.reason == "the walk is over, the goal is not reached"


def test_a_pinned_place_is_left_until_the_foot_move_is_made_that_puts_its_leg_there(walk):
    for number, leg in enumerate(walk.legs):
        x, y = (float(at) for at in walk.stances[number + 1].contacts[leg, :2])
        for pin in (Place(x, y, 0.01, leg), Place(x, y, 0.01)):
            assert pins_left(walk, (pin,), number) == (pin,)
            assert pins_left(walk, (pin,), number + 1) == ()
        others = (Place(x, y, 0.5, (leg + 1) % 6), Place(x + 3.0, y, 0.5, leg))
        assert pins_left(walk, others, walk.foot_moves) == others


def test_where_the_rover_is_not_sure_to_be_it_looks_and_stops_where_that_did_not_help(athlete, ground, stood, walk):
    """Also at the goal, where it might seem to be only."""
    posture, T = start_of(walk, 0)
    state = replace(stood, posture=posture, T_site_base=T)
    here = WalkGoal(float(T[0, 3]), float(T[1, 3]))

    def decided(so_far, doubt):
        return way_on(athlete, ground, state, here, walk, 0, so_far, LIMITS, doubt)

    assert decided(SoFar(), "").act is Act.ARRIVED
    found = decided(SoFar(), "it is old")
    assert (found.act, found.reason) == (Act.LOOK, "it is old")
    found = decided(SoFar(looked=True), "it is old")
    assert (found.act, found.reason) == (Act.STOP, "a look did not help: it is old")


def test_what_is_no_number_passes_no_limit(decides, walk, athlete, stood):
    for name in ("margins", "torques"):
        found = decides(plan=replace(walk, **{name: np.full_like(getattr(walk, name), np.nan)}))
        assert found.act is Act.REPLAN, (name, found)
    assert off_walk(athlete, stood, walk.waypoints[0], np.full((4, 4), np.nan))
    assert not arrived(GOAL, np.full((4, 4), np.nan))


def test_a_payload_counts_in_how_steadily_the_rover_stands(athlete, ground, stood, walk):
    """Second method: shapely, and a rover whose description carries it."""
    place = np.array([0.3, 0.9, 0.3])
    load = BalanceSettings(payload_mass=200.0, payload_position=place)
    described = Robot(with_payload(athlete.description, 200.0, position=place))
    posture, T = start_of(walk, 0)
    state = replace(stood, posture=posture, T_site_base=T)
    polygon = MultiPoint(walk.stances[0].contacts[:, :2]).convex_hull
    assert isinstance(polygon, Polygon)
    bare, inside = (
        polygon.exterior.distance(Point(apply(T, center_of_mass(robot, posture))[:2])) for robot in (athlete, described)
    )
    assert inside < bare - 0.05

    def steady(least, balance):
        limits = WayOnSettings(least_margin=least)
        found = way_on(athlete, ground, state, GOAL, walk, 0, SoFar(), limits, balance=balance)
        return "centre of mass is" not in found.reason

    assert steady(inside - 0.01, load)
    assert not steady(inside + 0.01, load)
    assert steady(inside + 0.01, None)
