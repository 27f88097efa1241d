"""The ground where feet stand: the map goes onto them, stays as it is elsewhere, and says nothing where they don't."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.legged.footing import rest
from footfall.planning.legged.measured import measured_at_rest, standing_state
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.under_feet import FADES, MOST_OFF, from_map, ground_told, ground_under
from footfall.robot.legged.posture import placed
from footfall.sequence.of_legged import make_legged_sequence
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, slope
from tests.support.described import robot_of

WORLD = fractal(3.0, 0.02, roughness=0.015, seed=5)


@pytest.fixture(scope="module")
def robot():
    return robot_of(6)[1]


@pytest.fixture(scope="module")
def state(robot):
    return measured_at_rest(robot, WORLD)


def soles_of(robot, state) -> np.ndarray:
    where = placed(robot, state.posture).soles
    return where @ state.T_site_base[:3, :3].T + state.T_site_base[:3, 3]


def changed(dem: Dem, heights: np.ndarray) -> Dem:
    return Dem(heights.astype(np.float32), dem.geometry, dem.name, Provenance({}))


def away_from(dem: Dem, places: np.ndarray) -> np.ndarray:
    """Distance of each cell to the nearest of the places, (rows, cols) [m]."""
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    return np.min([np.hypot(x - px, y - py) for px, py, _ in places], axis=0)


def unseen_below(robot, state, reach: float = 0.06) -> Dem:
    """What cameras on the chassis leave unknown: the ground around the feet."""
    holes = away_from(WORLD, soles_of(robot, state)) < reach
    return changed(WORLD, np.where(holes, np.nan, WORLD.heights))


def test_ground_that_fits_is_left_as_it_is(robot, state):
    assert ground_told(robot, WORLD, state) is WORLD


@settings(max_examples=20)
@given(offs=st.lists(st.floats(-0.03, 0.03), min_size=6, max_size=6))
def test_the_map_goes_onto_the_feet_and_stays_elsewhere(robot, state, offs):
    soles = soles_of(robot, state)
    nearest = np.argmin(
        [np.hypot(*np.meshgrid(WORLD.geometry.xs - x, WORLD.geometry.ys - y)) for x, y, _ in soles], axis=0
    )
    ground = changed(WORLD, WORLD.heights + np.array(offs)[nearest])
    told = ground_told(robot, ground, state)
    for leg in robot.legs:
        x, y, z = soles[leg]
        found = rest(told, x, y, robot.radii[leg]).center[2]
        # a foot within 2 mm of its ground is left to the check of the start
        assert abs(found - z) <= (1e-6 if abs(offs[leg]) > 0.0021 else 0.0041)
    far = away_from(WORLD, soles) > 2 * robot.radii.max() + 2 * 0.02 + FADES * robot.length + 1e-6
    np.testing.assert_array_equal(told.heights[far], ground.heights[far])
    assert np.abs(told.heights - ground.heights).max() < max(map(abs, offs)) + 0.005


def test_unknown_ground_under_feet_goes_on_as_around_them(robot, state):
    seen = unseen_below(robot, state)
    told = ground_told(robot, seen, state)
    near = away_from(WORLD, soles_of(robot, state)) < 0.06
    assert np.isfinite(told.heights[near]).all()
    np.testing.assert_allclose(told.heights[near], WORLD.heights[near], atol=0.012)
    start = standing_state(robot, told, state)
    truly = standing_state(robot, WORLD, state)
    np.testing.assert_allclose(start.contacts, truly.contacts, atol=0.004)
    assert np.isnan(standing_state(robot, seen, state).contacts).all()
    # as steep as the ground around
    hill = slope(3.0, 0.02, angle=0.25)
    stands = measured_at_rest(robot, hill)
    holes = away_from(hill, soles_of(robot, stands)) < 0.06
    seen = changed(hill, np.where(holes, np.nan, hill.heights))
    found = standing_state(robot, ground_told(robot, seen, stands), stands)
    np.testing.assert_allclose(found.normals, standing_state(robot, hill, stands).normals, atol=1e-3)


def test_what_was_taken_for_ground_beside_a_foot_counts_for_little(robot, state):
    seen = unseen_below(robot, state)
    heights = seen.heights.copy()
    rows, cols = np.nonzero(np.isfinite(heights) & (away_from(WORLD, soles_of(robot, state)) < 0.09))
    heights[rows[::4], cols[::4]] += 0.05
    found = standing_state(robot, ground_told(robot, changed(seen, heights), state), state)
    truly = standing_state(robot, WORLD, state)
    assert np.arccos(np.clip((found.normals * truly.normals).sum(axis=1), -1, 1)).max() < 0.15


def test_a_foot_that_bears_nothing_and_one_that_is_far_off_say_nothing(robot, state):
    soles = soles_of(robot, state)
    one = np.hypot(*np.meshgrid(WORLD.geometry.xs - soles[2, 0], WORLD.geometry.ys - soles[2, 1])) < 0.1
    lower = changed(WORLD, np.where(one, WORLD.heights - 0.02, WORLD.heights))
    in_air = replace(state, wheel_forces=np.where(np.arange(6)[:, None] == 2, 0.0, state.wheel_forces))
    assert ground_told(robot, lower, in_air) is lower
    assert ground_told(robot, lower, state) is not lower
    off = MOST_OFF * robot.length + 0.01
    deeper = changed(WORLD, np.where(one, WORLD.heights - off, WORLD.heights))
    told = ground_told(robot, deeper, state)
    assert rest(told, soles[2, 0], soles[2, 1], robot.radii[2]).center[2] < soles[2, 2] - 0.9 * off
    refused = plan_step(robot, told, standing_state(robot, told, state), 1, (soles[1, 0] + 0.02, soles[1, 1] + 0.02))
    assert refused.status is Status.START_INVALID
    assert "off the ground" in refused.reason


def test_nothing_is_said_off_the_map(robot, state):
    far = replace(state, T_site_base=state.T_site_base + np.array([[0, 0, 0, 50.0], *[[0, 0, 0, 0.0]] * 3]))
    assert np.isnan(standing_state(robot, ground_told(robot, WORLD, far), far).contacts).all()


def test_a_step_over_ground_that_the_feet_hide_is_planned_and_commanded(robot, state):
    seen = unseen_below(robot, state, reach=0.05)
    soles = soles_of(robot, state)
    target = tuple(soles[1, :2] + (0.09, 0.04))
    without = plan_step(robot, seen, standing_state(robot, seen, state), 1, target)
    assert without.status is Status.START_INVALID
    told = ground_told(robot, seen, state)
    found = plan_step(robot, told, standing_state(robot, told, state), 1, target)
    assert found.plan is not None, found.reason
    sequence = make_legged_sequence(found.plan, robot, seen)
    assert sequence.valid, sequence.failures
    assert sequence.provenance.parents["dem"] == seen.digest
    # on the ground that is really there it comes to stand at the same places
    truly = make_legged_sequence(found.plan, robot, WORLD)
    np.testing.assert_allclose(sequence.predicted[-1], truly.predicted[-1], atol=1e-9)
    np.testing.assert_allclose(sequence.poses[-1], truly.poses[-1], atol=3e-3)


def test_bodies_are_held_over_ground_that_nobody_saw(robot, state):
    """It may be as high as the highest beside it: rock at the rim of a hole refuses a chassis over the hole."""
    soles = soles_of(robot, state)
    x, y = np.meshgrid(WORLD.geometry.xs, WORLD.geometry.ys)
    hole = np.hypot(x, y) < 0.08
    seen = changed(WORLD, np.where(hole, np.nan, WORLD.heights))
    target = tuple(soles[1, :2] + (0.03, 0.02))
    start = standing_state(robot, seen, state)
    found = plan_step(robot, seen, start, 1, target)
    assert found.status is Status.FOUND
    assert found.unchecked == ("ground that nobody saw: taken to be as high as the highest known beside it",)
    assert plan_step(robot, WORLD, start, 1, target).unchecked == ()
    rim = (np.hypot(x, y) >= 0.08) & (np.hypot(x, y) < 0.1) & (x > 0)
    rock = changed(seen, np.where(rim, state.T_site_base[2, 3] - 0.035, seen.heights))
    refused = plan_step(robot, rock, start, 1, target)
    assert refused.status is Status.START_INVALID
    assert "ground" in refused.reason
    low = changed(seen, np.where(rim, state.T_site_base[2, 3] - 0.1, seen.heights))
    assert plan_step(robot, low, start, 1, target).status is Status.FOUND


def test_the_map_is_told_as_the_parent():
    ground, dem = from_heights(np.zeros((3, 3)), 1.0), from_heights(np.ones((3, 3)), 1.0)
    told = from_map(Provenance({"robot": "r", "terrain": ground.digest}), ground, dem)
    assert told.parents == {"robot": "r", "terrain": dem.digest}


def test_the_ground_under_a_plan_is_that_under_its_state(robot, state):
    seen = unseen_below(robot, state)
    by_state = ground_told(robot, seen, state)
    by_plan = ground_under(robot, seen, standing_state(robot, by_state, state).soles, robot.legs)
    np.testing.assert_array_equal(by_state.heights, by_plan.heights)
