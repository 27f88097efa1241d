"""One map against a later one: in doubt a cell has changed, and nothing else has."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.lattice import laid_onto
from footfall.terrain.ground import changed
from footfall.terrain.ground.changed import DEVIATIONS, OTHER_HEIGHT, SAME_HEIGHT, ground_change
from footfall.terrain.ground.resample import resample

GRID = GridGeometry(-1.0, -0.6, 0.1, 13, 21)
ROW, COL = 6, 9


def ground(variance=None, seed=1):
    heights = np.random.default_rng(seed).uniform(-0.1, 0.1, GRID.shape).astype(np.float32)
    spread = None if variance is None else np.full(GRID.shape, variance, np.float32)
    return Dem(heights, GRID, "ground", Provenance({}), variance=spread)


def otherwise(dem, cells, by):
    heights = dem.heights.copy()
    heights[cells] += by
    return replace(dem, heights=heights)


def compared(one, other):
    """What changed, of two maps that can be compared."""
    change = ground_change(one, other)
    assert change is not None
    return change


def on_first(change):
    """The changed cells on the grid of the first map."""
    return laid_onto(GRID, change.cells, change.geometry, False)


@given(st.floats(1e-7, 4e-4), st.floats(1e-7, 4e-4), st.floats(-0.06, 0.06))
def test_a_height_is_the_same_within_what_is_stated_of_both_and_never_beyond_what_a_wheel_cuts_in(before, now, by):
    limit = min(max(DEVIATIONS * np.hypot(before**0.5, now**0.5), SAME_HEIGHT), OTHER_HEIGHT)
    if abs(abs(by) - limit) < 1e-6:
        return
    dem = ground(before)
    later = replace(otherwise(dem, (ROW, COL), by), variance=np.full(GRID.shape, now, np.float32))
    expected = np.zeros(GRID.shape, bool)
    expected[ROW, COL] = abs(by) > limit
    assert np.array_equal(on_first(compared(dem, later)), expected)


@pytest.mark.parametrize(("by", "counts"), [(0.9, False), (1.1, True), (-1.1, True)])
def test_where_nothing_is_stated_the_least_holds(by, counts):
    change = compared(ground(), otherwise(ground(4e-4), (ROW, COL), by * SAME_HEIGHT))
    assert on_first(change).any() == counts


def test_what_only_tells_of_the_looking_changes_nothing():
    dem = ground(1e-5)
    other = replace(dem, name="again", texture=np.full(GRID.shape, 9, np.uint8), provenance=Provenance({"a": "b"}))
    assert other.digest != dem.digest
    assert not compared(dem, other).cells.any()


def test_ground_that_appears_or_goes_has_changed_and_so_has_unseen_ground_that_is_as_high_as_it():
    whole = ground()
    holed = whole.heights.copy()
    hole = np.s_[5:8, 8:12]
    holed[hole] = np.nan
    before = replace(whole, heights=holed)
    for one, other in ((whole, before), (before, whole)):
        change = compared(one, other)
        assert np.array_equal(on_first(change), np.isnan(holed))
        assert np.array_equal(change.cells, change.flipped)
    # a rim that rises lifts the hole beside it
    change = compared(before, otherwise(before, (4, 8), 1.0))
    assert on_first(change)[4, 8]
    assert on_first(change)[hole].any()
    assert not change.flipped.any()
    assert change.by.max() == pytest.approx(1.0, abs=1e-6)


def test_a_map_that_grows_says_where():
    dem = ground()
    grown = GridGeometry(GRID.x0 - 0.3, GRID.y0, GRID.resolution, GRID.rows, GRID.cols + 3)
    heights = np.concatenate([np.zeros((GRID.rows, 3), np.float32), dem.heights], axis=1)
    change = compared(dem, Dem(heights, grown, "grown", Provenance({})))
    assert not on_first(change).any()
    assert laid_onto(grown, change.flipped, change.geometry, False)[:, :3].all()


def test_other_cells_are_not_compared(monkeypatch):
    dem = ground()
    assert ground_change(dem, resample(dem, 0.05)) is None
    assert ground_change(dem, replace(dem, geometry=replace(GRID, x0=GRID.x0 + 0.04))) is None
    monkeypatch.setattr(changed, "MOST_COMPARED", 1000)
    assert ground_change(dem, dem) is None


@given(st.lists(st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(0.0, 2.0)), max_size=4), st.integers(0, 99))
def test_what_lies_in_discs_is_found_as_by_asking_every_cell(discs, seed):
    dem = ground()
    later = otherwise(dem, np.random.default_rng(seed).random(GRID.shape) < 0.1, 0.5)
    change = compared(dem, later)
    grid = change.geometry
    asked = np.array(discs).reshape(-1, 3)
    within = change.within(asked)
    nearest = np.full(grid.shape, np.inf)
    for x, y, radius in asked:
        nearest = np.minimum(nearest, np.linalg.norm(grid.centers() - (x, y), axis=-1).reshape(grid.shape) - radius)
    assert np.array_equal(within | (nearest > 0.0), change.cells | (nearest > 0.0))
    assert not within[nearest > 2.0 * grid.resolution].any()
    assert np.array_equal(change.within(None), change.cells)
