"""A mesh is read as finely as its detail asks, its height error is measured, told, and bounded."""

import json

import numpy as np
import pytest
import trimesh
from scipy.spatial import Delaunay
from typer.testing import CliRunner

from footfall.cli import app
from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.io.terrain_files import decode_terrain
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.mesh_terrain import height_error, terrain_of_mesh
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate


def mesh(vertices, faces):
    return Mesh(np.array(vertices, float), np.array(faces, np.int32))


def strips(xs, zs, depth):
    """Ground that only changes along x: quads between stations, which may stand over one another (walls)."""
    vertices = [(x, y, z) for x, z in zip(xs, zs, strict=True) for y in (0.0, depth)]
    quads = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(xs) - 1)]
    return mesh(vertices, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def ridges():
    """200 m of flat ground with ridges 1 m high and 1 m wide every 20 m."""
    xs = np.concatenate([np.array([0.0, 9.5, 10.0, 10.5]) + 20 * i for i in range(10)] + [[200.0]])
    zs = np.concatenate([[0.0, 0.0, 1.0, 0.0]] * 10 + [[0.0]])
    return strips(xs, zs, 20.0)


def stair(rise=0.2, tread=0.3, steps=8):
    xs = np.repeat(np.arange(steps + 1), 2)[1:-1] * tread
    return strips(xs, np.repeat(np.arange(steps), 2) * rise, 2.0)


def test_ridges_between_large_cells_are_refused_and_the_resolution_named_that_would_do():
    with pytest.raises(InvalidTerrain, match=r"cells of 20 m.*--resolution") as told:
        terrain_of_mesh(ridges(), 20.0, "ridges.ply")
    at, enough = told.value.details["at"], told.value.details["resolution"]
    assert at[0] % 20.0 == pytest.approx(10.0, abs=0.3), "not on a ridge"
    assert f"worst at ({at[0]:.2f}, {at[1]:.2f})" in told.value.message
    in_feet = Mesh(ridges().vertices / 0.3048, ridges().triangles)
    with pytest.raises(InvalidTerrain) as told:
        terrain_of_mesh(in_feet, 20.0 / 0.3048, "ridges.ply", unit=0.3048)
    assert told.value.details["at"][0] % 20.0 == pytest.approx(10.0, abs=0.3), "the place is not in metres"
    dem = terrain_of_mesh(ridges(), enough, "ridges.ply")
    assert error_of(dem).p95 <= 0.1
    assert dem.heights.max() > 0.9


def error_of(dem):
    assert dem.height_error is not None
    return dem.height_error


def test_the_cells_follow_the_mesh():
    dem = terrain_of_mesh(ridges(), None, "ridges.ply")
    assert dem.geometry.resolution <= 0.5
    assert dem.heights.max() > 0.95
    assert error_of(dem).p95 <= 0.02


def test_a_stair_stays_a_stair():
    dem = terrain_of_mesh(stair(), None, "stair.ply")
    # the middle of each tread is level and the riser is not spread over it
    middles = 0.3 * (np.arange(8) + 0.5)
    for aside in (-0.1, 0.0, 0.1):
        assert height_at(dem, middles + aside, 1.0) == pytest.approx(0.2 * np.arange(8), abs=1e-6)
    assert error_of(dem).p95 <= 0.02
    # somewhere on a wall the two differ by more, and that is told
    assert 0.05 < error_of(dem).most <= 0.2 + 1e-6
    with pytest.raises(InvalidTerrain, match=r"--resolution 0\."):
        terrain_of_mesh(stair(), 0.3, "stair.ply")


def test_a_stair_on_a_large_floor_stays_one_too():
    steps = stair(steps=4)
    count = len(steps.vertices)
    east, west = 1.2 + 6.0, -6.0
    floor = [
        (west, 0, 0),
        (0, 0, 0),
        (0, 2, 0),
        (west, 2, 0),
        (1.2, 0, 0.6),
        (east, 0, 0.6),
        (east, 2, 0.6),
        (1.2, 2, 0.6),
    ]
    whole = mesh(
        np.concatenate([steps.vertices, floor]),
        np.concatenate([steps.triangles, count + np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])]),
    )
    dem = terrain_of_mesh(whole, None, "floor.ply")
    for aside in (-0.09, 0.0, 0.09):
        assert height_at(dem, 0.3 * (np.arange(4) + 0.5) + aside, 1.0) == pytest.approx(0.2 * np.arange(4), abs=1e-6)


def test_a_post_between_the_cells_is_missed_by_nobody():
    flat = strips([0.0, 1.0, 2.0, 3.0, 4.0], [0.0] * 5, 4.0)
    post = trimesh.creation.cone(radius=0.03, height=0.5)
    both = mesh(
        np.concatenate([flat.vertices, post.vertices + np.array([1.52, 1.48, 0.0])]),
        np.concatenate([flat.triangles, post.faces + len(flat.vertices)]),
    )
    with pytest.raises(InvalidTerrain, match=r"details of 0\.\d+ m are lost"):
        terrain_of_mesh(both, 0.2, "post.ply")
    assert terrain_of_mesh(both, None, "post.ply").heights.max() > 0.3


def test_a_grid_cut_along_the_other_diagonal_counts(rng):
    dem = from_heights(rng.normal(size=(30, 40)) * 0.1, 0.5)
    same = triangulate(dem)
    told = height_error(same, dem)
    assert told.most < 1e-6
    rows, cols = np.mgrid[:29, :39].reshape(2, -1)
    sw = rows * 40 + cols
    turned = np.concatenate([np.column_stack([sw, sw + 1, sw + 40]), np.column_stack([sw + 1, sw + 41, sw + 40])])
    other = height_error(Mesh(same.vertices, turned.astype(np.int32)), dem)
    # in the middle of a block the two diagonals differ by half of what their ends' sums do
    z = dem.heights.astype(float)
    middles = np.abs(z[:-1, :-1] + z[1:, 1:] - z[1:, :-1] - z[:-1, 1:]) / 2
    assert other.most == pytest.approx(middles.max(), abs=1e-6)
    assert 0.0 < other.p95 < other.most


def test_the_error_is_what_rays_meet(rng):
    """Second method: trimesh's rays at points of its own choice."""
    xy = rng.uniform(0, 6, (400, 2))
    xy[:4] = [(0, 0), (6, 0), (0, 6), (6, 6)]
    z = 0.3 * np.sin(2 * xy[:, 0]) * np.cos(xy[:, 1])
    surface = mesh(np.column_stack([xy, z]), Delaunay(xy).simplices)
    dem = terrain_of_mesh(surface, 0.5, "scattered.ply", most_error=1.0)
    solid = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    points = rng.uniform(0.0, 6.0, (9000, 2))
    origins = np.column_stack([points, np.full(len(points), 9.0)])
    met, ray, _ = solid.ray.intersects_location(origins, np.tile([0.0, 0.0, -1.0], (len(points), 1)))
    off = np.abs(height_at(dem, *points[ray].T) - met[:, 2])
    assert error_of(dem).p95 == pytest.approx(np.nanpercentile(off, 95), rel=0.1)
    assert np.nanmax(off) <= error_of(dem).most * 1.05


def test_far_from_the_origin_the_error_is_the_same():
    near, far = stair(), stair()
    far = Mesh(far.vertices + np.array([500_000.0, 5_180_919.0, 0.0]), far.triangles)
    told = [error_of(terrain_of_mesh(one, 0.02, "stair.ply")) for one in (near, far)]
    assert told[0].p95 == pytest.approx(told[1].p95, abs=2e-3)


def test_every_door_tells_it(tmp_path):
    path = tmp_path / "stair.obj"
    solid = stair()
    path.write_text(trimesh.Trimesh(solid.vertices / 0.3048, solid.triangles, process=False).export(file_type="obj"))
    dem = decode_terrain(path.read_bytes(), path.name, scale=0.3048)
    assert error_of(dem).p95 <= 0.02
    run = CliRunner()
    told = run.invoke(app, ["terrain", "info", str(path), "--scale", "0.3048", "--json"])
    assert json.loads(told.stdout)["height_error"] == {"p95": error_of(dem).p95, "most": error_of(dem).most}
    told = run.invoke(app, ["terrain", "info", str(path), "--scale", "0.3048"])
    assert "of the mesh's own surface" in told.stdout
    args = ["terrain", "info", str(path), "--scale", "0.3048", "--resolution", "0.3"]
    assert run.invoke(app, args).exit_code == 2
    assert run.invoke(app, [*args, "--most-error", "0.5"]).exit_code == 0


def as_obj(solid):
    return str(solid.export(file_type="obj")).encode()


@pytest.mark.parametrize("axis", "xy")
def test_a_mesh_that_lies_on_its_side_is_refused_by_name(axis, rng):
    """As programs of animation write it, y up."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 8.0, 33), np.linspace(0.0, 6.0, 25)))
    z = np.round(rng.uniform(0.0, 0.3, len(x)), 3)
    faces = Delaunay(np.column_stack([x, y])).simplices
    upright = trimesh.Trimesh(np.column_stack([x, y, z]), faces, process=False)
    if upright.face_normals[:, 2].sum() < 0:
        upright.invert()
    assert decode_terrain(as_obj(upright), "m.obj", most_error=9.0).heights.size
    turned = {"y": [x, z, -y], "x": [z, x, y]}[axis]
    lying = trimesh.Trimesh(np.column_stack(turned), upright.faces, process=False)
    with pytest.raises(InvalidTerrain, match=f"{axis} seems to be up"):
        decode_terrain(as_obj(lying), "m.obj", most_error=9.0)


def test_a_cliff_is_not_taken_for_ground_on_its_side():
    """70° over all its height, with a ledge: its faces look up, wherever one looks from."""
    xs, zs = np.array([0.0, 1.0, 1.5, 2.5]), np.array([0.0, 2.7, 2.7, 5.4])
    cliff = trimesh.Trimesh(strips(xs, zs, 8.0).vertices, strips(xs, zs, 8.0).triangles, process=False)
    dem = decode_terrain(as_obj(cliff), "c.obj", most_error=1.0)
    assert np.nanmax(dem.heights) == pytest.approx(5.4, abs=0.3)
