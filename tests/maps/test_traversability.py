"""Plane fits against numpy's least squares, cell by cell, and what the layers must say of simple ground."""

import numpy as np
import pytest

from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import LEAST_CERTAINTY, LEAST_SPREAD, traversability, window_cells
from footfall.terrain.dem import Dem

RESOLUTION = 0.05


def ground(heights, resolution=RESOLUTION):
    heights = np.asarray(heights, np.float32)
    return Dem(heights, GridGeometry(500.0, -300.0, resolution, *heights.shape), "ground", Provenance({}))


def cell_by_cell(dem, half):
    """Slope, roughness, step and share of each window by numpy.linalg.lstsq; NaN where undetermined."""
    rows, cols = dem.heights.shape
    out = np.full((4, rows, cols), np.nan)
    offsets = RESOLUTION * np.arange(-half, half + 1)
    full = np.mean(offsets**2)
    for row in range(rows):
        for col in range(cols):
            points = [
                (RESOLUTION * j, RESOLUTION * i, float(dem.heights[row + i, col + j]))
                for i in range(-half, half + 1)
                for j in range(-half, half + 1)
                if 0 <= row + i < rows and 0 <= col + j < cols and np.isfinite(dem.heights[row + i, col + j])
            ]
            out[3, row, col] = len(points) / (2 * half + 1) ** 2
            if not np.isfinite(dem.heights[row, col]) or out[3, row, col] < LEAST_CERTAINTY:
                continue
            xyz = np.array(points)
            if np.linalg.eigvalsh(np.cov(xyz[:, :2].T, bias=True))[0] < LEAST_SPREAD**2 * full:
                continue
            matrix = np.column_stack([xyz[:, :2], np.ones(len(xyz))])
            plane = np.linalg.lstsq(matrix, xyz[:, 2], rcond=None)[0]
            residual = xyz[:, 2] - matrix @ plane
            out[:3, row, col] = (
                np.arctan(np.hypot(plane[0], plane[1])),
                np.sqrt(np.mean(residual**2)),
                np.ptp(residual),
            )
    return out


@pytest.mark.parametrize("holes", [0.0, 0.3, 0.7])
def test_layers_agree_with_least_squares_cell_by_cell(rng, holes):
    heights = 0.2 * rng.normal(size=(40, 34)).cumsum(axis=0) + 0.3 * np.arange(34)
    heights[rng.random(heights.shape) < holes] = np.nan
    heights[5:15, 20:33] = np.nan
    dem = ground(heights)
    found = traversability(dem, MapSettings(window=0.45))
    slope, roughness, step, share = cell_by_cell(dem, half=4)
    assert np.abs(found.certainty - share).max() < 1e-6
    for layer, expected, within in (
        (found.slope, slope, 1e-6),
        (found.roughness, roughness, 1e-6),
        (found.step, step, 1e-5),
    ):
        assert (np.isnan(layer) == np.isnan(expected)).all()
        known = np.isfinite(expected)
        assert known.any()
        assert np.abs(layer[known] - expected[known]).max() <= within
    if holes:
        assert np.isnan(slope).any()


def test_a_slope_is_a_slope_and_nothing_else():
    north, east = np.meshgrid(np.arange(30), np.arange(30), indexing="ij")
    found = traversability(ground(RESOLUTION * (0.3 * east - 0.1 * north)), MapSettings())
    assert found.slope == pytest.approx(np.full((30, 30), np.arctan(np.hypot(0.3, 0.1))), abs=1e-6)
    assert found.gradient == pytest.approx(np.broadcast_to([0.3, -0.1], (30, 30, 2)), abs=1e-5)
    assert found.roughness.max() < 1e-5
    assert found.step.max() < 1e-5


def test_goodness_takes_the_worst_of_the_three():
    settings = MapSettings()
    flat = traversability(ground(np.zeros((30, 30))), settings)
    assert (flat.goodness == 1).all()
    edge = np.zeros((30, 30))
    edge[:, 15:] = 0.4
    wall = traversability(ground(edge), settings)
    assert wall.goodness[:, 14:16].max() == 0
    assert wall.goodness[:, :8].min() > 1 - 1e-6
    north = np.arange(30)[:, None] * np.ones(30) * RESOLUTION * np.tan(settings.slope_limit / 2)
    assert traversability(ground(north), settings).goodness == pytest.approx(np.full((30, 30), 0.5), abs=1e-4)


def test_unknown_stays_unknown_and_certainty_is_apart(rng):
    heights = 0.01 * rng.normal(size=(40, 40))
    heights[10:30, 10:30] = np.nan
    found = traversability(ground(heights), MapSettings())
    hole = np.isnan(heights)
    for layer in (found.slope, found.roughness, found.step, found.goodness):
        assert np.isnan(layer[hole]).all()
    assert np.isfinite(found.certainty).all()
    assert found.certainty[20, 20] == 0
    assert found.certainty[5, 20] < 1
    # the corner of the map sees a quarter of its window
    assert found.certainty[0, 0] == pytest.approx((6 / 11) ** 2)


def test_a_strip_of_known_cells_leaves_the_tilt_open():
    heights = np.full((30, 30), np.nan)
    heights[:, 14:16] = 0.0
    assert np.isnan(traversability(ground(heights), MapSettings()).slope).all()


def test_far_origin_and_large_heights_lose_nothing(rng):
    heights = (0.05 * rng.normal(size=(30, 30))).astype(np.float32)
    near = traversability(ground(heights), MapSettings())
    high = traversability(ground(heights.astype(np.float64) + 1024), MapSettings())
    # float32 heights near 1024 m are 0.06 mm apart
    assert np.abs(near.roughness - high.roughness).max() < 1e-4


def test_windows_are_odd_and_bounded():
    assert window_cells(0.5, 0.02) == 25
    assert window_cells(0.5, 0.05) == 11
    assert window_cells(0.5, 10.0) == 3
    with pytest.raises(InvalidInput, match="at most"):
        window_cells(50.0, 0.02)


def test_can_be_cancelled():
    def stop(fraction, text):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        traversability(ground(np.zeros((20, 20))), MapSettings(), stop)
