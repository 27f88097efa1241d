"""Simplified collision meshes: the error that is stated holds everywhere, and nothing dips below the ground."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.sim.raycast import RayScene
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, rock_field, slope
from footfall.terrain.ground.simplified import _collapsed, height_differences, simplified
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.ground.views import CollisionView, collision_view


def holed(dem: Dem, rng: np.random.Generator, holes: int) -> Dem:
    heights = dem.heights.copy()
    row, col = np.mgrid[: heights.shape[0], : heights.shape[1]]
    for _ in range(holes):
        r, c = rng.integers(0, heights.shape[0]), rng.integers(0, heights.shape[1])
        heights[np.hypot(row - r, col - c) < rng.integers(1, 9)] = np.nan
    return replace(dem, heights=heights)


def heights_from_above(mesh: Mesh, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """By ray casting, in single precision: an independent look at the mesh. NaN where it is not."""
    scene = RayScene([mesh])
    down = np.tile([0.0, 0.0, -1.0], (len(x), 1))
    hits = scene.first_hits(np.stack([x, y, np.full(len(x), 5.0)], axis=1), down)
    return np.where(hits.body >= 0, 5.0 - hits.distance, np.nan)


@settings(max_examples=15)
@given(
    seed=st.integers(0, 2**31),
    rocky=st.booleans(),
    holes=st.integers(0, 8),
    tolerance=st.sampled_from([0.001, 0.005, 0.02, 0.1]),
)
def test_the_stated_error_holds_at_any_point(seed, rocky, holes, tolerance):
    rng = np.random.default_rng(seed)
    make = rock_field(4.0, 0.05, smallest=0.1, largest=0.5, seed=seed) if rocky else fractal(4.0, 0.05, seed=seed)
    dem = holed(make, rng, holes)
    made = simplified(dem, tolerance)
    assert made.error <= tolerance
    west, south, east, north = dem.geometry.bounds
    x, y = rng.uniform(west, east, 4000), rng.uniform(south, north, 4000)
    truth, seen = height_at(dem, x, y), heights_from_above(made.mesh, x, y)
    known = np.isfinite(truth)
    # a ray may slip past a rim by rounding
    assert (known == np.isfinite(seen)).mean() > 0.999
    above = (seen - truth)[known & np.isfinite(seen)]
    rounding = 2e-6
    assert above.min() >= -rounding
    assert above.max() <= made.error + rounding


def test_a_plane_needs_hardly_any_triangles_and_rough_ground_keeps_its_share():
    flat = simplified(slope(8.0, 0.1, 0.2), 0.001)
    assert len(flat.mesh.triangles) < 0.1 * flat.triangles_before
    assert flat.error < 1e-6
    rocks = rock_field(8.0, 0.04, smallest=0.1, largest=0.5, seed=2)
    counts = [len(simplified(rocks, tolerance).mesh.triangles) for tolerance in (0.05, 0.01, 0.001, 1e-9)]
    assert counts == sorted(counts)
    assert counts[0] < 0.2 * counts[-1]
    assert counts[-1] == len(triangulate(rocks).triangles)


def test_fewer_triangles_than_the_rims_need_give_the_same_mesh_however_few():
    """So the library is not asked for them again."""
    whole = triangulate(rock_field(2.0, 0.1, seed=1))
    fewest = _collapsed(whole, 1)
    assert 0.15 * len(whole.triangles) < len(fewest.triangles) < len(whole.triangles)
    for asked in (8, 64, len(fewest.triangles)):
        assert _collapsed(whole, asked).digest == fewest.digest
    assert len(_collapsed(whole, len(fewest.triangles) + 20).triangles) > len(fewest.triangles)


def test_differences_are_those_of_meshes_made_by_hand(rng):
    dem = holed(from_heights(rng.normal(0, 0.05, (30, 40)), 0.1, -1.0, 2.0), rng, 3)
    whole = triangulate(dem)
    assert height_differences(dem, whole) == pytest.approx((0.0, 0.0), abs=1e-12)
    moved = whole.vertices.copy()
    moved[100, 2] += 0.07
    moved[200, 2] -= 0.02
    assert height_differences(dem, Mesh(moved, whole.triangles)) == pytest.approx((0.02, 0.07), abs=1e-12)
    # a triangle less leaves ground bare, one more covers a hole
    assert np.isinf(height_differences(dem, Mesh(whole.vertices, whole.triangles[:-40]))).all()
    full = triangulate(replace(dem, heights=np.nan_to_num(dem.heights)))
    assert np.isinf(height_differences(dem, full)).all()


def test_the_worst_may_lie_between_the_cells():
    """A ridge along the other diagonal than the triangulation's: both meshes agree at every cell, not between."""
    heights = np.array([[0.0, 1.0], [1.0, 0.0]])
    dem = from_heights(heights, 1.0)
    whole = triangulate(dem)
    at = {(round(x), round(y)): i for i, (x, y, _) in enumerate(whole.vertices)}
    other = np.array([[at[0, 0], at[1, 0], at[0, 1]], [at[1, 0], at[1, 1], at[0, 1]]], np.int32)
    below, above = height_differences(dem, Mesh(whole.vertices, other))
    assert (below, above) == pytest.approx((0.0, 1.0))


def test_it_is_made_of_a_raised_and_grown_view():
    dem = rock_field(6.0, 0.04, smallest=0.1, largest=0.5, seed=4)
    view = collision_view(dem, CollisionView(0.15, 0.1))
    made = simplified(view, 0.01)
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    seen = heights_from_above(made.mesh, x.ravel(), y.ravel())
    assert np.nanmin(seen - dem.heights.ravel()) >= 0.15 - 1e-5


def test_what_can_not_be_simplified_is_refused():
    lonely = np.full((3, 3), np.nan)
    lonely[1, 1] = 0.0
    with pytest.raises(InvalidTerrain, match="2 × 2"):
        simplified(from_heights(lonely, 0.1))
    for tolerance in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(InvalidTerrain, match="tolerance"):
            simplified(plane(), tolerance)


def test_the_same_ground_gives_the_same_mesh():
    dem = fractal(4.0, 0.05, seed=7)
    assert simplified(dem).digest == simplified(dem).digest
