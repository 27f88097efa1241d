"""How old the ground is, in bands, and how it is hatched: cell by cell, the slow way."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.terrain.from_arrays import from_heights
from footfall.terrain.fusion.age import BANDS, age_bands, age_shares, ages
from footfall_ui.scene.age import MOST, OVER, hatching


def measured(ages_s, heights=None, resolution=0.05):
    """Terrain whose cells were measured so long before the newest [s]."""
    old = np.asarray(ages_s, float)
    if heights is None:
        heights = np.fromfunction(lambda row, col: 0.01 * row + 0.02 * col, old.shape)
    heights = np.asarray(heights, np.float32)
    dem = from_heights(heights, resolution, 10.0, -3.0, "aged")
    known = np.isfinite(heights)
    return replace(
        dem,
        time=np.where(known, 1e9 - old, np.nan),
        variance=np.where(known, 1e-4, np.nan).astype(np.float32),
        count=known.astype(np.uint16),
        source=known.astype(np.uint8),
        sources=("nav0",),
    )


def test_bands_are_the_ages_from_which_ground_is_older():
    dem = measured([[0, 59, 60, 599], [600, 3599, 3600, 1e5]])
    assert age_bands(dem).tolist() == [[0, 0, 1, 1], [2, 2, 3, 3]]
    assert age_shares(dem) == ([0.25, 0.25, 0.25, 0.25], 0.0)
    assert np.array_equal(ages(dem)[0], np.array([0, 59, 60, 599], np.float32))


def test_what_is_not_known_has_no_age():
    heights = np.zeros((2, 4))
    heights[0, 0] = np.nan
    dem = measured([[0, 0, 700, 700]] * 2, heights)
    assert age_bands(dem)[0].tolist() == [-1, 0, 2, 2]
    shares, unknown = age_shares(dem)
    assert shares == pytest.approx([3 / 7, 0, 4 / 7, 0])
    assert unknown == 0
    forgotten = replace(dem, time=None, variance=None, count=None, source=None)
    assert age_shares(forgotten) == ([0.0] * (len(BANDS) + 1), 1.0)
    assert len(hatching(forgotten)[0]) == 0


def test_hatching_lies_on_old_ground_alone_and_is_denser_the_older():
    rng = np.random.default_rng(4)
    heights = rng.uniform(0, 0.3, (160, 160))
    heights[60:80] = np.nan
    quarter = np.repeat(np.repeat([[0.0, 100.0], [1000.0, 5000.0]], 80, axis=0), 80, axis=1)
    dem = measured(quarter, heights, resolution=0.02)
    segments, colors = hatching(dem)
    assert colors.shape == segments.shape
    assert len(np.unique(colors.reshape(-1, 3), axis=0)) == 2
    cells = np.rint((segments[..., :2] - [dem.geometry.x0, dem.geometry.y0]) / dem.geometry.resolution).astype(int)
    cols, rows = cells[..., 0], cells[..., 1]
    assert segments[..., 2] == pytest.approx(dem.heights[rows, cols] + OVER)
    assert (quarter[rows, cols] > 0).all()
    # length of line on each quarter's known ground
    begins = quarter[rows, cols].min(axis=1)
    dense = [
        np.linalg.norm(np.diff(segments[begins == age][..., :2], axis=1), axis=-1).sum()
        / np.isfinite(heights[quarter == age]).sum()
        for age in (100.0, 1000.0, 5000.0)
    ]
    assert dense[1] / dense[0] == pytest.approx(2, rel=0.25)
    assert dense[2] / dense[1] == pytest.approx(2, rel=0.25)


def test_large_ground_gets_wider_hatching():
    old = np.full((1500, 1500), 1e4)
    old[0, 0] = 0.0
    segments, _ = hatching(measured(old, np.zeros((1500, 1500)), resolution=0.02))
    assert MOST / 5 < len(segments) <= MOST
    assert np.ptp(segments[..., 0]) > 29.0
