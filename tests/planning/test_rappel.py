"""A walk down a slope of 60° on a tether: it passes by other means, and each break of it is seen."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from benchmarks.walks.rappel import hanging
from benchmarks.walks.terrains import terrain
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tether import Tether
from footfall.balance.torques import torque_check
from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.walk.excerpt import excerpt
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.legs_kernel import pose_of
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import Place, Tethered, WalkGoal, WalkSettings
from footfall.planning.walk.recheck.holding import HoldingCheck, turned
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.stretches import stretches
from footfall.planning.walk.recheck.tethering import Tethering
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.slope_frame import SlopeFrame, slope_between
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk_execution.plan import plan_walk_execution
from footfall.sequence.make import make_sequence
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane
from footfall.terrain.ground.surface import height_at

METRES = 2.75
SHARE = 0.25
"""How far down the way to the goal of the benchmark this walk goes."""
SETTINGS = WalkSettings(smoothing=Smoothing(rounds=0))
COARSE = RecheckSettings(way=0.05, turn=0.05, hold=0.3, watched=0.01)
"""For what a broken walk shows at its waypoints."""


@pytest.fixture(scope="module")
def slope():
    return terrain("rappel", 0, METRES)


@pytest.fixture(scope="module")
def asked(slope):
    tether, begin, end, yaw = hanging(slope, "rappel", METRES)
    x, y = np.array(begin) + SHARE * (np.array(end) - begin)
    return tether, begin, WalkGoal(float(x), float(y), yaw)


@pytest.fixture(scope="module")
def start(athlete, slope, asked):
    tether, (x, y), goal = asked
    return footfall.stand(athlete, slope, x, y, goal.yaw, tether=tether)


@pytest.fixture(scope="module")
def result(athlete, slope, asked, start):
    return plan_walk(athlete, slope, start, asked[2], seed=1, settings=SETTINGS, tether=asked[0])


@pytest.fixture(scope="module")
def walk(result):
    assert result.plan is not None, result.reason
    return result.plan


@pytest.fixture(scope="module")
def piece(walk, start):
    """Its first foot move: enough for what is broken on purpose."""
    return excerpt(walk, 0, 1, replace(start, posture=walk.waypoints[0], T_site_base=walk.Ts_site_base[0]))


def failed(robot, dem, plan):
    """Names of the checks of forces and of the tether that fail; the others are tested on walks without one."""
    holding = HoldingCheck(robot, plan, SETTINGS, COARSE.hold)
    tethering = None if plan.tethered is None else Tethering(robot, dem, plan, plan.tethered)
    for stretch in stretches(robot, plan, COARSE):
        holding.look(stretch, lambda: None)
        if tethering is not None:
            tethering.look(stretch, turned(stretch, COARSE.hold), lambda: None)
    checks = (*holding.checks(), *(tethering.checks() if tethering is not None else ()))
    return {one.name for one in checks if not one.holds}


def changed(plan, **replaced):
    return replace(plan, tethered=replace(plan.tethered, **replaced))


def test_a_walk_down_60_degrees_passes_by_other_means(athlete, slope, walk, start, result):
    checks = {one.name: one for one in recheck_walk(athlete, slope, walk, SETTINGS, COARSE, state=start)}
    assert not [one for one in checks.values() if not one.holds]
    assert {"tether", "tether length", "tether pull"} <= set(checks) & {one.name for one in result.checks}
    assert walk.foot_moves >= 2
    lean = np.degrees(np.arccos(walk.Ts_site_base[:, 2, 2]))
    assert lean.min() > 40
    assert walk.Ts_site_base[-1, 2, 3] < walk.Ts_site_base[0, 2, 3] - 0.3


def test_a_payload_is_held_by_ground_and_tether(athlete, slope, walk, start, asked):
    tether, _, goal = asked
    loaded = replace(SETTINGS, seed=1, payload_mass=100.0, payload_position=np.array([0.2, 0.1, 0.3]))
    found = plan_walk(athlete, slope, start, goal, settings=loaded, tether=tether)
    assert found.plan is not None, found.reason
    assert found.plan.tethered is not None
    checks = {one.name: one for one in recheck_walk(athlete, slope, found.plan, every=COARSE)}
    assert not [one for one in checks.values() if not one.holds]
    # where both begin the drum pulls harder by about the payload's share of the weight
    more = found.plan.tethered.pulls[0] / walk.tethered.pulls[0]
    assert 1.0 < more < 1.0 + 2.0 * 100.0 / athlete.mass
    # the pulls of the bare rover don't hold the loaded one
    assert "torque" in {one.name for one in recheck_walk(athlete, slope, walk, loaded, COARSE) if not one.holds}


def test_what_is_paid_out_is_the_tethers_way(walk, asked):
    tether = asked[0]
    out = walk.paid_out
    assert out.shape == (walk.foot_moves + 1,)
    ends = tether.lengths(walk.Ts_site_base[[0, -1]])
    assert out.sum() == pytest.approx(ends[1] - ends[0])
    assert out.sum() > 0.3
    for move in range(walk.foot_moves):
        last = np.flatnonzero(walk.moves == move)[-1]
        assert out[: move + 1].sum() == pytest.approx(walk.tethered.lengths[last] - walk.tethered.lengths[0])


def test_without_the_tether_nothing_holds(athlete, slope, walk, piece):
    assert not failed(athlete, slope, piece)
    assert "friction" in failed(athlete, slope, replace(piece, tethered=None))
    feet, normals = range(6), walk.stances[0].normals
    without = torque_check(athlete, walk.waypoints[0], walk.Ts_site_base[0], feet, normals, BalanceSettings())
    assert not without.feasible


@pytest.mark.parametrize(
    ("change", "seen"),
    [
        (lambda one: {"lengths": np.asarray(one.lengths) + 0.05}, "tether length"),
        (lambda one: {"tether": replace(one.tether, free_length=float(one.lengths.max()) - 0.02)}, "tether length"),
        (lambda one: {"pulls": np.full_like(one.pulls, one.tether.most_force + 100.0)}, "tether pull"),
        (lambda one: {"pulls": np.full_like(one.pulls, -10.0)}, "tether pull"),
        (lambda one: {"pulls": np.zeros_like(one.pulls)}, "torque"),
        (lambda one: {"tether": replace(one.tether, most_force=3000.0)}, "friction"),
        (lambda one: {"tether": replace(one.tether, attachment=np.array([-2.1, 0.0, -0.6]))}, "tether"),
        (lambda one: {"tether": replace(one.tether, attachment=np.array([1.05, -0.615, -0.1]))}, "tether"),
    ],
)
def test_each_break_is_seen(athlete, slope, piece, change, seen):
    assert seen in failed(athlete, slope, changed(piece, **change(piece.tethered)))


def test_a_rock_in_the_tethers_way_is_seen(athlete, slope, piece, asked):
    tether = asked[0]
    end = piece.Ts_site_base[-1, :3, :3] @ tether.attachment + piece.Ts_site_base[-1, :3, 3]
    x, y, _ = tether.anchor + 0.45 * (end - tether.anchor)
    heights = np.array(slope.heights)
    near = np.hypot(slope.geometry.xs - x, (slope.geometry.ys - y)[:, None]) < 0.15
    heights[near] += 2.5
    rocky = Dem(heights, slope.geometry, "rocky", slope.provenance)
    assert "tether" in failed(athlete, rocky, piece)


def test_an_anchor_out_of_reach_is_refused_with_its_size(athlete, slope, start, asked):
    short = replace(asked[0], free_length=1.0)
    answer = plan_walk(athlete, slope, start, asked[2], settings=SETTINGS, tether=short)
    assert answer.status is Status.START_INVALID
    assert "1 m long" in answer.reason


def test_a_part_of_the_walk_keeps_its_tether_and_no_command_drives_the_drum(athlete, slope, walk, start, asked):
    state = replace(start, posture=walk.waypoints[0], T_site_base=walk.Ts_site_base[0])
    part = excerpt(walk, 0, 1, state)
    assert part.tethered is not None
    assert part.paid_out[0] == pytest.approx(walk.paid_out[0])
    sequence = make_sequence(walk, athlete)
    assert not sequence.valid
    (rule,) = [one for one in sequence.failures if one.rule == "tether"]
    assert f"{walk.paid_out[0]:.3f}" in rule.text
    with pytest.raises(InvalidInput, match="tether is not executed"):
        plan_walk_execution(athlete, slope, start, walk)


def test_a_walk_on_even_ground_needs_no_turning(athlete):
    """The frame is that of the site there, and the tether hangs beside: polygons and goal are as without it."""
    dem = plane((14.0, 10.0), 0.1)
    frame = slope_between(dem, np.zeros(2), np.ones(2), 2.0, np.zeros(3))
    assert frame.steep == 0.0
    assert frame.ground is dem
    assert np.array_equal(frame.R_site_slope, np.eye(3))


@given(st.floats(-3.0, 3.0), st.floats(0.3, 1.3), st.floats(-3.0, 3.0))
def test_headings_and_places_turn_there_and_back(downhill, steep, yaw):
    """A heading of the slope has the azimuth that was asked for, and a plane's frame is found from its heights."""
    dem = plane((12.0, 12.0), 0.2)
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    heights = -np.tan(steep) * (np.cos(downhill) * x + np.sin(downhill) * y)
    ground = Dem(heights.astype(np.float32), dem.geometry, "plane", dem.provenance)
    found = slope_between(ground, np.zeros(2), np.zeros(2), 3.0, np.zeros(3))
    assert found.steep == pytest.approx(steep, abs=1e-4)
    assert np.cos(found.downhill - downhill) == pytest.approx(1.0, abs=1e-6)
    R = found.R_site_slope
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.allclose(R[:, 2] @ [np.cos(downhill), np.sin(downhill), -np.tan(steep)], 0.0, atol=1e-3)
    # against gravity in the slope's frame, as balance has it
    settings = Hung(found, Tether(np.ones(3), np.zeros(3))).balance(BalanceSettings(friction=0.6))
    assert np.allclose(settings.R_level_site, R, atol=1e-9)
    goal = WalkGoal(0.3, -0.2, yaw, within=0.01, turned=0.01)
    hung = Hung(found, Tether(np.ones(3), np.zeros(3)), goal)
    at = found.on_slope(goal.x, goal.y, 1.2)
    vector = np.array([*at, 0.0, 0.0, hung.heading(yaw)])
    assert hung.is_at_goal(vector)
    assert not hung.is_at_goal(vector + np.array([0, 0, 0, 0, 0, 0.2]))
    T = np.empty((3, 4))
    pose_of(vector, T)
    site = found.poses_to_site(np.vstack([T, (0, 0, 0, 1)]))
    assert np.allclose(found.poses_to_slope(site)[:3], T)
    assert np.allclose(site[:2, 3], [goal.x, goal.y])


def test_turned_ground_is_the_sites(slope):
    frame = SlopeFrame(np.radians(60.0), 0.0, slope)
    ground = frame.ground
    rows, cols = np.nonzero(np.isfinite(ground.heights))
    chosen = np.random.default_rng(0).choice(len(rows), 400, replace=False)
    x, y = ground.geometry.xs[cols[chosen]], ground.geometry.ys[rows[chosen]]
    at = frame.to_site(np.column_stack([x, y, ground.heights[rows[chosen], cols[chosen]].astype(float)]))
    off = at[:, 2] - height_at(slope, at[:, 0], at[:, 1])
    off = off[np.isfinite(off)]
    assert len(off) > 350
    # vertical in site; across the slope it is half of that
    assert np.percentile(np.abs(off), 95) < 0.02
    assert frame.off < 0.02


def test_of_a_large_map_only_what_a_walk_may_need_is_turned():
    """A slope of 300 m in cells of 0.25 m turns into more cells of 5 cm than a map may have."""
    dem = plane((300.0, 300.0), 0.25)
    x, _ = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    ground = Dem((-np.tan(0.8) * x).astype(np.float32), dem.geometry, "plane", dem.provenance)
    here, there, anchor = np.array([40.0, 10.0]), np.array([42.0, 11.0]), np.array([37.0, 10.0, -30.0])
    frame = slope_between(ground, here, there, 3.0, anchor)
    assert frame.steep == pytest.approx(0.8, abs=1e-4)
    assert frame.ground.heights.size < 4_000_000
    for x, y in (here, there, anchor[:2], here + 15.0, there - 15.0):
        at = frame.to_slope(np.array([x, y, float(height_at(ground, x, y))]))
        assert float(height_at(frame.ground, at[0], at[1])) == pytest.approx(at[2], abs=0.02)
    # far from all known ground there is none to turn, and the answer is that of the whole map
    assert slope_between(ground, here + 900.0, here + 901.0, 3.0, here + 900.0).ground is ground


def test_a_tethered_walk_says_what_it_must():
    tether = Tether(np.ones(3), np.zeros(3))
    with pytest.raises(InvalidInput, match="length 1"):
        Tethered(tether, np.zeros(3), np.zeros(2), np.zeros(2))
    with pytest.raises(InvalidInput, match="length and a pull"):
        Tethered(tether, np.array([0.0, 0.0, 1.0]), np.zeros(2), np.zeros(3))


def test_forbidden_ground_is_that_seen_from_above(athlete, slope, asked, start, walk):
    """Along a slope of 60° it reaches twice as far."""
    tether, _, goal = asked
    for leg, stance in list(zip(walk.legs, walk.stances[1:], strict=True))[:3]:
        x, y = (float(one) for one in stance.contacts[leg, :2])
        settings = replace(SETTINGS, forbidden=(Place(x, y, 0.3),))
        found = plan_walk(athlete, slope, start, goal, seed=1, settings=settings, tether=tether)
        assert found.plan is not None, found.reason
        put = zip(found.plan.legs, found.plan.stances[1:], strict=True)
        assert min(np.hypot(*(after.contacts[moved, :2] - (x, y))) for moved, after in put) > 0.3


def test_ground_that_nobody_knows_may_be_forbidden_and_not_pinned(athlete, slope, asked, start):
    tether, _, goal = asked
    west, south, *_ = slope.geometry.bounds
    nowhere = Place(west - 5.0, south - 5.0)
    settings = replace(SETTINGS, forbidden=(nowhere,))
    assert plan_walk(athlete, slope, start, goal, seed=1, settings=settings, tether=tether).plan is not None
    settings = replace(SETTINGS, pinned=(nowhere,))
    found = plan_walk(athlete, slope, start, goal, seed=1, settings=settings, tether=tether)
    assert found.status is Status.GOAL_INVALID
    assert f"the pinned place ({nowhere.x:g}, {nowhere.y:g}): the ground there is unknown" in found.reason
