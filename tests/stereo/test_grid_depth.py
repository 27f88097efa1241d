import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from footfall.core import frames
from footfall.core.grid import GridGeometry
from footfall.terrain.fusion.fuse import fuse
from footfall.terrain.fusion.grid_depth import (
    CellSamples,
    grid_depth,
    pixel_sides,
    site_points,
    upper_surface,
    with_pixels,
)
from tests.support.kept_arrays import read_only

WIDTH, HEIGHT, FOCAL = 64, 48, 60.0
INTRINSICS = (FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
GRID = GridGeometry(-4.0, -4.0, 0.05, 161, 161)


def looking_down(height: float, pitch: float, yaw: float) -> np.ndarray:
    """T_site_camera of a camera above the origin whose axis points ``pitch`` below the horizon."""
    level = frames.rotation("z", yaw) @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return frames.transform(level @ frames.rotation("x", -pitch), (0.0, 0.0, height))


def plane_depth(T_site_camera: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """Depth of the plane normal · p = offset at each pixel; NaN where the ray does not meet it ahead."""
    fx, fy, cx, cy = INTRINSICS
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], -1) @ T_site_camera[:3, :3].T
    with np.errstate(divide="ignore"):
        depth = (offset - T_site_camera[:3, 3] @ normal) / (rays @ normal)
    return np.where((depth > 0.1) & (depth < 5.0), depth, np.nan)


def gridded(depth, T, grid=GRID, max_jump=100.0, max_edge=100.0, grey=None, sure=None):
    grey = np.zeros(depth.shape, np.uint8) if grey is None else grey
    sure = np.ones(depth.shape, bool) if sure is None else sure
    disparity = (FOCAL * 0.2 / depth).astype(np.float32)
    points = site_points(depth, INTRINSICS, T)
    return grid_depth(points, disparity, depth**2 / (FOCAL * 0.2), read_only(grey), grid, max_jump, max_edge, sure)


def sample(depth, T, *args, **options):
    return gridded(depth, T, *args, **options)[0]


def as_set(samples):
    return set(zip(samples.cell.tolist(), samples.height.tolist(), samples.variance.tolist(), strict=True))


@given(
    height=st.floats(1.0, 2.5),
    pitch=st.floats(0.6, 1.57),
    yaw=st.floats(-3.1, 3.1),
    tilt=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
)
def test_a_plane_comes_back_exactly(height, pitch, yaw, tilt):
    normal = np.array([-tilt[0], -tilt[1], 1.0])
    T = looking_down(height, pitch, yaw)
    samples = sample(plane_depth(T, normal, 0.0), T)
    rows, cols = np.divmod(samples.cell, GRID.cols)
    expected = tilt[0] * GRID.xs[cols] + tilt[1] * GRID.ys[rows]
    assert len(rows) > 20
    assert np.abs(samples.height - expected).max() < 1e-9


def test_each_cell_in_view_is_covered_once_even_where_pixels_are_sparse():
    """Straight down, pixels 3.3 cm apart on 2 cm cells: binning points would leave two thirds of them empty."""
    T = looking_down(2.0, np.pi / 2, 0.0)
    grid = GridGeometry(-0.5, -0.5, 0.02, 51, 51)
    samples = sample(plane_depth(T, np.array([0.0, 0.0, 1.0]), 0.0), T, grid)
    assert set(samples.cell) == set(range(51 * 51))
    assert len(samples.cell) < 1.1 * 51 * 51  # only cells on a shared side may come twice


def brute_force(points, disparity, grid, max_jump, max_edge):
    """Every triangle against every cell, one at a time."""
    found = []
    for v, u in itertools.product(range(HEIGHT - 1), range(WIDTH - 1)):
        for corners in (((v, u), (v + 1, u), (v, u + 1)), ((v, u + 1), (v + 1, u), (v + 1, u + 1))):
            d = np.array([disparity[c] for c in corners])
            p = np.array([points[:, c[0], c[1]] for c in corners])
            if not np.isfinite(d).all() or np.ptp(d) > max_jump or np.ptp(p[:, :2], axis=0).max() > max_edge:
                continue
            xs = np.flatnonzero((grid.xs >= p[:, 0].min() - 1e-9) & (grid.xs <= p[:, 0].max() + 1e-9))
            ys = np.flatnonzero((grid.ys >= p[:, 1].min() - 1e-9) & (grid.ys <= p[:, 1].max() + 1e-9))
            for row, col in itertools.product(ys, xs):
                weights = np.linalg.solve(np.vstack([p[:, :2].T, np.ones(3)]), [grid.xs[col], grid.ys[row], 1.0])
                if (weights >= 0).all():
                    found.append((row * grid.cols + col, weights @ p[:, 2]))
    return sorted(found)


def test_agrees_with_every_triangle_against_every_cell(rng):
    T = looking_down(1.5, 1.0, 0.4)
    depth = plane_depth(T, np.array([0.1, -0.2, 1.0]), 0.0) * (1 + 0.01 * rng.standard_normal((HEIGHT, WIDTH)))
    depth[rng.random(depth.shape) < 0.1] = np.nan
    depth[10:20, 20:30] -= 0.4
    samples = sample(depth, T, max_jump=0.8, max_edge=0.3)
    disparity = (FOCAL * 0.2 / depth).astype(np.float32)
    expected = brute_force(site_points(depth, INTRINSICS, T), disparity, GRID, 0.8, 0.3)
    got = sorted(zip(samples.cell.tolist(), samples.height.tolist(), strict=True))
    assert [cell for cell, _ in got] == [cell for cell, _ in expected]
    assert np.allclose([h for _, h in got], [h for _, h in expected], atol=1e-9)
    assert len(got) > 500


@given(seed=st.integers(0, 99), share=st.floats(0.0, 1.0))
def test_what_sure_pixels_show_is_what_they_show_without_the_others(seed, share):
    T, rng = looking_down(1.5, 1.0, 0.4), np.random.default_rng(seed)
    depth = plane_depth(T, np.array([0.1, -0.2, 1.0]), 0.0) * (1 + 0.01 * rng.standard_normal((HEIGHT, WIDTH)))
    sure = rng.random(depth.shape) < share
    surely, doubtfully, gaps = gridded(depth, T, max_edge=0.3, sure=sure)
    alone, none, gaps_alone = gridded(np.where(sure, depth, np.nan), T, max_edge=0.3)
    assert as_set(surely) == as_set(alone)
    assert len(none.cell) == 0
    assert np.array_equal(gaps & sure, gaps_alone)
    # and together they show what all of them would
    assert as_set(surely) | as_set(doubtfully) == as_set(sample(depth, T, max_edge=0.3))


@given(pitch=st.floats(0.2, 1.5), yaw=st.floats(-3.1, 3.1), seed=st.integers(0, 99))
def test_points_are_those_of_the_matrix_product(pitch, yaw, seed):
    T, depth = looking_down(1.5, pitch, yaw), np.random.default_rng(seed).uniform(0.5, 9.0, (HEIGHT, WIDTH))
    depth[0, 0] = np.nan
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - INTRINSICS[2]) / FOCAL, (v - INTRINSICS[3]) / FOCAL, np.ones(u.shape)])
    expected = np.einsum("ij,jvu->ivu", T[:3, :3], rays * depth) + T[:3, 3, None, None]
    assert np.allclose(site_points(depth, INTRINSICS, T), expected, rtol=0, atol=1e-12, equal_nan=True)


def slopes_of(T, normal, offset):
    """By how much the disparity of the plane normal · p = offset changes to the next column and row [px]."""
    in_camera = T[:3, :3].T @ normal * FOCAL * 0.2 / (offset - T[:3, 3] @ normal)
    return tuple(np.full((HEIGHT, WIDTH), in_camera[axis] / FOCAL, np.float32) for axis in (0, 1))


def sample_of_pixels(depth, T, slopes, alone: np.ndarray | bool = True, max_edge=100.0):
    disparity = (FOCAL * 0.2 / depth).astype(np.float32)
    points, deviation = site_points(depth, INTRINSICS, T), depth**2 / (FOCAL * 0.2)
    grey = read_only(np.full(depth.shape, 7, np.uint8))
    sure = np.ones(depth.shape, bool)
    joined, _, gaps = grid_depth(points, disparity, deviation, grey, GRID, 100.0, max_edge, sure)
    rows, cols = np.nonzero(gaps & alone)
    sides = pixel_sides(rows, cols, depth, slopes, FOCAL * 0.2, INTRINSICS, T)
    return with_pixels(joined, rows, cols, sides, points, deviation, grey, GRID, max_edge)


@given(
    height=st.floats(1.0, 2.5),
    pitch=st.floats(0.6, 1.57),
    yaw=st.floats(-3.1, 3.1),
    tilt=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    seed=st.integers(0, 99),
)
def test_lone_pixels_cover_what_lies_within_half_a_pixel_on_their_planes(height, pitch, yaw, tilt, seed):
    normal = np.array([-tilt[0], -tilt[1], 1.0])
    T = looking_down(height, pitch, yaw)
    whole = plane_depth(T, normal, 0.0)
    some = np.random.default_rng(seed).random(whole.shape) < 0.2
    depth = np.where(some, whole, np.nan)
    joined = sample(depth, T)
    both = sample_of_pixels(depth, T, slopes_of(T, normal, 0.0))
    n = len(joined.cell)
    assert np.array_equal(both.cell[:n], joined.cell)
    rows, cols = np.divmod(both.cell[n:], GRID.cols)
    assert np.abs(both.height[n:] - tilt[0] * GRID.xs[cols] - tilt[1] * GRID.ys[rows]).max(initial=0.0) < 1e-6
    assert not np.isin(both.cell[n:], joined.cell).any()
    assert (both.grey[n:] == 7).all()
    # each of those cells, seen by the camera, falls into a pixel that is known; a pixel is straight but for perspective
    p = np.stack([GRID.xs[cols], GRID.ys[rows], both.height[n:]], axis=1) - T[:3, 3]
    x, y, z = (p @ T[:3, :3]).T
    u, v = FOCAL * x / z + INTRINSICS[2], FOCAL * y / z + INTRINSICS[3]
    near = np.zeros(len(u), bool)
    for row, col in itertools.product((-0.05, 0.05), repeat=2):
        at = (np.clip(np.rint(v + row), 0, HEIGHT - 1).astype(int), np.clip(np.rint(u + col), 0, WIDTH - 1).astype(int))
        near |= np.isfinite(depth[at])
    assert near.all()


def test_only_pixels_that_may_stand_alone_and_are_not_too_long_cover_cells():
    T, up = looking_down(1.5, 0.8, 0.4), np.array([0.0, 0.0, 1.0])
    depth = np.full((HEIGHT, WIDTH), np.nan)
    for place in ((24, 20), (24, 40), (4, 30)):
        depth[place] = plane_depth(T, up, 0.0)[place]
    slopes = slopes_of(T, up, 0.0)
    assert len(sample(depth, T).cell) == 0
    everywhere = sample_of_pixels(depth, T, slopes)
    alone = np.zeros(depth.shape, bool)
    alone[24, 20] = True
    one = sample_of_pixels(depth, T, slopes, alone)
    assert 0 < len(one.cell) < len(everywhere.cell)
    assert set(one.cell) < set(everywhere.cell)
    assert np.allclose(one.variance, (depth[24, 20] ** 2 / (FOCAL * 0.2)) ** 2)
    assert len(sample_of_pixels(depth, T, slopes, max_edge=0.01).cell) == 0


def test_no_surface_is_invented_across_a_depth_jump():
    """A ledge hides a strip of the ground behind it: the strip stays unknown."""
    T = looking_down(1.5, 0.8, 0.0)
    up = np.array([0.0, 0.0, 1.0])
    ground, ledge = plane_depth(T, up, 0.0), plane_depth(T, up, 0.5)
    points = site_points(ledge, INTRINSICS, T)
    depth = np.where(points[0] < 1.0, ledge, ground)
    samples = sample(depth, T, max_jump=1.0)
    x = GRID.xs[samples.cell % GRID.cols]
    assert set(np.round(samples.height, 6)) == {0.0, 0.5}
    # seen over the ledge's edge at x = 1, z = 0.5 from x = 0, z = 1.5, the ground starts at x = 1.5
    assert x[samples.height > 0.25].max() <= 1.0
    assert not (samples.height < 0.25).any() or x[samples.height < 0.25].min() >= 1.45


def test_variance_and_grey_come_from_the_same_place():
    T = looking_down(2.0, np.pi / 2, 0.0)
    grey = np.tile((np.arange(WIDTH) * 2).astype(np.uint8), (HEIGHT, 1))
    samples = sample(plane_depth(T, np.array([0.0, 0.0, 1.0]), 0.0), T, grey=grey)
    assert np.allclose(samples.variance, (4.0 / 12.0) ** 2)
    y = GRID.ys[samples.cell // GRID.cols]
    column = INTRINSICS[2] - y / 2.0 * FOCAL  # image columns run south for this camera
    assert np.allclose(samples.grey, 2 * column, atol=1e-6)


def test_nothing_known_gives_no_samples():
    T = looking_down(2.0, np.pi / 2, 0.0)
    assert len(sample(np.full((HEIGHT, WIDTH), np.nan), T).cell) == 0


def under_a_slab() -> CellSamples:
    """Ground, and a slab half a metre above it whose edge the camera looks under: it sees both in many cells."""
    T = looking_down(1.6, 0.5, 0.0)
    ground = plane_depth(T, np.array([0.0, 0.0, 1.0]), 0.0)
    slab = plane_depth(T, np.array([0.0, 0.0, 1.0]), 0.5)
    x, y, _ = site_points(slab, INTRINSICS, T)
    with np.errstate(invalid="ignore"):
        on_slab = (np.abs(x - 2.2) < 0.4) & (np.abs(y) < 0.6)
    return sample(np.where(on_slab, slab, ground), T, max_jump=0.3, max_edge=4.0)


def test_ground_under_an_overhang_does_not_stand_for_its_upper_side():
    seen = under_a_slab()
    upper = upper_surface(seen, GRID, 0.05)
    rows, cols = np.divmod(seen.cell, GRID.cols)
    inside = (np.abs(GRID.xs[cols] - 2.2) < 0.3) & (np.abs(GRID.ys[rows]) < 0.5)
    both = np.intersect1d(seen.cell[inside & (seen.height > 0.4)], seen.cell[inside & (seen.height < 0.1)])
    assert len(both) > 20
    heights = fuse([upper], GRID, 0.05).heights.ravel()
    assert np.abs(heights[both] - 0.5).max() < 1e-6
    free = np.setdiff1d(seen.cell, both)
    kept = np.isin(upper.cell, free).sum(), np.isin(seen.cell, free).sum()
    assert kept[0] > 0.97 * kept[1]  # only along the slab's rim another sample may fall


def test_a_lone_point_above_the_ground_takes_nothing_away():
    """A mistake of the matcher in one cell is left to the median, as before."""
    cells = np.array([r * GRID.cols + c for r in range(40, 45) for c in range(60, 65)])
    above = cells[12]
    seen = CellSamples(np.r_[cells, above], np.r_[np.zeros(25), 0.4], np.full(26, 1e-6), np.full(26, 90.0))
    assert len(upper_surface(seen, GRID, 0.05).cell) == 26


@given(step=st.floats(0.051, 1.0))
def test_an_upper_surface_that_goes_on_hides_what_lies_under_it(step):
    cells = np.array([r * GRID.cols + c for r in range(40, 45) for c in range(60, 65)])
    seen = CellSamples(np.r_[cells, cells], np.r_[np.zeros(25), np.full(25, step)], np.full(50, 1e-6), np.zeros(50))
    upper = upper_surface(seen, GRID, 0.05)
    inner = [r * GRID.cols + c for r in range(41, 44) for c in range(61, 64)]
    assert (upper.height[np.isin(upper.cell, inner)] == step).all()
    same = upper_surface(CellSamples(cells, np.zeros(25), np.full(25, 1e-6), np.zeros(25)), GRID, 0.05)
    assert len(same.cell) == 25
