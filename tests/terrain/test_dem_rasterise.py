"""Meshes seen from above."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane
from footfall.terrain.ground.rasterise import rasterise
from footfall.terrain.ground.resample import resample, square_cells
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate


def mesh_of(solid):
    return Mesh(np.asarray(solid.vertices, float), np.asarray(solid.faces, np.int32))


@given(st.integers(0, 10_000))
def test_a_triangulated_map_comes_back(seed):
    rng = np.random.default_rng(seed)
    heights = rng.normal(size=(8, 11)).astype(np.float32)
    heights[4, rng.integers(3, 8)] = np.nan
    dem = from_heights(heights, 0.1, -3.0, 7.0)
    back = rasterise(triangulate(dem))
    assert back.geometry.shape == dem.geometry.shape
    assert back.geometry.resolution == pytest.approx(0.1)
    np.testing.assert_allclose(back.heights, dem.heights, atol=1e-5)


@given(st.integers(0, 10_000))
def test_heights_are_what_vertical_rays_meet(seed):
    """Scattered triangulated points against trimesh's rays, in generic position."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 3, size=(40, 2))
    triangles = Delaunay(points).simplices
    vertices = np.column_stack([points, rng.normal(scale=0.3, size=40)])
    dem = rasterise(Mesh(vertices, triangles.astype(np.int32)), 0.083)
    solid = trimesh.Trimesh(vertices, triangles, process=False)
    xy = dem.geometry.centers().reshape(-1, 2)
    origins = np.column_stack([xy, np.full(len(xy), 5.0)])
    where, ray, _ = solid.ray.intersects_location(origins, np.tile([0.0, 0, -1], (len(xy), 1)), multiple_hits=False)
    expected = np.full(len(xy), np.nan)
    expected[ray] = where[:, 2]
    both = np.isfinite(expected) & np.isfinite(dem.heights.ravel())
    # single precision rays may lose cells that lie on the outline
    assert (np.isfinite(expected) != np.isfinite(dem.heights.ravel())).sum() <= 3
    steep = np.abs(expected[both] - dem.heights.ravel()[both])
    assert np.quantile(steep, 0.99) < 1e-4


def test_winding_does_not_matter():
    mesh = triangulate(fractal(2.0, 0.1))
    turned = Mesh(mesh.vertices, np.ascontiguousarray(mesh.triangles[:, ::-1]))
    np.testing.assert_array_equal(rasterise(turned).heights, rasterise(mesh).heights)


@pytest.mark.parametrize(
    "solid",
    [
        trimesh.creation.icosphere(subdivisions=3),
        trimesh.creation.box((1, 1, 1)),
        trimesh.creation.cylinder(radius=1, height=2),
        trimesh.creation.torus(1.0, 0.3),
    ],
)
def test_closed_solids_are_no_surface(solid):
    with pytest.raises(InvalidTerrain, match="not a surface"):
        rasterise(mesh_of(solid), 0.05)


def test_a_wall_points_and_a_roof_are_no_surface():
    wall = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]]), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(InvalidTerrain, match="vertical"):
        rasterise(wall)
    with pytest.raises(InvalidTerrain, match="no triangles"):
        rasterise(Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32)))
    ground = triangulate(plane(2.0, 0.1))
    roof = ground.vertices + np.array([0.0, 0.0, 1.0])
    both = Mesh(np.vstack([ground.vertices, roof]), np.vstack([ground.triangles, ground.triangles + len(roof)]))
    with pytest.raises(InvalidTerrain, match="not a surface"):
        rasterise(both)


def test_a_rock_on_the_ground_is_a_surface():
    ground = triangulate(plane(4.0, 0.1))
    rock = trimesh.creation.icosphere(radius=0.4)
    both = Mesh(
        np.vstack([ground.vertices, rock.vertices]),
        np.vstack([ground.triangles, rock.faces + len(ground.vertices)]).astype(np.int32),
    )
    dem = rasterise(both, 0.05)
    assert height_at(dem, 0.0, 0.0) == pytest.approx(0.4, abs=0.01)


def test_stairs_are_a_surface_though_their_risers_stand_on_cell_centres():
    vertices, triangles = [], []
    for i in range(6):
        for x0, z0, x1, z1 in ((i, i, i + 1, i), (i + 1, i, i + 1, i + 1)):  # tread, riser
            n = len(vertices)
            vertices += [(x0, 0, z0), (x1, 0, z1), (x1, 5, z1), (x0, 5, z0)]
            triangles += [(n, n + 1, n + 2), (n, n + 2, n + 3)]
    dem = rasterise(Mesh(np.array(vertices, float), np.array(triangles, np.int32)), 1.0)
    np.testing.assert_array_equal(dem.heights[2], [0, 1, 2, 3, 4, 5, 5])


def test_limits_of_size():
    mesh = triangulate(plane(4.0, 0.5))
    with pytest.raises(InvalidTerrain, match="coarser"):
        rasterise(mesh, 1e-4)
    with pytest.raises(InvalidTerrain):
        rasterise(mesh, -1.0)


def test_resampling_keeps_to_the_surface():
    dem = fractal(4.0, 0.1, seed=3)
    for resolution in (0.037, 0.25):
        new = resample(dem, resolution)
        x, y = np.moveaxis(new.geometry.centers(), -1, 0)
        np.testing.assert_allclose(new.heights, height_at(dem, x, y), atol=1e-6)
    np.testing.assert_array_equal(resample(dem, 0.1).heights, dem.heights)


def test_square_cells_reproduce_a_plane():
    rows, cols = 7, 9
    y, x = np.mgrid[:rows, :cols]
    oblong = 0.3 * x * 0.5 - 0.2 * y * 0.4
    square = square_cells(oblong, 0.5, 0.4, 0.1)
    v, u = np.mgrid[: square.shape[0], : square.shape[1]] * 0.1
    np.testing.assert_allclose(square, 0.3 * u - 0.2 * v, atol=1e-9)
