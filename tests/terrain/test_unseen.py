"""Unknown ground is filled ring by ring from what is known, beyond the map's edge too, and never lower than that."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter

from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.unseen import FOOT_DISC, without_holes

NOBODY = np.zeros((0, 3))


@st.composite
def grounds(draw) -> Dem:
    """Small maps, up to nearly all of which is unknown."""
    rows, cols = draw(st.integers(2, 12)), draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    heights = rng.uniform(-3.0, 3.0, (rows, cols)).astype(np.float32)
    heights[rng.random((rows, cols)) < draw(st.floats(0.0, 0.97))] = np.nan
    heights[rng.integers(rows), rng.integers(cols)] = 0.25
    return from_heights(heights, 0.1)


def ringwise(heights: np.ndarray) -> np.ndarray:
    """A second method: another library's filter, which knows of no border."""
    filled = heights.astype(float)
    while np.isnan(filled).any():
        around = maximum_filter(np.where(np.isnan(filled), -np.inf, filled), size=3, mode="constant", cval=-np.inf)
        filled = np.where(np.isnan(filled) & np.isfinite(around), around, filled)
    return filled


@given(dem=grounds(), x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), radius=st.floats(0.1, 2.5))
def test_every_cell_is_as_high_as_its_highest_known_neighbour(dem, x, y, radius):
    found = without_holes(dem, np.array([x, y]), radius, NOBODY)
    grid = dem.geometry
    known = np.isfinite(dem.heights)
    near_x = (grid.xs >= x - radius - grid.resolution) & (grid.xs <= x + radius + grid.resolution)
    near_y = (grid.ys >= y - radius - grid.resolution) & (grid.ys <= y + radius + grid.resolution)
    if found is None:
        assert not (known & (np.abs(grid.xs - x) < radius) & (np.abs(grid.ys - y) < radius)[:, None]).any()
        return
    whole = found.dem.geometry
    assert whole.xs[0] <= x - radius + 1e-9
    assert whole.xs[-1] >= x + radius - 1e-9
    assert whole.ys[0] <= y - radius + 1e-9
    assert whole.ys[-1] >= y + radius - 1e-9
    assert np.array_equal(found.dem.heights, ringwise(np.where(found.filled, np.nan, found.dem.heights)))
    lowest, highest = np.nanmin(dem.heights), np.nanmax(dem.heights)
    assert lowest <= found.dem.heights.min() <= found.dem.heights.max() <= highest
    # what was known stays, and all of it that is near is there
    kept = np.sort(found.dem.heights[~found.filled])
    assert np.isin(kept, dem.heights[known]).all()
    assert len(kept) >= np.isfinite(dem.heights[np.ix_(near_y, near_x)][1:-1, 1:-1]).sum()


@pytest.mark.parametrize("share", [(1.0, 0.5), (0.0, 0.5), (0.5, 1.0), (1.0, 0.0)])
def test_beyond_the_edge_the_ground_goes_on_as_high_as_the_edge(share):
    dem = from_heights(np.full((60, 60), 0.4, np.float32), 0.1)
    west, south, east, north = dem.geometry.bounds
    edge = np.array([west + share[0] * (east - west), south + share[1] * (north - south)])
    found = without_holes(dem, edge, 2.0, NOBODY)
    assert found is not None
    assert found.filled.any()
    assert (found.dem.heights == np.float32(0.4)).all()


def test_under_a_standing_wheel_the_ground_is_as_high_as_its_contact():
    heights = np.full((40, 40), 1.0, np.float32)
    heights[10:30, 10:30] = np.nan
    dem = from_heights(heights, 0.1)
    middle = np.array([dem.geometry.xs[20], dem.geometry.ys[20], -0.3])
    found = without_holes(dem, middle[:2], 1.8, middle[None])
    assert found is not None
    away = np.hypot(found.dem.geometry.xs - middle[0], (found.dem.geometry.ys - middle[1])[:, None])
    assert (found.dem.heights[away <= FOOT_DISC] == np.float32(-0.3)).all()
    assert found.dem.heights[found.filled & (away > 0.9)].min() == 1.0
