"""`footfall terrain`: from folders of calibrated pairs, blended with ground from elsewhere, as a collision mesh."""

# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportArgumentType=false, reportCallIssue=false

import json

import numpy as np
import pytest

from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.planning.body.stand import stand
from footfall.sim.render import render_snapshot
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.telemetry.link_state import state_object
from footfall.telemetry.photographs import PhotographedPair
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from tests.support import yard
from tests.support.command_line import run

QUICK = ["--resolution", 0.04, "--half-size", 3.0, "--matcher", "3way"]


@pytest.fixture(scope="module")
def ground():
    return rock_field(12.0, 0.04, smallest=0.1, largest=0.5, seed=5)


@pytest.fixture(scope="module")
def folder(ground, tmp_path_factory):
    """Three pairs; the right image of the last is lost."""
    made = tmp_path_factory.mktemp("yard")
    yard.write(made, [yard.photograph(ground, name) for name in yard.PLACES])
    (made / "images" / "west_right.png").unlink()
    return made


@pytest.fixture(scope="module")
def built(folder):
    out = folder / "dem.tif"
    asked = ["terrain", "build", "--images", folder / "images", "--calibration", folder / "calibration.yaml", *QUICK]
    return out, json.loads(run(*asked, "--out", out, "--json").stdout)


def test_a_folder_of_pairs_becomes_a_geotiff_that_remembers(built, ground):
    out, about = built
    assert about["sources"] == ["east", "north"]
    assert about["left_out"] == {"west": "pair west: the right image is missing (west_right.png)"}
    assert about["written"] == str(out)
    dem = read_terrain(out)
    assert dem.remembers
    assert dem.sources == ("east", "north")
    off = dem.heights - height_at(ground, dem.geometry.xs[None, :], dem.geometry.ys[:, None])
    assert np.nanmedian(np.abs(off)) < 0.01
    # the errors are of the size that the variances say
    assert 0.1 < np.nanmedian(np.abs(off) / np.sqrt(dem.variance)) < 3.0


def test_other_endings_and_chosen_cameras(folder):
    asked = ["terrain", "build", "--images", folder / "images", "--calibration", folder / "calibration.yaml", *QUICK]
    run(*asked, "--cameras", "east", "--out", folder / "east.npz")
    dem = read_terrain(folder / "east.npz")
    assert dem.remembers
    assert dem.sources == ("east",)
    assert dem.texture is not None
    run("terrain", "convert", folder / "east.npz", folder / "east.ply")
    assert b"property uchar red" in (folder / "east.ply").read_bytes()[:600]
    again = read_terrain(folder / "east.ply", resolution=0.04)
    assert (
        np.nanmax(np.abs(again.heights - height_at(dem, again.geometry.xs[None, :], again.geometry.ys[:, None]))) < 1e-3
    )
    shown = run(*asked, folder / "all.asc").stdout
    assert "left out west: pair west: the right image is missing" in shown


def test_what_can_not_be_built_is_said(folder, tmp_path):
    images, calibration, out = folder / "images", folder / "calibration.yaml", tmp_path / "a.tif"
    for arguments, says in (
        (["--images", images, "--out", out], "--calibration"),
        (["--images", images, "--calibration", calibration], "--out"),
        (["--images", images, "--calibration", calibration, "--out", tmp_path / "a.doc"], "must end in"),
        (["--images", images, "--calibration", calibration, "--out", out, "--cameras", "up"], "there is no pair up"),
        (["--images", images, "--calibration", calibration, "--out", out, "--cameras", "west"], "no image pair"),
        (["--images", images, "--calibration", calibration, "--out", out, "--robot", "athlete"], "--state"),
        (["--images", images / "none", "--calibration", calibration, "--out", out], "there is no folder"),
        ([folder, "--out", out, "--cameras", "east"], "belong to --images"),
        (["--out", out], "BUNDLE"),
        ([], "--out"),
    ):
        result = run("terrain", "build", *arguments, code=2)
        assert says in result.stderr, result.stderr
    assert not out.exists()


def test_a_rover_whose_cameras_see_itself_is_taken_out(athlete, ground, tmp_path):
    state = stand(athlete, ground)
    (taken,) = render_snapshot(athlete, state, ground, pairs=["haz0"], scale=0.5).pairs
    cameras = (
        CameraModel(c.name, c.width, c.height, c.fx, c.fy, c.cx, c.cy, "none", np.zeros(0), c.T_base_camera)
        for c in (taken.camera_left, taken.camera_right)
    )
    rig = PairCalibration("haz0", *cameras)
    yard.write(tmp_path, [PhotographedPair("haz0", rig, taken.left, taken.right, 0.0, None, taken.T_site_base)])
    (tmp_path / "images" / "pairs.yaml").unlink()
    (tmp_path / "state.json").write_text(json.dumps(state_object(state)))
    asked = ["terrain", "build", "--images", tmp_path / "images", "--calibration", tmp_path / "calibration.yaml"]
    asked += [*QUICK, "--out", tmp_path / "a.npz"]
    run(*asked, "--robot", "athlete", "--state", tmp_path / "state.json")
    without = read_terrain(tmp_path / "a.npz")
    off = without.heights - height_at(ground, without.geometry.xs[None, :], without.geometry.ys[:, None])
    # the pose of the pair is that of the state, as pairs.yaml says nothing else
    assert np.nanmedian(np.abs(off)) < 0.02
    # the edges of rocks stand a cell off; legs would stand out by much more
    assert np.nanquantile(off, 0.999) < 0.25
    (tmp_path / "state.json").write_text("{}")
    run(*asked, "--robot", "athlete", "--state", tmp_path / "state.json", code=2)


def test_ground_from_orbit_under_the_map(built, ground, tmp_path):
    """Coarse, from another zero, in coordinates of its own: as a DEM from orbit is."""
    out, _ = built
    x = np.arange(-12, 13) * 0.5
    heights = height_at(ground, x[None, :], x[:, None])
    orbit = from_heights(heights - 2600.0, 0.5, 354_000.0 - 6.0, 7_200_000.0 - 6.0, "orbit")
    write_terrain(orbit, tmp_path / "orbit.tif")
    asked = ["terrain", "blend", out, tmp_path / "orbit.tif", "--out", tmp_path / "both.tif", "--origin", 354_000]
    about = json.loads(run(*asked, 7_200_000, "--level", "--reach", 4, "--deviation", 0.3, "--json").stdout)
    assert "orbit.tif" in about["sources"]
    local, both = read_terrain(out), read_terrain(tmp_path / "both.tif")
    assert np.isfinite(both.heights).mean() > 0.95 > np.isfinite(local.heights).mean()
    off = both.heights - height_at(ground, both.geometry.xs[None, :], both.geometry.ys[:, None])
    assert np.nanquantile(np.abs(off), 0.95) < 0.15
    assert both.variance is not None
    # beyond the local map, which reaches 3 m
    assert np.nanmax(both.variance[:5]) == pytest.approx(0.09, rel=1e-5)
    run("terrain", "blend", out, tmp_path / "orbit.tif", "--out", tmp_path / "no.tif", code=2)
    run("terrain", "blend", tmp_path / "orbit.tif", out, "--out", tmp_path / "no.tif", code=2)


def test_a_collision_mesh_with_its_error(built, tmp_path):
    out, _ = built
    mesh = tmp_path / "mesh.ply"
    asked = ["terrain", "collision", out, "--out", mesh, "--raise", 0.15, "--tolerance", 0.02]
    about = json.loads(run(*asked, "--json").stdout)
    assert about["error"] <= 0.02
    assert about["triangles"] < about["triangles_before"]
    # the surface of the file itself
    dem, seen = read_terrain(out), read_terrain(mesh, resolution=0.04)
    above = seen.heights - height_at(dem, seen.geometry.xs[None, :], seen.geometry.ys[:, None])
    above = above[np.isfinite(above)]
    assert above.min() > 0.15 - 1e-4
    assert above.max() < 0.15 + about["error"] + 1e-4
    assert "triangles" in run(*asked).stdout
    run(*asked[:-1], 0, code=2)
    run("terrain", "collision", out, "--out", tmp_path / "mesh.tif", code=2)


def test_pairs_are_refined_together_where_asked(folder, tmp_path):
    asked = ["terrain", "build", "--images", folder / "images", "--calibration", folder / "calibration.yaml", *QUICK]
    about = json.loads(run(*asked, "--refine", "--out", tmp_path / "a.tif", "--json").stdout)
    assert "refined" in about["name"]
    images = folder / "images"
    pair = [
        images / "east_left.png",
        images / "east_right.png",
        tmp_path / "b.tif",
        "--calibration",
        tmp_path / "c.json",
    ]
    assert "several pairs" in run("terrain", "build", *pair, "--refine", code=2).stderr
