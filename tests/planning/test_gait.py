"""Gaits: their rhythm, and whole ones judged by the recheck of walks; where ground breaks them the check is named."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import MultiPoint, Point

import footfall
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.gait import plan as gait_plan
from footfall.planning.gait.failing import posture_over
from footfall.planning.gait.problem import GAITS, RIPPLE, TRIPOD, WAVE, GaitSettings
from footfall.planning.gait.rhythm import groups_of, rhythm
from footfall.planning.gait.step import leg_lacks
from footfall.planning.gait.way import way_to
from footfall.planning.motion import BODY
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.body_way import At
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.parts import parts_of
from footfall.planning.walk.plan import BESIDE
from footfall.planning.walk.problem import SWING, WalkSettings
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.stretches import MotionStretch
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.start import start_of
from footfall.planning.walk.world import World
from footfall.robot.ik import wheel_pose_for_contact
from footfall.robot.kinematics import wheel_pose
from footfall.terrain.from_arrays import from_heights

COARSE = RecheckSettings(way=0.01, turn=0.02, hold=0.2)
DUTY = {TRIPOD: 1 / 2, RIPPLE: 2 / 3, WAVE: 5 / 6}
GOAL = (0.4, 0.1)


def ground(change=None):
    x, y = np.meshgrid(np.arange(-6, 6.05, 0.1), np.arange(-6, 6.05, 0.1))
    z = np.zeros(x.shape) if change is None else change(x, y)
    return from_heights(z.astype(np.float32), 0.1, -6.0, -6.0, "made")


def rolling(x, y):
    return 0.1 * np.sin(1.1 * x + 0.4) * np.cos(0.9 * y)


@pytest.fixture(scope="module")
def place(athlete):
    dem = ground(rolling)
    return dem, footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def plans(athlete, place):
    dem, state = place
    return {gait: plan_of(footfall.plan_gait(athlete, dem, state, GOAL, gait)) for gait in GAITS}


def plan_of(result):
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    return result.plan


def failure_of(result):
    assert result.status is Status.NO_PATH
    assert result.failure is not None
    return result.failure


def fails(robot, dem, plan, state):
    return {one.name for one in recheck_walk(robot, dem, plan, every=COARSE, state=state) if not one.holds}


@given(st.sampled_from(sorted(GAITS)), st.floats(0.0, 9.0), st.floats(0.05, 1.0), st.floats(-math.pi, math.pi))
def test_rhythm(athlete, gait, length, longest, heading):
    groups = groups_of(athlete, gait, heading)
    beat = rhythm(groups, length, longest)
    assert sorted(leg for group in groups for leg in group) == list(athlete.legs)
    assert beat.stride <= longest + 1e-9
    assert beat.cycles * beat.stride == pytest.approx(length)
    for leg in athlete.legs:
        own = np.flatnonzero(beat.legs == leg)
        # where one footfall of a leg ends the next begins, from the first foot move to the end
        assert beat.first[own[0]] == 0
        assert beat.last[own[-1]] == beat.moves
        assert (beat.last[own[:-1]] == beat.first[own[1:]]).all()
        assert np.mean([leg not in beat.group(move) for move in range(beat.moves)]) == pytest.approx(DUTY[gait])
    # no foot is ever farther from ease than half a stride
    for end in (beat.first, beat.last):
        assert np.abs(beat.ways[end] - beat.ideal).max() <= 0.5 * beat.stride + 1e-9
    for move in range(beat.moves):
        assert tuple(beat.legs[row] for row in beat.rows(move)) == beat.group(move)
        assert all(beat.first[row] == move for row in beat.rows(move))


def test_groups(athlete):
    hips = np.array([leg.T_base_hip[:2, 3] for leg in athlete.description.legs])
    for pair in groups_of(athlete, RIPPLE, 0.3):
        np.testing.assert_allclose(hips[list(pair)].sum(axis=0), 0.0, atol=1e-9)
    ahead = [hips[leg] @ (math.cos(0.3), math.sin(0.3)) for (leg,) in groups_of(athlete, WAVE, 0.3)]
    assert ahead == sorted(ahead)


@given(st.floats(-1.4, 1.4), st.floats(0.5, 4.0), st.floats(-3.0, 3.0))
def test_arc(athlete, aside, away, yaw):
    """The chassis stays on a circle that its heading touches."""
    dem, ease = ground(), footprint(athlete)
    goal = away * np.array([math.cos(yaw + aside), math.sin(yaw + aside)])
    way = way_to(dem, np.array([0.0, 0.0, yaw]), goal, None, ease, True)
    xy, yaws = way.vectors[:, :2], way.vectors[:, 5]
    np.testing.assert_allclose(xy[-1], goal, atol=1e-9)
    assert yaws[-1] - yaws[0] == pytest.approx(math.remainder(2 * aside, 2 * math.pi), abs=1e-9)
    if abs(aside) > 0.05:
        left = np.column_stack([-np.sin(yaws), np.cos(yaws)])
        middles = xy + left * away / (2.0 * math.sin(aside))
        # chords of the arc, of which there are 64, are that far inside
        np.testing.assert_allclose(middles, np.broadcast_to(middles[0], middles.shape), atol=2e-3 * away)
    assert (np.diff(way.ways) >= 0).all()


@pytest.mark.parametrize("aside", [1.4, -1.4])
def test_all_ground_along_an_arc_is_looked_at(athlete, monkeypatch, aside):
    """It leaves the box of its ends: ground that is not looked at is free."""
    dem = from_heights(np.zeros((121, 121), np.float32), 0.5, -30.0, -30.0, "wide")
    state, looked_at = footfall.stand(athlete, dem), []
    monkeypatch.setattr(gait_plan, "without_holes_between", lambda *asked: looked_at.append(asked[1:3]))
    goal = 24.0 * np.array([math.cos(aside), math.sin(aside)])
    found = footfall.plan_gait(athlete, dem, state, (goal[0], goal[1]), settings=GaitSettings(arc=True))
    assert found.status is Status.UNKNOWN_GROUND
    way = way_to(dem, np.zeros(3), goal, None, footprint(athlete), True).vectors[:, :2]
    [(low, high)] = looked_at
    assert ((way - low).min(axis=0) >= 2.0 * BESIDE - 0.1).all()
    assert ((high - way).min(axis=0) >= 2.0 * BESIDE - 0.1).all()


@pytest.mark.parametrize(("goal", "status"), [((6.2, 0.0), Status.OFF_MAP), ((1.0, 0.0), Status.UNKNOWN_GROUND)])
@pytest.mark.parametrize("gait", GAITS)
def test_a_goal_that_nobody_knows_the_ground_of_is_refused_as_a_walk_s_is(athlete, place, gait, goal, status):
    dem, state = place
    holed = with_hole(dem, 1.0, 0.0)
    walk = footfall.plan_walk(athlete, holed, state, goal)
    found = footfall.plan_gait(athlete, holed, state, goal, gait)
    assert (found.status, found.plan, found.partial) == (status, None, None)
    assert (found.status, found.reason) == (walk.status, walk.reason)


def test_a_rover_turns_over_ground_that_it_hides(athlete, place):
    dem, state = place
    plan_of(footfall.plan_gait(athlete, with_hole(dem, *state.T_site_base[:2, 3]), state, (0.0, 0.0, 0.1)))


def with_hole(dem, x, y):
    """The ground without what is 0.3 m around a place."""
    away = np.linalg.norm(dem.geometry.centers() - (x, y), axis=-1)
    return replace(dem, heights=np.where(away < 0.3, np.float32(np.nan), dem.heights))


def test_no_arc_behind_or_to_a_heading(athlete, place):
    dem, state = place
    settings = GaitSettings(arc=True)
    for goal in ((-1.0, 0.0), (1.0, 0.2, 0.4), (0.0, 0.0)):
        with pytest.raises(InvalidInput, match="an arc leads ahead"):
            footfall.plan_gait(athlete, dem, state, goal, settings=settings)


@pytest.mark.parametrize("gait", sorted(GAITS))
def test_found_gaits_hold_by_other_means(athlete, place, plans, gait):
    dem, state = place
    plan = plans[gait]
    assert fails(athlete, dem, plan, state) == set()
    assert np.allclose(plan.Ts_site_base[-1, :2, 3], GOAL, atol=1e-6)
    assert plan.duty == pytest.approx(DUTY[gait])
    assert {len(group) for group in plan.groups[plan.settling :]} == {round(6 * (1 - plan.duty))}
    # margins by other means: centre of mass by pin, polygon by shapely
    i = int(np.argmin(plan.margins))
    one = slice(i, i + 1)
    still = MotionStretch(
        athlete, 0, 1, (), plan.waypoints[one], plan.Ts_site_base[one], np.zeros(1, int), np.zeros(1), (BODY,)
    )
    lifted = plan.groups[plan.moves[i]] if plan.phases[i] != BODY else ()
    feet = MultiPoint(np.delete(plan.stances[plan.moves[i]].contacts, list(lifted), axis=0)[:, :2]).convex_hull
    com = Point(still.coms_site[0, :2])
    assert feet.contains(com)
    # the least since the row before
    assert plan.margins[i] <= feet.boundary.distance(com) + 1e-6
    assert plan.margins[i] == pytest.approx(feet.boundary.distance(com), abs=0.01)


def test_the_recheck_sees_what_is_wrong_with_a_group(athlete, place, plans):
    dem, state = place
    plan = plans[TRIPOD]
    over = np.array([phase == SWING for phase in plan.phases])
    move = int(plan.moves[np.flatnonzero(over)[-1]])
    group = plan.groups[move]
    # one leg of three is not said to move
    fewer = tuple(legs[1:] if number == move else legs for number, legs in enumerate(plan.groups))
    assert "phases" in fails(athlete, dem, replace(plan, groups=fewer), state)
    # the last leg of the group swings through the ground
    low = plan.waypoints.copy()
    rows = np.flatnonzero((plan.moves == move) & np.array([phase != BODY for phase in plan.phases]))
    own = slice(6 * group[-1], 6 * group[-1] + 6)
    low[rows, own] = np.linspace(low[rows[0] - 1, own], low[rows[-1], own], len(rows) + 1)[1:]
    assert "terrain collision" in fails(athlete, dem, replace(plan, waypoints=low), state)
    # a foot that stands is turned
    turned = plan.waypoints.copy()
    other = next(leg for leg in athlete.legs if leg not in group)
    turned[rows[0] - 1 :, 6 * other] += 0.01
    assert "contact" in fails(athlete, dem, replace(plan, waypoints=turned), state)


def test_a_wave_is_a_walk(athlete, place, plans):
    dem, state = place
    walk = plans[WAVE].walk
    assert fails(athlete, dem, walk, state) == set()
    parts = parts_of(walk)
    assert sum(hasattr(part, "leg") for part in parts) == walk.foot_moves
    for one, other in pairwise(parts):
        np.testing.assert_array_equal(one.waypoints[-1], other.waypoints[0])
    with pytest.raises(InvalidInput, match="one foot at a time"):
        _ = plans[TRIPOD].walk


def test_the_same_again(athlete, place, plans):
    dem, state = place
    assert plan_of(footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD)).digest == plans[TRIPOD].digest


@pytest.mark.parametrize(("goal", "arc"), [((0.0, 0.0, 0.3), False), ((0.5, 0.1), True)], ids=["in place", "arc"])
def test_turns(athlete, place, goal, arc):
    dem, state = place
    plan = plan_of(footfall.plan_gait(athlete, dem, state, goal, TRIPOD, GaitSettings(arc=arc)))
    T = plan.Ts_site_base[-1]
    asked = 2 * math.atan2(goal[1], goal[0]) if arc else goal[2]
    # the heading of a chassis that leans: of its x, seen from above
    assert math.atan2(T[1, 0], T[0, 0]) == pytest.approx(asked, abs=1e-6)
    assert fails(athlete, dem, plan, state) == set()


def test_footfalls_give_way(athlete, place, plans):
    """Where an ideal footfall can't be stood on, the nearest place within the tolerance is taken, else none."""
    _, state = place
    plain = plans[TRIPOD]
    move = plain.settling
    leg = plain.groups[move][0]
    x0, y0 = plain.stances[move + 1].contacts[leg, :2]

    def pit(x, y):
        # narrower than the tolerance, and as steep as a wheel would not stand on
        return rolling(x, y) - np.where(np.hypot(x - x0, y - y0) < 0.06, 0.3, 0.0)

    broken = ground(pit)
    strict = footfall.plan_gait(athlete, broken, state, GOAL, TRIPOD, GaitSettings(tolerance=0.0))
    assert strict.status is Status.NO_PATH
    wide = plan_of(footfall.plan_gait(athlete, broken, state, GOAL, TRIPOD, GaitSettings(tolerance=0.6)))
    assert wide.adapted > 0
    assert fails(athlete, broken, wide, state) == set()


@pytest.mark.parametrize(
    ("change", "names"),
    [
        (lambda x, y: np.where(x > 2.9, 2.5, 0.0), ("footfall", "reach", "collision", "joint limits")),
        (lambda x, y: np.where(x > 2.9, np.nan, 0.0), ("footfall",)),
    ],
    ids=["wall", "hole"],
)
def test_broken_ground(athlete, change, names):
    dem = ground(change)
    state = footfall.stand(athlete, dem)
    result = footfall.plan_gait(athlete, dem, state, (2.0, 0.0))
    failure = failure_of(result)
    assert failure.check_name.startswith(names)
    assert failure.lacks > 0.0
    assert result.reason.startswith(failure.text)
    assert 0.0 < result.walked < 2.0
    # it is good as far as it goes
    assert result.partial is not None
    assert fails(athlete, dem, result.partial, state) == {"goal"}


def test_strides_that_come_to_the_same_are_tried_once(athlete, monkeypatch):
    """0.4 m are one cycle of 0.4 m, and two both of 0.3 m and of 0.2 m at most."""
    dem = ground(lambda x, y: np.where(x > 1.9, 2.5, 0.0))
    state, laid = footfall.stand(athlete, dem), []
    monkeypatch.setattr(
        gait_plan, "laid_out", lambda *all_of, real=gait_plan.laid_out: laid.append(all_of[2]) or real(*all_of)
    )
    failure_of(footfall.plan_gait(athlete, dem, state, (0.4, 0.0)))
    assert [beat.cycles for beat in laid] == [1, 2]
    assert [math.ceil(0.4 / (share * 0.4) - 1e-9) for share in gait_plan.SHORTER] == [1, 2, 2]


def test_a_foot_that_swings_meets_a_post(athlete, monkeypatch):
    """Before the step all is clear of it, and so is the footfall: only the swing can tell."""
    monkeypatch.setattr(gait_plan, "SHORTER", (1.0,))
    x0, y0 = 1.75, 1.45
    dem = ground(lambda x, y: np.where(np.hypot(x - x0, y - y0) < 0.12, 2.0, 0.0))
    state = footfall.stand(athlete, dem)
    failure = failure_of(footfall.plan_gait(athlete, dem, state, (1.0, 0.0), WAVE, GaitSettings(tolerance=0.0)))
    assert failure.check_name.endswith("and the terrain in swing")
    assert failure.group == (1,)
    assert 0.0 < failure.lacks < 1.0


def test_the_posture_that_fails_stands_on_the_feet_that_stay(athlete, place):
    dem, state = place
    result = footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD, GaitSettings(most_torque=0.3))
    failure = failure_of(result)
    start = start_of(athlete, dem, state)
    assert isinstance(start, At)
    assert failure.T_site_base is not None
    assert failure.posture is not None
    T, stance = failure.T_site_base, start.stance
    if result.partial is not None:
        stance = result.partial.stances[-1]
    stay = [leg for leg in athlete.legs if leg not in failure.group]
    assert stay
    for leg in stay:
        wheel = T @ wheel_pose(athlete, failure.posture, leg)
        np.testing.assert_allclose(wheel, stance.Ts_site_wheel[leg], atol=1e-6)


def test_a_leg_that_does_not_reach_keeps_its_joints(athlete, place):
    dem, state = place
    at = start_of(athlete, dem, state)
    assert isinstance(at, At)
    world = World(athlete, Nearby(dem, np.isnan(dem.heights)), WalkSettings(), at.T_site_base)
    T_site_base = np.array(at.T_site_base)
    T_site_base[2, 3] -= 0.1
    lower = posture_over(world, at, at.stance, T_site_base)
    for leg in athlete.legs:
        wheel = T_site_base @ wheel_pose(athlete, lower, leg)
        np.testing.assert_allclose(wheel, at.stance.Ts_site_wheel[leg], atol=1e-6)
    T_site_base[2, 3] += 9.0
    np.testing.assert_array_equal(posture_over(world, at, at.stance, T_site_base), at.posture)


def test_a_gait_is_as_strict_as_it_is_told_to_be(athlete, place, plans):
    dem, state = place
    worst = float(plans[TRIPOD].torques.max())
    weaker = footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD, GaitSettings(most_torque=0.9 * worst))
    assert weaker.plan is None or weaker.plan.torques.max() <= 0.9 * worst
    little = failure_of(footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD, GaitSettings(most_torque=0.3)))
    assert "torque" in little.check_name
    assert little.unit == "of the limit"
    wide = failure_of(footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD, GaitSettings(least_margin=2.0)))
    assert "balance" in wide.check_name
    for settings in (GaitSettings(reach_reserve=0.5), GaitSettings(joint_reserve=1.5)):
        assert failure_of(footfall.plan_gait(athlete, dem, state, GOAL, TRIPOD, settings)).lacks > 0.0


@pytest.mark.parametrize("farther", [0.0, 0.05, 0.3])
def test_what_a_leg_lacks_of_reach(athlete, farther):
    """A wheel straight below the hip's pitch axis, farther down than thigh and shank are long."""
    dem = ground()
    T = np.eye(4)
    T[2, 3] = 2.0
    settings = WalkSettings(reach_reserve=0.03)
    world = World(athlete, Nearby(dem, np.isfinite(dem.heights)), settings, T)
    spec = athlete.description.legs[2]
    yaw = math.atan2(spec.T_base_hip[1, 0], spec.T_base_hip[0, 0])
    lengths = world.legs.lengths[2]
    out = spec.T_base_hip[:2, 3] + lengths[0] * np.array([math.cos(yaw), math.sin(yaw)])
    # upright wheel: its rim is a foot and a radius below the ankle
    down = lengths[2] + lengths[3] + farther
    z = T[2, 3] + spec.T_base_hip[2, 3] + lengths[1] - down - lengths[4] - athlete.wheel_radius
    wheel = wheel_pose_for_contact(athlete, (*out, z), (0.0, 0.0, 1.0), yaw, np.eye(4))
    lack = leg_lacks(world, T[:3], wheel, 0, 2)
    assert lack is not None
    assert (lack.check, lack.leg, lack.unit) == ("reach", 2, "m")
    assert lack.lacks == pytest.approx(farther + 0.03, abs=1e-6)


def test_misuse(athlete, place):
    dem, state = place
    with pytest.raises(InvalidInput, match="gait is one of"):
        footfall.plan_gait(athlete, dem, state, GOAL, "gallop")
    with pytest.raises(InvalidInput, match="the state is of"):
        footfall.plan_gait(athlete, dem, replace(state, robot="other"), GOAL)
    far = footfall.plan_gait(athlete, dem, state, (99.0, 0.0))
    assert (far.status, far.plan, far.partial) == (Status.GOAL_INVALID, None, None)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stride": 0.09}, "at least 0.1 m"),
        ({"stride": 1e-9}, "at least 0.1 m"),
        ({"stride": math.inf}, "finite"),
        ({"tolerance": 0.76}, "at most 0.75 m"),
        ({"tolerance": 1e6}, "at most 0.75 m"),
        ({"tolerance": math.nan}, "finite"),
    ],
)
def test_no_gait_has_more_steps_or_places_than_can_be_looked_at(change, said):
    with pytest.raises(InvalidInput, match=said):
        GaitSettings(**change)


@pytest.mark.parametrize("goal", [(0.5,), (0.5, 0.0, 0.0, 4.0)])
def test_a_goal_of_numbers_has_two_or_three(athlete, place, goal):
    """A fourth one would be what the goal allows."""
    dem, state = place
    with pytest.raises(InvalidInput, match="x and y"):
        footfall.plan_gait(athlete, dem, state, goal)
