"""Terrain from photographed pairs of cameras that are not a rover's."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidImages
from footfall.io.photograph_files import read_photographs
from footfall.telemetry.photographs import Photographs
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from footfall.terrain.pairs.stereo import require_rectified
from footfall.terrain.photographs import rectified, terrain_from_photographs
from footfall.terrain.terrain_settings import TerrainSettings
from tests.support import yard

SETTINGS = TerrainSettings(resolution=0.04, half_size=3.0, matcher="3way")


@pytest.fixture(scope="module")
def ground():
    return rock_field(12.0, 0.04, smallest=0.1, largest=0.5, seed=5)


@pytest.fixture(scope="module")
def taken(ground) -> Photographs:
    return Photographs(tuple(yard.photograph(ground, name, i) for i, name in enumerate(yard.PLACES)))


@pytest.fixture(scope="module")
def dem(taken):
    return terrain_from_photographs(taken, SETTINGS)


def error(dem, ground) -> np.ndarray:
    off = dem.heights - height_at(ground, dem.geometry.xs[None, :], dem.geometry.ys[:, None])
    return np.abs(off[np.isfinite(off)])


def test_all_pairs_are_rectified_and_make_one_map(dem, taken, ground):
    pairs, left_out = rectified(taken, SETTINGS)
    for pair in pairs:
        require_rectified(pair)
    assert not left_out
    assert dem.name == "images, 3 pairs"
    assert dem.sources == tuple(yard.PLACES)
    assert set(np.unique(dem.source)) == {0, 1, 2, 3}
    assert dict(dem.provenance.parents) == {"photographs": taken.digest}
    assert np.isfinite(dem.heights).mean() > 0.25
    assert np.median(error(dem, ground)) < 0.01
    assert np.quantile(error(dem, ground), 0.95) < 0.04


def test_a_folder_gives_the_same_map(dem, taken, tmp_path):
    yard.write(tmp_path, list(taken.pairs))
    read = read_photographs(tmp_path / "images", [tmp_path / "calibration.yaml"], list(yard.PLACES))
    again = terrain_from_photographs(read, SETTINGS)
    known = np.isfinite(dem.heights) & np.isfinite(again.heights)
    assert known.sum() > 0.99 * np.isfinite(dem.heights).sum()
    assert np.abs(dem.heights - again.heights)[known].max() < 1e-3


def test_pairs_can_be_refined_together_first(taken, ground):
    refined = terrain_from_photographs(taken, SETTINGS, refined=True)
    assert "refined" in refined.name
    assert np.median(error(refined, ground)) < 0.012


def spoiled(pair, **changes):
    return replace(pair, **changes)


@pytest.mark.parametrize(
    ("changes", "brief", "says"),
    [
        ({"left": np.zeros((240, 320), np.uint8)}, "the left image is black", "can be used"),
        ({"right": np.full((240, 320), 255, np.uint8)}, "the right image is saturated", "can be used"),
        ({"right": np.zeros((240, 300), np.uint8)}, "the right image has 300 × 240 pixels", "is of 320 × 240"),
        ({"time_right": 5.5}, "the images were taken 0.500 s apart", "not synchronised"),
        ({"T_site_base": np.full((4, 4), np.nan)}, "the rover's pose needs 4 × 4 finite numbers", "pose"),
        ({"T_site_base": np.full((4, 4), 2.0)}, "the rover's pose is no rigid transform", "no rigid transform"),
    ],
)  # fmt: skip
def test_one_bad_pair_is_named_and_the_rest_is_fused(taken, changes, brief, says):
    good, bad = taken.pairs[:2]
    dem = terrain_from_photographs(Photographs((good, spoiled(bad, **changes))), SETTINGS)
    assert dem.sources == ("east",)
    assert dem.name.startswith("images, 1 pair, without north (")
    assert brief in dem.name
    assert list(dem.left_out) == ["north"]
    assert "north" in dem.left_out["north"]
    with pytest.raises(InvalidImages, match=rf"no image pair can be used: .*{says}"):
        terrain_from_photographs(Photographs((spoiled(bad, **changes),)), SETTINGS)


def test_swapped_images_are_named(taken):
    good, bad = taken.pairs[:2]
    twice = terrain_from_photographs(Photographs((good, spoiled(bad, right=bad.left))), SETTINGS)
    assert twice.left_out == {"north": "pair north: left and right are one and the same image"}
    swapped = spoiled(bad, left=bad.right, right=bad.left)
    dem = terrain_from_photographs(Photographs((good, swapped)), SETTINGS)
    assert dem.left_out == {"north": "pair north: left and right seem to be swapped: exchanged, the images match"}
    assert dem.name == "images, 1 pair, without north (left and right seem to be swapped)"


def test_what_was_left_out_before_stands_in_the_map(taken):
    before = {"south": "pair south: the right image is missing (south_right.png)"}
    dem = terrain_from_photographs(Photographs(taken.pairs[:1], before), SETTINGS)
    assert dem.name == "images, 1 pair, without south (the right image is missing)"
    assert dict(dem.left_out) == before


def test_the_skew_that_is_accepted_is_a_setting(taken):
    late = Photographs((spoiled(taken.pairs[0], time_right=5.1),))
    with pytest.raises(InvalidImages, match="not synchronised"):
        terrain_from_photographs(late, SETTINGS)
    assert terrain_from_photographs(late, replace(SETTINGS, max_skew=0.2)).sources == ("east",)


def test_a_robot_in_view_is_taken_out(athlete, rock_snapshot):
    """Images of a rover's own cameras, given as photographs, make the map that they make as its snapshot."""
    from footfall.telemetry.calibration import CameraModel, PairCalibration
    from footfall.telemetry.photographs import PhotographedPair
    from footfall.terrain.build import build_terrain

    pair = rock_snapshot.pairs[0]
    left, right = (
        CameraModel(c.name, c.width, c.height, c.fx, c.fy, c.cx, c.cy, "none", np.zeros(0), c.T_base_camera)
        for c in (pair.camera_left, pair.camera_right)
    )
    cal = PairCalibration(pair.name, left, right)
    photographs = Photographs(
        (PhotographedPair(pair.name, cal, pair.left, pair.right, pair.time, None, pair.T_site_base),)
    )
    settings = TerrainSettings(resolution=0.04)
    got = terrain_from_photographs(photographs, settings, robot=athlete, state=rock_snapshot.state)
    want = build_terrain(athlete, replace(rock_snapshot, pairs=(pair,)), settings)
    both = np.isfinite(got.heights) & np.isfinite(want.heights)
    assert both.sum() > 0.97 * np.isfinite(want.heights).sum()
    assert np.quantile(np.abs(got.heights - want.heights)[both], 0.99) < 0.01
    assert dict(got.provenance.parents) == {
        "photographs": photographs.digest, "robot": athlete.digest, "state": rock_snapshot.state.digest,
    }  # fmt: skip
