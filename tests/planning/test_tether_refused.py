"""What speaks against a walk on a tether before any search: each with its size, none where nothing does."""

import re
from dataclasses import replace

import numpy as np
import pytest

import footfall
from benchmarks.walks.rappel import hanging
from benchmarks.walks.terrains import terrain
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tether import Tether
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.planning.answers import Status
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk.start import start_of
from footfall.planning.walk.tether_ground import LOOKED_AT, unknown_under
from footfall.planning.walk.tether_refused import NEARER, SUNK, anchor_refused, goal_refused, hold_refused
from footfall.terrain.ground.surface import height_at
from footfall.terrain.rocks import add_rocks
from tests.support.chassis_ground import wavy

ATTACHMENT = np.array([-1.05, 0.615, -0.1])
TETHER = Tether(np.array([-3.2, 1.9, 2.0]), ATTACHMENT)
NEAR = WalkGoal(0.4, 0.1, 0.0)
BALANCE = BalanceSettings(friction=0.6)
SETTINGS = WalkSettings(seed=1, smoothing=Smoothing(rounds=0))


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def state(athlete, ground):
    return footfall.stand(athlete, ground)


def answer(robot, dem, state, tether, goal=NEAR):
    return plan_walk(robot, dem, state, goal, settings=SETTINGS, tether=tether)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"anchor": np.array([-3.2, 1.9, -0.5])}, r"is 0\.\d\d m below the ground, which is -?0\.\d\d m high there"),
        ({"anchor": np.array([-14.0, 1.9, 2.0])}, r"lies 10 m off the map"),
        ({"anchor": np.array([-904.0, 1.9, 2.0])}, r"lies 900 m off the map"),
        ({"free_length": 2.0}, r"is 2 m long, its anchor \d\.\d\d m away"),
        ({"anchor": np.array([3.2, -1.9, 2.0])}, r"goes through the chassis"),
    ],
)
def test_a_tether_that_can_not_be_so_is_refused(athlete, ground, state, change, said):
    found = answer(athlete, ground, state, replace(TETHER, **change))
    assert (found.status, found.plan) == (Status.START_INVALID, None)
    assert re.search(said, found.reason), found.reason


def test_where_nothing_speaks_against_it_the_walk_is_found(athlete, ground, state):
    found = answer(athlete, ground, state, TETHER)
    assert found.status is Status.FOUND, found.reason
    low = replace(TETHER, anchor=np.array([-3.2, 1.9, float(height_at(ground, -3.2, 1.9))]))
    assert anchor_refused(ground, state.T_site_base, low) == ""


def test_an_anchor_on_ground_that_nobody_knows_is_refused(ground, state):
    heights = np.array(ground.heights)
    x, y = np.moveaxis(ground.geometry.centers(), -1, 0)
    heights[np.hypot(x + 3.2, y - 1.9) < 0.3] = np.nan
    told = anchor_refused(replace(ground, heights=heights), state.T_site_base, TETHER)
    assert "nothing is known of the ground" in told


def unseen(dem, x, y, radius):
    heights = np.array(dem.heights)
    at = dem.geometry.centers()
    heights[np.hypot(at[..., 0] - x, at[..., 1] - y) < radius] = np.nan
    return replace(dem, heights=heights)


def test_a_walk_whose_tether_goes_over_ground_that_nobody_knows_says_so(athlete, ground, state):
    end = apply(state.T_site_base, ATTACHMENT)
    x, y, _ = 0.5 * (TETHER.anchor + end)
    [known, unknown] = [answer(athlete, dem, state, TETHER) for dem in (ground, unseen(ground, x, y, 0.15))]
    assert (known.status, unknown.status) == (Status.FOUND, Status.FOUND), unknown.reason
    assert "unknown ground under the tether" not in [one.name for one in known.checks]
    [told] = [one for one in unknown.checks if one.name == "unknown ground under the tether"]
    assert told.holds
    assert "highest known neighbour" in told.where


def test_how_much_of_the_ground_under_a_tether_is_unknown_agrees_with_a_walk_along_it(ground, state):
    """Holes of many sizes, at many places; every millimetre looked at."""
    rng, seen = np.random.default_rng(6), set()
    end = apply(state.T_site_base, ATTACHMENT)
    toward = (end - TETHER.anchor) / np.linalg.norm(end - TETHER.anchor)
    fine = TETHER.anchor + np.arange(0.0, np.linalg.norm(end - TETHER.anchor), 0.001)[:, None] * toward
    for _ in range(40):
        x, y = fine[rng.integers(len(fine)), :2] + rng.normal(0.0, 0.2, 2)
        dem = unseen(ground, x, y, rng.uniform(0.05, 0.5))
        holes = ~np.isfinite(height_at(dem, fine[:, 0], fine[:, 1]))
        by_anchor = np.arange(len(fine)) < 1000.0 * TETHER.bare
        found = unknown_under(dem, TETHER, state.T_site_base[None])
        share = holes[~by_anchor].mean()
        shares = [float(one) / 100.0 for check in found for one in re.findall(r"(\d+\.\d)%", check.where)]
        told = sum(shares)
        assert told == pytest.approx(share, abs=2.0 * LOOKED_AT / (len(fine[~by_anchor]) * 0.001))
        seen.add(bool(found))
    assert seen == {True, False}


def test_the_ground_is_looked_at_up_to_an_anchor_that_is_far_away(athlete):
    wide = wavy(half=16.0, resolution=0.2)
    far = replace(TETHER, anchor=np.array([-13.0, 7.6, 4.0]))
    found = answer(athlete, wide, footfall.stand(athlete, wide), far)
    assert found.plan is not None, found.reason
    assert found.plan.tethered is not None
    assert found.plan.tethered.lengths.min() > 12.0


def test_an_anchor_at_the_attachment_has_no_direction(athlete, ground, state):
    reason = anchor_refused(ground, state.T_site_base, replace(TETHER, anchor=apply(state.T_site_base, ATTACHMENT)))
    assert "has no direction" in reason


@pytest.mark.parametrize("size", [{"clearance": 1.5}, {"clearance": np.inf}, {"anchor": np.array([0.0, np.nan, 1.0])}])
def test_what_is_no_tether_is_misuse(size):
    with pytest.raises(InvalidInput):
        replace(TETHER, **size)


def test_how_deep_it_is_in_the_ground_agrees_with_a_walk_along_it(ground, state):
    """Domes of many heights in its way, each judged by looking at every millimetre."""
    end, anchor = apply(state.T_site_base, ATTACHMENT), np.array([-3.6, 2.1, 0.3])
    tether = replace(TETHER, anchor=anchor)
    toward = (end - anchor) / np.linalg.norm(end - anchor)
    fine = anchor + np.arange(tether.bare, np.linalg.norm(end - anchor), 0.001)[:, None] * toward
    x, y, z = 0.5 * (anchor + end)
    seen = set()
    for height in np.arange(z - 0.4, z + 0.4, 0.05):
        rocky = add_rocks(ground, np.array([[x, y, 0.8, height]]))
        deep = float((height_at(rocky, fine[:, 0], fine[:, 1]) - fine[:, 2]).max())
        reason = anchor_refused(rocky, state.T_site_base, tether)
        if abs(deep - SUNK) > 0.01:
            assert bool(reason) == (deep > SUNK), (height, deep, reason)
            seen.add(bool(reason))
        if reason:
            told = re.search(r"(\d\.\d\d) m deep", reason)
            assert told is not None, reason
            assert float(told[1]) == pytest.approx(deep, abs=0.02)
    assert seen == {True, False}


@pytest.fixture(scope="module")
def steep():
    return terrain("rappel", 0, 2.75)


@pytest.fixture(scope="module")
def hangs(athlete, steep):
    """Its tether, how the rover stands on it, and the goal 2.75 m down."""
    tether, (x, y), end, yaw = hanging(steep, "rappel", 2.75)
    return tether, footfall.stand(athlete, steep, x, y, yaw, tether=tether), WalkGoal(end[0], end[1], yaw)


def test_a_tether_that_does_not_reach_the_goal_is_refused_before_any_search(athlete, steep, hangs):
    tether, state, goal = hangs
    length = float(tether.lengths(state.T_site_base[None])[0])
    found = answer(athlete, steep, state, replace(tether, free_length=length + 0.05), goal)
    assert found.status is Status.GOAL_INVALID
    told = re.search(r"goal is (\d+\.\d\d) m from its anchor, where at least (\d+\.\d\d) m", found.reason)
    assert told is not None, found.reason
    assert float(told[1]) > float(told[2]) > length + 0.05


def test_what_is_refused_for_its_length_reaches_no_chassis_at_the_goal():
    rng, seen = np.random.default_rng(4), set()
    for _ in range(200):
        at, anchor = rng.uniform(-1, 1, 3), rng.uniform(-8, 8, 3)
        tether = replace(TETHER, anchor=anchor, free_length=float(rng.uniform(1.0, 8.0)))
        refused = bool(goal_refused(tether, WalkGoal(0.0, 0.0, within=0.2), at))
        seen.add(refused)
        if not refused:
            continue
        Ts = np.array([transform(rotation_rpy(*rng.uniform(-3, 3, 3)), at) for _ in range(50)])
        offset = rng.normal(size=(50, 3))
        Ts[:, :3, 3] += (0.2 + NEARER) * offset / np.linalg.norm(offset, axis=1, keepdims=True)
        assert tether.lengths(Ts).min() > tether.free_length
    assert seen == {True, False}


def test_a_drum_that_is_too_weak_is_told_what_would_do(athlete, steep, hangs):
    tether, state, _ = hangs
    start = start_of(athlete, steep, state)
    assert not isinstance(start, str), start
    assert hold_refused(athlete, start, BALANCE, tether) == ""
    reason = hold_refused(athlete, start, BALANCE, replace(tether, most_force=500.0))
    told = re.search(r"(\d+) N are needed", reason)
    assert told is not None, reason
    needed = float(told[1])
    assert hold_refused(athlete, start, BALANCE, replace(tether, most_force=needed)) == ""
    assert "N are needed" in hold_refused(athlete, start, BALANCE, replace(tether, most_force=needed - 20.0))
    # along the slope its weight pulls with m·g·sin, of which friction bears at most its share of m·g·cos
    weight = athlete.mass * 9.81
    assert needed > 0.5 * weight * (np.sin(np.radians(60)) - 0.6 * np.cos(np.radians(60)))
    loaded = []
    for mass in (0.0, 100.0, 300.0):
        reason = hold_refused(athlete, start, replace(BALANCE, payload_mass=mass), replace(tether, most_force=500.0))
        told = re.search(r"(\d+) N are needed", reason)
        assert told is not None, reason
        loaded.append(float(told[1]))
    assert loaded[0] == needed
    assert np.diff(loaded).min() > 0.5 * 100.0 * 9.81 * (np.sin(np.radians(60)) - 0.6 * np.cos(np.radians(60)))
    below = replace(tether, anchor=2 * np.array(state.T_site_base[:3, 3]) - tether.anchor)
    assert "more would not do" in hold_refused(athlete, start, BALANCE, below)
