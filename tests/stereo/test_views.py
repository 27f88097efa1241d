"""Derived views of terrain, clearing an area, and external terrain under the map."""

# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportOptionalSubscript=false

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidInput, InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.fusion.blend import blend
from footfall.terrain.fusion.clear import Area, clear, inside
from footfall.terrain.ground.views import CollisionView, collision_view
from footfall.terrain.terrain_settings import BlendSettings

CELL = 0.05


def remembered(heights, time=10.0) -> Dem:
    heights = np.asarray(heights, np.float32)
    known = np.isfinite(heights)
    return Dem(
        heights,
        GridGeometry(-1.0, -2.0, CELL, *heights.shape),
        "map",
        Provenance({}),
        texture=np.where(known, 90, 0).astype(np.uint8),
        variance=np.where(known, 1e-4, np.nan).astype(np.float32),
        count=known.astype(np.uint16),
        time=np.where(known, time, np.nan),
        source=known.astype(np.uint8),
        sources=("nav0",),
    )


def holed(rng, shape=(20, 24)):
    heights = rng.normal(0, 0.1, shape).astype(np.float32)
    heights[rng.random(shape) < 0.2] = np.nan
    return remembered(heights)


def test_buffer_is_the_highest_within_a_disc(rng):
    dem = holed(rng)
    radius = 0.16
    got = collision_view(dem, CollisionView(0.15, radius)).heights
    centers = dem.geometry.centers()
    for row, col in np.ndindex(dem.heights.shape):
        if np.isnan(dem.heights[row, col]):
            assert np.isnan(got[row, col])
            continue
        near = np.hypot(*(centers - centers[row, col]).transpose(2, 0, 1)) <= radius + 1e-9
        assert got[row, col] == pytest.approx(np.nanmax(dem.heights[near]) + 0.15, abs=1e-6)


def test_raising_lifts_everything_and_leaves_the_map(rng):
    dem = holed(rng)
    before = dem.heights.copy()
    view = collision_view(dem)
    assert np.allclose(view.heights, dem.heights + 0.15, atol=1e-6, equal_nan=True)
    assert np.array_equal(dem.heights, before, equal_nan=True)
    assert dict(view.provenance.parents) == {"dem": dem.digest}
    assert np.array_equal(collision_view(dem, CollisionView(0.0)).heights, dem.heights, equal_nan=True)
    with pytest.raises(InvalidTerrain):
        CollisionView(-0.1)
    with pytest.raises(InvalidTerrain, match="buffer"):
        collision_view(dem, CollisionView(0.0, 50.0))


def test_clearing_a_disc_forgets_only_that(rng):
    dem = holed(rng)
    area = Area(center=(-0.5, -1.5), radius=0.2)
    cleared = clear(dem, area)
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    gone = np.hypot(x + 0.5, y + 1.5) <= 0.2
    assert np.isnan(cleared.heights[gone]).all()
    assert not cleared.count[gone].any()
    assert not cleared.texture[gone].any()
    assert np.array_equal(cleared.heights[~gone], dem.heights[~gone], equal_nan=True)
    assert np.array_equal(cleared.time[~gone], dem.time[~gone], equal_nan=True)
    assert cleared.provenance.settings is area


def test_a_polygon_is_inside_out_by_the_even_odd_rule():
    grid = GridGeometry(0.0, 0.0, 0.1, 30, 30)
    square = Area(corners=((0.55, 0.55), (1.55, 0.55), (1.55, 2.05), (0.55, 2.05)))
    mask = inside(square, grid)
    x, y = np.meshgrid(grid.xs, grid.ys)
    assert np.array_equal(mask, (x > 0.55) & (x < 1.55) & (y > 0.55) & (y < 2.05))
    backwards = Area(corners=square.corners[::-1])
    assert np.array_equal(inside(backwards, grid), mask)


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"center": (0.0, 0.0)},
        {"center": (0.0, 0.0), "radius": 1.0, "corners": ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))},
        {"center": (0.0, np.nan), "radius": 1.0},
        {"corners": ((0.0, 0.0), (1.0, 0.0))},
        {"corners": ((0.0, 0.0), (1.0, 0.0), (0.0, np.inf))},
        {"corners": ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0, 2.0))},
    ],
)
def test_what_is_no_area_is_refused(wrong):
    with pytest.raises(InvalidInput):
        Area(**wrong)


def test_clearing_nothing_or_all_is_refused(rng):
    dem = holed(rng)
    with pytest.raises(InvalidTerrain, match="nothing to clear"):
        clear(dem, Area(center=(90.0, 0.0), radius=1.0))
    with pytest.raises(InvalidTerrain, match="covers all"):
        clear(dem, Area(center=(0.0, 0.0), radius=50.0))


def slope(x, y):
    return 0.1 * x + 0.05 * y


def test_external_ground_comes_in_under_the_map_without_a_step():
    x, y = np.meshgrid(np.arange(61) * CELL - 1.0, np.arange(61) * CELL - 2.0)
    local = slope(x, y)
    local[:, 30:] = np.nan
    local = remembered(local)
    orbit = from_heights(
        slope(*np.meshgrid(np.arange(80) * 0.2 - 8, np.arange(80) * 0.2 - 8)) + 0.4, 0.2, -8.0, -8.0, "orbit"
    )
    both = blend(local, orbit, BlendSettings(deviation=0.5, time=3.0, seam=0.5, reach=2.5))
    grid = both.geometry
    assert grid.shape == (101, 101)
    X, Y = np.meshgrid(grid.xs, grid.ys)
    row, col = grid.cell(x, y)
    was = np.isfinite(local.heights)
    assert np.array_equal(both.heights[row, col][was], local.heights[was])
    assert np.array_equal(both.variance[row, col][was], local.variance[was])
    # no step: neighbouring cells differ by the slope and at most the steepest part of the fade
    steps = np.abs(np.diff(both.heights - slope(X, Y), axis=1))
    assert np.nanmax(steps) <= 0.4 * 1.5 * CELL / 0.5 * 1.1
    known_east = float(local.geometry.xs[29])
    far = known_east + 0.6 < X
    assert np.allclose((both.heights - slope(X, Y))[far], 0.4, atol=1e-5)
    assert np.allclose(both.variance[far], 0.25, rtol=1e-5)
    assert {both.sources[i - 1] for i in np.unique(both.source[far])} == {"orbit"}
    assert (both.time[far] == 3.0).all()


def test_what_can_not_be_blended_is_refused(rng):
    dem = holed(rng)
    with pytest.raises(InvalidTerrain, match="how sure"):
        blend(replace(dem, variance=None), dem)
    with pytest.raises(InvalidTerrain, match="under the local map"):
        blend(dem, from_heights(np.zeros((5, 5)), 1.0, 500.0, 500.0, "elsewhere"))
    with pytest.raises(InvalidInput):
        BlendSettings(seam=0.0)


def local_and_orbit(offset: float, variance: float | None = None):
    """A sloping local map whose east is unknown, and coarse ground of the same slope under and beyond it."""
    x, y = np.meshgrid(np.arange(61) * CELL - 1.0, np.arange(61) * CELL - 2.0)
    local = slope(x, y)
    local[:, 30:] = np.nan
    orbit = from_heights(
        slope(*np.meshgrid(np.arange(80) * 0.2 - 8, np.arange(80) * 0.2 - 8)) + offset, 0.2, -8.0, -8.0, "orbit"
    )
    if variance is not None:
        known = np.isfinite(orbit.heights)
        orbit = replace(
            orbit,
            variance=np.full(orbit.geometry.shape, variance, np.float32),
            count=known.astype(np.uint16),
            time=np.zeros(orbit.geometry.shape),
            source=known.astype(np.uint8),
            sources=("orbiter",),
        )
    return remembered(local), orbit


def test_heights_from_another_zero_are_levelled_first():
    local, orbit = local_and_orbit(-2640.0)
    both = blend(local, orbit, BlendSettings(seam=0.5, reach=2.5, level=True))
    X, Y = np.meshgrid(both.geometry.xs, both.geometry.ys)
    # 2640 m in float32 keeps 0.24 mm
    assert np.abs(both.heights - slope(X, Y)).max() < 5e-4
    assert "raised by 2640.000 m" in both.name
    with pytest.raises(InvalidTerrain, match="no known ground under"):
        blend(local, replace(orbit, geometry=replace(orbit.geometry, x0=500.0)), BlendSettings(level=True))


def test_an_external_terrain_that_says_how_sure_it_is_is_believed():
    local, orbit = local_and_orbit(0.1, variance=0.04)
    both = blend(local, orbit, BlendSettings(deviation=0.5, seam=0.5, reach=2.5))
    far = float(local.geometry.xs[29]) + 0.6 < np.meshgrid(both.geometry.xs, both.geometry.ys)[0]
    assert np.allclose(both.variance[far], 0.04, rtol=1e-5)
    # in the seam it lies between both, and never falls below the surer one
    known = np.isfinite(both.heights)
    assert (both.variance[known] >= 1e-4 - 1e-9).all()
    assert (both.variance[known] <= 0.04 + 1e-7).all()
