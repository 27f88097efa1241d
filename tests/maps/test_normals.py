"""Normals of all cells at once against the surface's own answer, cell by cell."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, gaussian_filter

from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.normals import cell_normals
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import normal_at

RADIUS = 0.242


def rough(rng, shape, resolution, holes=0.0):
    heights = gaussian_filter(rng.normal(size=shape), 3) * 0.8 + 40.0
    heights[rng.random(shape) < holes] = np.nan
    return Dem(heights.astype(np.float32), GridGeometry(-1.0, 2.0, resolution, *shape), "rough", Provenance({}))


@pytest.mark.parametrize("resolution", [0.02, 0.05, 0.13, 0.43])
def test_agrees_with_the_surface(rng, resolution):
    dem = rough(rng, (60, 70), resolution)
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    rows, cols = slice(3, 25), slice(20, 41)
    ours, share = cell_normals(dem, RADIUS, rows, cols)
    theirs = normal_at(dem, x[rows, cols], y[rows, cols], RADIUS)
    inner = slice(int(RADIUS / resolution) + 2, -1)
    assert (share[inner, inner] == 1).all()
    assert np.isfinite(ours[inner, inner]).all()
    assert np.abs(ours[inner, inner] - theirs[inner, inner]).max() <= 1e-8


def test_off_the_map_and_beside_holes(rng):
    dem = rough(rng, (60, 60), 0.05, holes=0.02)
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    ours, share = cell_normals(dem, RADIUS, slice(0, 60), slice(0, 60))
    theirs = normal_at(dem, x, y, RADIUS)
    near_unknown = binary_dilation(np.pad(np.isnan(dem.heights), 7, constant_values=True), iterations=7)[7:-7, 7:-7]
    far = np.logical_not(near_unknown)
    assert far.any()
    assert (share[far] == 1).all()
    assert (share[np.isnan(dem.heights)] < 1).all()
    assert np.abs(ours[far] - theirs[far]).max() <= 1e-8
    both = np.isfinite(ours[..., 0]) & np.isfinite(theirs[..., 0])
    assert both.mean() > 0.7
    assert np.arccos(np.clip((ours[both] * theirs[both]).sum(axis=1), -1, 1)).max() < 0.15
    assert not (np.isfinite(ours[..., 0]) & np.isnan(theirs[..., 0])).any()
