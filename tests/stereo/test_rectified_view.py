"""What rectified images show: all that each camera sees, whichever road it comes by; wrong centres are named."""

import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.core.value import flatten, unflatten
from footfall.io.camera_info import read_camera_info
from footfall.io.image_files import LEVEL_FORWARD, read_pair, write_png
from footfall.io.pair_files import read_calibrated_pair
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.telemetry.photographs import PhotographedPair, Photographs
from footfall.terrain.pairs.epipolar import align_pair
from footfall.terrain.pairs.rectify import rectified_cameras, rectify
from footfall.terrain.photographs import terrain_from_pairs, terrain_from_photographs
from footfall.terrain.terrain_settings import COMMON, TerrainSettings
from tests.stereo.test_rectify import LENSES, calibration, distorted

W, H, FOCAL, CY, BASELINE = 640, 240, 400.0, 118.0, 0.2
LEFT_CX, RIGHT_CX = 270.0, 370.0
T_SITE_BASE = frames.transform(frames.rotation("y", np.deg2rad(30.0)), (0.0, 0.0, 1.2))
FILLED = 12
"""Columns that the narrower of two views may lack: both images have one width."""
SETTINGS = TerrainSettings(min_range=1.3, max_range=4.0, half_size=2.5, resolution=0.04)


def ground_seen(cx: float, side: float) -> np.ndarray:
    """Level ground under a camera 1.2 m above it that looks 30° down, from ``side`` to the right of the site's axis."""
    u, v = np.meshgrid(np.arange(W), np.arange(H))
    rays = np.stack([(u - cx) / FOCAL, (v - CY) / FOCAL, np.ones(u.shape)], -1)
    T = T_SITE_BASE @ LEVEL_FORWARD @ frames.transform(translation=(side, 0.0, 0.0))
    rays = rays @ T[:3, :3].T
    far = -T[2, 3] / np.minimum(rays[..., 2], -1e-3)
    x, y = T[0, 3] + far * rays[..., 0], T[1, 3] + far * rays[..., 1]
    waves = np.random.default_rng(2).uniform([-60, -60, 0], [60, 60, 6.28], (80, 3))
    grey = 128 + 18 * sum(np.sin(a * x + b * y + c) for a, b, c in waves) / np.sqrt(20)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def images():
    return ground_seen(LEFT_CX, 0.0), ground_seen(RIGHT_CX, BASELINE)


@pytest.fixture(scope="module")
def files(images, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    for side, image in zip(("left", "right"), images, strict=True):
        write_png(image, folder / f"{side}.png")
    return folder


def raw_calibration() -> PairCalibration:
    T_right = LEVEL_FORWARD @ frames.transform(translation=(BASELINE, 0.0, 0.0))
    left, right = (
        CameraModel(f"rig {side}", W, H, FOCAL, FOCAL, cx, CY, "none", np.zeros(0), T)
        for side, cx, T in (("left", LEFT_CX, LEVEL_FORWARD), ("right", RIGHT_CX, T_right))
    )
    return PairCalibration("rig", left, right)


def of_ros(folder) -> PairCalibration:
    text = (
        "width: {W}\nheight: {H}\ndistortion_model: plumb_bob\nd: []\nk: [{f}, 0, {cx}, 0, {f}, {cy}, 0, 0, 1]\n"
        "r: [1, 0, 0, 0, 1, 0, 0, 0, 1]\np: [{f}, 0, 300, {tx}, 0, {f}, {cy}, 0, 0, 0, 1, 0]\n---\n"
    )
    for side, cx, tx in (("l", LEFT_CX, 0.0), ("r", RIGHT_CX, -FOCAL * BASELINE)):
        (folder / f"{side}.yaml").write_text(text.format(W=W, H=H, f=FOCAL, cx=cx, cy=CY, tx=tx))
    return read_camera_info(folder / "l.yaml", folder / "r.yaml", name="rig")


def test_a_pair_covers_the_same_ground_by_every_road(images, files):
    """Two files with JSON, a folder with FootFall's own calibration, and one with ROS's; centres 100 px apart."""
    about = {"focal_length": FOCAL, "cx": LEFT_CX, "cy": CY, "baseline": BASELINE, "doffs": RIGHT_CX - LEFT_CX}
    (files / "pair.json").write_text(json.dumps(about | {"T_site_base": T_SITE_BASE.tolist(), "name": "rig"}))
    straight = read_calibrated_pair(files / "left.png", files / "right.png", files / "pair.json")
    expected = terrain_from_pairs([straight], SETTINGS, center=(2.2, 0.0))
    for road in (raw_calibration(), of_ros(files)):
        pair = rectify(road, *images, T_site_base=T_SITE_BASE)
        assert np.array_equal(pair.left, straight.left)
        assert np.array_equal(pair.right, straight.right)
        assert (pair.camera_left.cx, pair.camera_right.cx) == pytest.approx((LEFT_CX, RIGHT_CX))
        dem = terrain_from_pairs([pair], SETTINGS, center=(2.2, 0.0))
        assert np.array_equal(np.isfinite(dem.heights), np.isfinite(expected.heights))
        assert np.nanmax(np.abs(dem.heights - expected.heights)) < 1e-5
    assert np.nanmedian(np.abs(expected.heights)) < 0.01
    cropped = rectify(raw_calibration(), *images, T_site_base=T_SITE_BASE, view=COMMON)
    less = np.isfinite(terrain_from_pairs([cropped], SETTINGS, center=(2.2, 0.0)).heights).sum()
    assert less < 0.92 * np.isfinite(expected.heights).sum()


def test_what_older_versions_made_is_made_again(images):
    """Stored settings without the choice mean what was done then."""
    flat, arrays = flatten(TerrainSettings(view=COMMON))
    assert "view" not in json.dumps(flat)
    assert unflatten(flat, arrays).view == COMMON
    assert "whole" in json.dumps(flatten(TerrainSettings())[0])
    one = PhotographedPair("rig", raw_calibration(), images[0], images[1], 0.0, None, T_SITE_BASE)
    few = TerrainSettings(min_range=1.3, max_range=4.0, half_size=1.0, resolution=0.1, view=COMMON)
    dem = terrain_from_photographs(Photographs((one,), {}), few)
    cropped = rectify(raw_calibration(), *images, T_site_base=T_SITE_BASE, view=COMMON)
    assert np.array_equal(dem.heights, terrain_from_pairs([cropped], few).heights, equal_nan=True)


@pytest.mark.parametrize("lens", list(LENSES))
def test_a_view_is_as_large_as_the_lens_lets_it_be(lens):
    """By the lens models written out by hand: no pixel is empty, and a larger rectangle would have empty ones."""
    cal = calibration(lens)
    turns, cameras = rectified_cameras(cal)
    for model, R, camera in zip((cal.left, cal.right), turns, cameras, strict=True):

        def source(u, v, model=model, R=R, camera=camera):
            u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
            rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1) @ R
            x, y = distorted(
                model.model, list(model.distortion), rays[..., 0] / rays[..., 2], rays[..., 1] / rays[..., 2]
            )
            return model.fx * x + model.cx, model.fy * y + model.cy

        def is_inside(u, v, slack, source=source, model=model):
            x, y = source(u, v)
            return (x >= -slack) & (x <= model.width - 1 + slack) & (y >= -slack) & (y <= model.height - 1 + slack)

        rows, right = np.arange(camera.height), camera.width - 1
        assert is_inside(np.arange(0, camera.width - FILLED)[None, :], rows[:, None], 0.1).all()
        assert not is_inside(-2.0, rows, 0.0).all()
        assert not is_inside(right + 2.0, rows, 0.0).all()
    assert cameras[0].cy == cameras[1].cy
    assert cameras[0].height == cameras[1].height > 0.9 * cal.left.height


# --- wrong centres


def test_a_wrong_doffs_is_named(files):
    """Rows agree whatever doffs is; what would lie behind the cameras tells it."""

    def pair(doffs: float):
        return read_pair(
            files / "left.png",
            files / "right.png",
            focal_length=FOCAL,
            cx=LEFT_CX,
            cy=CY,
            baseline=BASELINE,
            doffs=doffs,
        )

    aligned, found = align_pair(pair(RIGHT_CX - LEFT_CX))
    assert found.checked
    assert aligned.camera_right.cx == RIGHT_CX
    with pytest.raises(InvalidImages, match=r"lie behind the cameras.*doffs .*here 50.0 px") as caught:
        align_pair(pair(50.0))
    assert caught.value.details["behind"] > 0.9
    with pytest.raises(InvalidImages, match="doffs"):
        terrain_from_pairs([pair(0.0)], SETTINGS)


def test_a_wrong_centre_is_a_suspect_of_a_turned_camera(images):
    """cy of the right camera 6 px off looks as if it were pitched by 6 / 400 rad."""
    cal = replace(raw_calibration(), right=replace(raw_calibration().right, cy=CY + 6.0))
    with pytest.raises(InvalidImages, match=r"turned by 0\.8\d° \(pitch\).*cy wrong by 6 px looks alike"):
        align_pair(rectify(cal, *images))
