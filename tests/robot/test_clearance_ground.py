"""Tables of the ground: what they promise of a ball, against dense samples of the triangulated surface."""

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.robot.meshes.ground import surface_points
from footfall.robot.proof.ground_tables import LAID, PER_METRE, START, ground_tables, lay_surface, needed_height
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate


def needed(tables, k, points):
    return np.array([needed_height(tables.cells, tables.layout, k, x, y) for x, y in points])


def rough(rng, rows, cols, resolution, holes=0.0, scale=1.0):
    heights = scale * 3 * resolution * rng.normal(size=(rows, cols))
    heights[rng.uniform(size=heights.shape) < holes] = np.nan
    return from_heights(heights, resolution, -0.37, 0.21)


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.05, 0.15])
@pytest.mark.parametrize("holes", [0.0, 0.15])
def test_a_ball_at_the_needed_height_is_clear_and_above(rng, resolution, holes):
    dem = rough(rng, 25, 31, resolution, holes)
    samples = surface_points(triangulate(dem), resolution / 4)
    radii = np.array([0.04, 0.11, 0.3])
    tables = ground_tables(dem.heights, dem.geometry, radii)
    west, south, east, north = dem.geometry.bounds
    empty = 0
    for k, radius in enumerate(radii):
        rim = 1.2 * radius
        points = rng.uniform((west - rim, south - rim), (east + rim, north + rim), (60, 2))
        for (x, y), z in zip(points, needed(tables, k, points), strict=True):
            away = np.hypot(samples[:, 0] - x, samples[:, 1] - y)
            below = samples[away <= radius]
            if z == -np.inf:
                assert len(below) == 0
                empty += 1
            elif len(below):
                assert (below[:, 2] < z).all()
                assert np.linalg.norm(below - (x, y, z), axis=1).min() >= radius - 1e-9
    assert empty > 0


@pytest.mark.parametrize("resolution", [0.02, 0.05])
def test_heights_are_those_of_the_definition_in_whatever_order_they_are_asked(rng, resolution):
    """Against T block by block, of blocks of the grid's own size; see the module."""
    dem = rough(rng, 30, 24, resolution, 0.1)
    radii = np.array([9.0, 11.0]) * resolution
    z, grid = np.asarray(dem.heights, float), dem.geometry
    corners = np.array([z[:-1, :-1], z[1:, :-1], z[:-1, 1:], z[1:, 1:]])
    tops = np.where(np.isnan(corners).any(axis=0), -np.inf, corners.max(axis=0))
    rows, cols = np.indices(tops.shape)
    asked = rng.integers(-14, 44, (300, 2))
    for k, radius in enumerate(radii):
        expected = []
        for row, col in asked:
            away = np.hypot(*(np.maximum(np.abs(at - one) - 1, 0) for at, one in ((rows, row), (cols, col))))
            away *= resolution
            near = away <= radius
            rise = np.sqrt(np.maximum(radius**2 - away**2, 0.0))
            expected.append((tops + rise)[near].max(initial=-np.inf))
        points = (grid.x0, grid.y0) + resolution * (asked[:, ::-1] + rng.uniform(0.01, 0.99, asked.shape))
        for order in (slice(None), slice(None, None, -1)):
            tables = ground_tables(z, grid, radii)
            assert tables.layout[k, PER_METRE] == pytest.approx(1 / resolution)
            told = needed(tables, k, points[order])
            assert told == pytest.approx(expected[order], abs=1e-12)
            assert np.array_equal(told, needed(tables, k, points[order]))


def test_level_ground_is_exact(rng):
    for resolution in (0.01, 0.02, 0.07):
        grid = GridGeometry(x0=-1.0, y0=-1.0, resolution=resolution, rows=60, cols=80)
        tables = ground_tables(np.full(grid.shape, 0.4), grid, [0.05, 0.3])
        points = rng.uniform((-0.9, -0.9), (-0.7, -0.7), (50, 2))
        for k, radius in enumerate((0.05, 0.3)):
            assert needed(tables, k, points) == pytest.approx(0.4 + radius, abs=1e-12)


def test_a_slope_costs_at_most_its_rise_over_two_cells(rng):
    steep, radius = 0.5, 0.1
    grid = GridGeometry(x0=0.0, y0=0.0, resolution=0.02, rows=100, cols=100)
    tables = ground_tables(steep * np.broadcast_to(grid.xs, grid.shape), grid, [radius])
    points = rng.uniform((0.5, 0.5), (1.5, 1.5), (300, 2))
    exact = steep * points[:, 0] + radius * np.hypot(1.0, steep)
    over = needed(tables, 0, points) - exact
    assert (over >= 0).all()
    assert over.max() <= steep * 2 * 0.02 + 1e-9


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.05])
def test_ground_cut_out_answers_alike_inside(rng, resolution):
    dem = rough(rng, 120, 90, resolution, 0.05, 0.5)
    radii, around = [0.06, 0.2], np.array([dem.geometry.x0 + 0.6 * 90 * resolution, dem.geometry.y0 + 0.1])
    whole, part = (
        ground_tables(dem.heights, dem.geometry, radii, **circle) for circle in ({}, {"around": around, "within": 0.3})
    )
    assert part.cells.size < whole.cells.size
    corner = around + np.array([[0.29, 0.29], [-0.29, 0.29]])
    assert not (needed(part, 1, corner) < needed(whole, 1, corner)).any()  # outside the circle: never too low
    angle, out = rng.uniform(0, 2 * np.pi, 400), 0.3 * np.sqrt(rng.uniform(size=400))
    points = around + np.column_stack([out * np.cos(angle), out * np.sin(angle)])
    samples = surface_points(triangulate(dem), resolution / 4)
    for k, radius in enumerate(radii):
        a, b = needed(whole, k, points), needed(part, k, points)
        if part.layout[k, PER_METRE] >= 1 / resolution - 1e-9:
            assert np.array_equal(a, b)
        # the cells of coarser tables need not begin at the same place
        for (x, y), z in zip(points[::8], b[::8], strict=True):
            below = samples[np.hypot(samples[:, 0] - x, samples[:, 1] - y) <= radius]
            assert len(below) == 0 or z > below[:, 2].max()
            assert (np.linalg.norm(below - (x, y, z), axis=1) >= radius - 1e-9).all()


def test_grids_too_small_for_a_triangle_are_no_ground():
    grid = GridGeometry(x0=0.0, y0=0.0, resolution=0.1, rows=1, cols=9)
    tables = ground_tables(np.zeros(grid.shape), grid, [0.1])
    assert needed(tables, 0, [(0.0, 0.0), (0.4, 0.0), (50.0, 0.0)]).max() == -np.inf


def test_misuse_is_refused():
    grid = GridGeometry(x0=0.0, y0=0.0, resolution=0.1, rows=5, cols=9)
    flat = np.zeros(grid.shape)
    with pytest.raises(InvalidInput, match=r"shape \(5, 9\)"):
        ground_tables(flat.T, grid, [0.1])
    with pytest.raises(InvalidInput, match="finite"):
        ground_tables(flat + np.inf, grid, [0.1])
    with pytest.raises(InvalidInput, match="above zero"):
        ground_tables(flat, grid, [0.0, 0.1])
    with pytest.raises(InvalidInput, match="cut out"):
        ground_tables(flat, grid, [0.1], around=(0.0, 0.0))
    with pytest.raises(InvalidInput, match="cut out"):
        ground_tables(flat, grid, [0.1], around=(0.0, np.nan), within=1.0)
    wide = GridGeometry(x0=0.0, y0=0.0, resolution=0.1, rows=900, cols=900)
    with pytest.raises(InvalidInput, match="too large"):
        ground_tables(np.zeros(wide.shape), wide, [0.1])
    assert ground_tables(np.zeros(wide.shape), wide, [0.1], around=(45.0, 45.0), within=2.0).cells.size < 1e6


def test_the_surface_is_laid_for_drums_beside_what_balls_ask(rng):
    dem = rough(rng, 25, 31, 0.05, 0.1)
    tables = ground_tables(dem.heights, dem.geometry, [0.06, 0.2], around=(0.4, 0.6), within=0.3)
    cut, start = tables.heights, int(tables.layout[-1, START])
    assert not tables.cells[start:].any()
    assert tables.layout[-1, LAID] == 0
    points = rng.uniform((0.2, 0.4), (0.6, 0.8), (50, 2))
    before = [needed(tables, k, points) for k in range(2)]
    lay_surface(tables)
    np.testing.assert_array_equal(tables.cells[start:].reshape(cut.shape), cut)
    assert np.isin(cut[np.isfinite(cut)], dem.heights).all()
    np.testing.assert_array_equal([needed(tables, k, points) for k in range(2)], before)


@pytest.mark.parametrize("resolution", [0.1, 0.25, 2.0, 20.0])
def test_coarse_ground_is_cut_out_however_large_its_cells(rng, resolution):
    dem = from_heights(rng.normal(size=(9, 11)) * 0.2 * resolution, resolution, -5 * resolution, -4 * resolution)
    around, within, radii = np.array([0.3, -0.2]) * resolution, min(2.5, 1.5 * resolution), [0.06, 0.2]
    part = ground_tables(dem.heights, dem.geometry, radii, around, within)
    assert part.cells.size < 2e6
    angle, out = rng.uniform(0, 2 * np.pi, 300), within * np.sqrt(rng.uniform(size=300))
    points = around + np.column_stack([out * np.cos(angle), out * np.sin(angle)])
    steepest = float(np.hypot(*(np.abs(np.diff(dem.heights, axis=axis)).max() / resolution for axis in (0, 1))))
    for k, radius in enumerate(radii):
        offset = np.linspace(-radius, radius, 41)
        dx, dy = (d[np.hypot(*np.meshgrid(offset, offset)) <= radius] for d in np.meshgrid(offset, offset))
        rise = np.sqrt(radius**2 - dx**2 - dy**2)
        exact = (height_at(dem, points[:, :1] + dx, points[:, 1:] + dy) + rise).max(axis=1)
        over = needed(part, k, points) - exact
        # never too low, and too high by no more than surface and ball rise over a few cells of the table
        cells = 4 / part.layout[k, PER_METRE]
        assert (over >= -1e-6).all()
        assert over.max() < steepest * cells + np.sqrt(2 * radius * cells)
