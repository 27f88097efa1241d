"""The one triangulation: heights, normals and picks lie exactly on it."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane, slope
from footfall.terrain.ground.normal_kernel import added
from footfall.terrain.ground.surface import height_at, normal_at, pick
from footfall.terrain.ground.triangulate import crop, triangulate


def rough(seed, rows=9, cols=12, holes=0.12, resolution=0.37, x0=-1.3, y0=2.1):
    rng = np.random.default_rng(seed)
    heights = rng.normal(scale=0.5, size=(rows, cols))
    heights[rng.random((rows, cols)) < holes] = np.nan
    heights[:2, :2] = 0.1
    return from_heights(heights, resolution, x0, y0)


def picked(dem, origin, direction):
    point = pick(dem, origin, direction)
    assert point is not None
    return point


def all_ray_hits(mesh, origins, directions):
    """Least positive ray parameter of every ray by Möller & Trumbore (1997), (n,), inf where none."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    first = np.full(len(origins), np.inf)
    for i, (o, d) in enumerate(zip(origins, directions, strict=True)):
        p = np.cross(d, c - a)
        det = np.sum((b - a) * p, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.sum((o - a) * p, axis=1) / det
            q = np.cross(o - a, b - a)
            v = q @ d / det
            t = np.sum((c - a) * q, axis=1) / det
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
        if hit.any():
            first[i] = t[hit].min()
    return first


@given(st.integers(0, 10_000))
def test_triangles_are_the_fully_known_blocks_facing_up(seed):
    dem = rough(seed)
    mesh = triangulate(dem)
    known = np.isfinite(dem.heights)
    blocks = known[1:, 1:] & known[:-1, 1:] & known[1:, :-1] & known[:-1, :-1]
    assert len(mesh.triangles) == 2 * blocks.sum()
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    up = np.cross(b - a, c - a)[:, 2]
    np.testing.assert_allclose(up, dem.geometry.resolution**2, rtol=1e-9)
    assert set(np.unique(mesh.triangles)) == set(range(len(mesh.vertices)))


@given(st.integers(0, 10_000))
def test_height_is_where_a_vertical_ray_meets_the_triangles(seed):
    dem = rough(seed)
    mesh = triangulate(dem)
    rng = np.random.default_rng(seed)
    west, south, east, north = dem.geometry.bounds
    xy = rng.uniform((west - 0.5, south - 0.5), (east + 0.5, north + 0.5), size=(60, 2))
    origins = np.column_stack([xy, np.full(60, 10.0)])
    t = all_ray_hits(mesh, origins, np.tile([0.0, 0.0, -1.0], (60, 1)))
    expected = np.where(np.isfinite(t), 10.0 - t, np.nan)
    np.testing.assert_allclose(height_at(dem, xy[:, 0], xy[:, 1]), expected, atol=1e-9)


@given(st.integers(0, 10_000))
def test_every_vertex_and_edge_point_is_on_the_surface(seed):
    dem = rough(seed, holes=0.3)
    mesh = triangulate(dem)
    corners = mesh.vertices[mesh.triangles]
    for share in (0.0, 0.25, 0.5):
        p = (1 - share) * corners + share * np.roll(corners, 1, axis=1)
        np.testing.assert_allclose(height_at(dem, p[..., 0], p[..., 1]), p[..., 2], atol=1e-8)


def test_height_broadcasts_and_is_unknown_off_the_map():
    dem = plane(4.0, 0.5, height=1.5)
    assert height_at(dem, 0.1, 0.2).shape == ()
    assert height_at(dem, np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)
    assert np.isnan(height_at(dem, [2.01, np.nan, np.inf], 0.0)).all()
    np.testing.assert_array_equal(height_at(dem, [-2.0, 2.0], [2.0, -2.0]), 1.5)


@given(st.integers(0, 10_000))
def test_pick_is_the_first_hit_of_any_ray(seed):
    dem = rough(seed, holes=0.2)
    mesh = triangulate(dem)
    rng = np.random.default_rng(seed)
    west, south, east, north = dem.geometry.bounds
    origins = rng.uniform((west - 2, south - 2, -2), (east + 2, north + 2, 3), size=(25, 3))
    aims = rng.uniform((west, south, -0.5), (east, north, 0.5), size=(25, 3))
    aims[:8, 2] = origins[:8, 2] + rng.normal(scale=1e-3, size=8)  # grazing
    origins[:8, 2] = rng.uniform(-0.4, 0.4, 8)
    aims[8:12] = origins[8:12] - np.array([0.0, 0.0, 1.0])  # straight down
    directions = aims - origins
    expected = all_ray_hits(mesh, origins, directions)
    for o, d, t in zip(origins, directions, expected, strict=True):
        point = pick(dem, o, d)
        if np.isinf(t):
            assert point is None
        else:
            assert point is not None
            np.testing.assert_allclose(point, o + t * d, atol=1e-8)


def test_pick_agrees_with_embree_on_many_rays(rng):
    dem = rough(5, rows=60, cols=80, resolution=0.05, holes=0.01)
    mesh = triangulate(dem)
    scene = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    west, south, east, north = dem.geometry.bounds
    origins = rng.uniform((west - 2, south - 2, 2), (east + 2, north + 2, 5), size=(400, 3))
    directions = rng.uniform((west, south, -0.5), (east, north, 0.5), size=(400, 3)) - origins
    where, ray, _ = scene.ray.intersects_location(origins, directions, multiple_hits=False)
    hits = {int(r): p for r, p in zip(ray, where, strict=True)}
    close = 0
    for i, (o, d) in enumerate(zip(origins, directions, strict=True)):
        point = pick(dem, o, d)
        if point is None:
            close += i not in hits
        else:
            close += i in hits and np.allclose(point, hits[i], atol=1e-4)
    assert len(hits) > 200
    assert close >= 398  # embree computes in single precision; rays through an edge may differ


@pytest.mark.parametrize("direction", [(1e-15, 0, -1), (1e-9, -1e-9, -1), (0, 1e-300, -1), (0, 0, -3)])
def test_pick_almost_straight_down(direction):
    dem = slope(4.0, 0.1, angle=0.3)
    point = picked(dem, (0.33, -0.2, 5.0), direction)
    np.testing.assert_allclose(point, (0.33, -0.2, 0.33 * np.tan(0.3)), atol=1e-7)


def test_pick_along_a_row_of_cells_and_beside_a_hole():
    heights = np.zeros((5, 9), np.float32)
    heights[0:2] = np.nan  # the ray along row 2 has unknown ground on its right
    dem = from_heights(heights, 1.0)
    np.testing.assert_allclose(picked(dem, (-4.0, 2.0, 1.0), (6.0, 0.0, -1.0)), (2.0, 2.0, 0.0), atol=1e-9)
    assert pick(dem, (-4.0, 1.5, 1.0), (6.0, 0.0, -1.0)) is None


def test_pick_looks_forward_only_and_through_holes():
    heights = np.zeros((9, 9), np.float32)
    heights[4, 4] = np.nan
    dem = from_heights(heights, 1.0)
    assert pick(dem, (2.0, 2.0, 1.0), (0, 0, 1)) is None
    assert pick(dem, (4.2, 4.2, 1.0), (0, 0, -1)) is None
    np.testing.assert_allclose(picked(dem, (1.5, 1.5, -1.0), (0, 0, 1)), (1.5, 1.5, 0.0))


@pytest.mark.parametrize("ray", [((0, 0, 0), (0, 0, 0)), ((0, 0, np.nan), (0, 0, 1)), ((0, 0), (0, 0, 1))])
def test_pick_refuses_no_ray(ray):
    with pytest.raises(InvalidInput):
        pick(plane(2.0, 0.5), *ray)


@given(st.integers(0, 10_000), st.floats(0.2, 2.0))
def test_crop_keeps_every_triangle_that_reaches_the_disc(seed, radius):
    dem = rough(seed)
    rng = np.random.default_rng(seed)
    west, south, east, north = dem.geometry.bounds
    center = rng.uniform((west - 1, south - 1), (east + 1, north + 1))
    whole, cut = triangulate(dem), crop(dem, center, radius)

    def names(mesh):
        return {tuple(map(tuple, t)) for t in np.round(mesh.vertices[mesh.triangles], 9)}

    assert names(cut) == names(crop(whole, center, radius))
    kept = names(cut)
    corners = whole.vertices[whole.triangles]
    weights = rng.dirichlet(np.ones(3), 40)
    inside = np.linalg.norm(weights @ corners[..., :2] - center, axis=-1).min(axis=1) <= radius
    assert all(tuple(map(tuple, t)) in kept for t in np.round(corners[inside], 9))


@given(st.floats(-1.2, 1.2), st.floats(-np.pi, np.pi), st.sampled_from([0.02, 0.1, 0.43]))
def test_normal_of_a_slope_whatever_the_cells(angle, uphill, resolution):
    dem = slope(3.0, resolution, angle=angle, uphill=uphill)
    expected = (-np.sin(angle) * np.cos(uphill), -np.sin(angle) * np.sin(uphill), np.cos(angle))
    normals = normal_at(dem, [[0.0, 0.31], [-0.2, 0.5]], 0.17, 0.242)
    assert normals.shape == (2, 2, 3)
    np.testing.assert_allclose(normals, np.broadcast_to(expected, (2, 2, 3)), atol=1e-5)


def test_normal_is_a_least_squares_plane():
    dem = rough(3, holes=0.0, resolution=0.05, rows=40, cols=40)
    x, y, radius = -0.4, 3.0, 0.25
    offset = np.arange(-5, 6) * 0.05
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    near = np.hypot(dx, dy) <= radius + 1e-9
    dx, dy = dx[near], dy[near]
    z = height_at(dem, x + dx, y + dy)
    (_, a, b), *_ = np.linalg.lstsq(np.column_stack([np.ones_like(dx), dx, dy]), z, rcond=None)
    expected = np.array([-a, -b, 1.0]) / np.linalg.norm([a, b, 1.0])
    np.testing.assert_allclose(normal_at(dem, x, y, radius), expected, atol=1e-9)


@given(st.integers(0, 10_000), st.floats(0.0, 0.5))
def test_normals_of_many_places_are_least_squares_planes_of_what_is_known(seed, holes):
    dem, radius = rough(seed, holes=holes, resolution=0.05, rows=20, cols=20, x0=0.0, y0=0.0), 0.13
    x, y = np.random.default_rng(seed).uniform(-0.1, 1.05, (2, 6))
    offset = np.arange(-4, 5) * (radius / 4)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    near = np.hypot(dx, dy) <= radius + 1e-9
    for one_x, one_y, normal in zip(x, y, normal_at(dem, x, y, radius), strict=True):
        z = height_at(dem, one_x + dx[near], one_y + dy[near])
        known = np.isfinite(z)
        if known.mean() < 0.5:
            assert np.isnan(normal).all()
        elif np.isfinite(normal).all():
            columns = np.column_stack([np.ones(known.sum()), dx[near][known], dy[near][known]])
            (_, a, b), *_ = np.linalg.lstsq(columns, z[known], rcond=None)
            np.testing.assert_allclose(normal, np.array([-a, -b, 1.0]) / np.linalg.norm([a, b, 1.0]), atol=1e-8)


@given(st.integers(0, 1500), st.integers(0, 10_000))
def test_sums_are_those_of_numpy_to_the_bit(count, seed):
    values = np.random.default_rng(seed).normal(size=count)
    assert added(values) == values.sum()


def test_normal_is_unknown_where_little_is_known():
    heights = np.zeros((41, 41), np.float32)
    heights[:, 21:] = np.nan
    dem = from_heights(heights, 0.05)
    assert np.isfinite(normal_at(dem, 1.0, 1.0, 0.25)).all()  # half of the disc
    assert np.isnan(normal_at(dem, 1.2, 1.0, 0.25)).all()
    assert np.isnan(normal_at(dem, 50.0, 50.0, 0.25)).all()
    heights[:, 18:] = np.nan
    heights[:, :17] = np.nan
    strip = from_heights(heights, 0.05)
    assert np.isnan(normal_at(strip, 0.85, 1.0, 0.25)).all()
    with pytest.raises(InvalidInput):
        normal_at(dem, 0, 0, 0.0)
