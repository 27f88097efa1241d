"""Planted errors of calibration, in simulated pairs and photographs, are found, corrected or refused."""

import re

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.io.image_files import read_pair
from footfall.sim.render import render_scene
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.pairs import epipolar
from footfall.terrain.pairs.epipolar import (
    align_pair,
    estimate_rotation,
    turn_right_image,
)
from footfall.terrain.pairs.point_matches import FEWEST_MATCHES, matches
from footfall.terrain.pairs.stereo import disparity
from footfall.terrain.terrain_settings import TerrainSettings

FLOOR = np.deg2rad(0.02)
AXES = {"pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0), "roll": (0.0, 0.0, 1.0)}


@pytest.fixture(scope="module")
def scene(athlete, rock_state, rocks):
    return render_scene(athlete, rock_state, rocks)


@pytest.fixture(scope="module")
def taken(athlete, scene, rock_state):
    """(pair name, angles [deg], moved [m] in base) → the pair that a right camera so displaced takes."""
    lefts = {}

    def take(name, angles_deg=(0.0, 0.0, 0.0), moved=(0.0, 0.0, 0.0)):
        spec = athlete.description.camera_pair(name)
        left, right = spec.camera_left, spec.camera_right
        if name not in lefts:
            lefts[name] = scene.image(left, rock_state.T_site_base, np.random.default_rng([1, 0]))
        R = Rotation.from_rotvec(np.deg2rad(angles_deg)).as_matrix()
        T_base_true = frames.transform(None, moved) @ right.T_base_camera @ frames.transform(R)
        true = Camera(right.name, right.width, right.height, right.fx, right.fy, right.cx, right.cy, T_base_true)
        image = scene.image(true, rock_state.T_site_base, np.random.default_rng([1, 1]))
        return ImagePair(name, 0.0, lefts[name], image, left, right, rock_state.T_site_base)

    return take


@pytest.fixture(scope="module")
def motorcycle(shared_data) -> ImagePair:
    return read_pair(
        shared_data / "motorcycle_left.png",
        shared_data / "motorcycle_right.png",
        focal_length=994.978,
        cx=311.193,
        cy=254.877,
        baseline=0.193001,
        doffs=31.086,
        name="motorcycle",
    )


def with_right(pair: ImagePair, right: np.ndarray) -> ImagePair:
    return ImagePair(pair.name, pair.time, pair.left, right, pair.camera_left, pair.camera_right, pair.T_site_base)


@pytest.mark.parametrize("name", ["nav1", "haz1"])
@pytest.mark.parametrize("axis", list(AXES))
def test_planted_rotation_is_recovered(taken, name, axis):
    planted = 0.2 * np.array(AXES[axis])
    found = estimate_rotation(taken(name, planted))
    assert found.corrected
    assert np.abs(found.rotation - np.deg2rad(planted)).max() < FLOOR
    assert (np.abs(found.rotation - np.deg2rad(planted)) < 5 * found.uncertainty).all()
    assert found.rows_after < 0.1


def test_all_axes_together(taken):
    planted = (-0.15, 0.2, 0.1)
    found = estimate_rotation(taken("nav4", planted))
    assert np.abs(found.rotation - np.deg2rad(planted)).max() < FLOOR
    assert found.rows_before > 1.0
    assert "nav4 corrected by 0.27°" in found.text


@pytest.mark.parametrize("axis", list(AXES))
def test_one_degree_is_refused_with_its_number(taken, axis):
    with pytest.raises(InvalidImages, match=rf"nav0.* (0\.99|1\.00)° \({axis}\)") as caught:
        align_pair(taken("nav0", AXES[axis]))
    assert caught.value.details["pair"] == "nav0"


def test_a_good_pair_is_left_as_it_is(taken):
    for name in ("nav0", "haz0"):
        pair = taken(name)
        same, found = align_pair(pair)
        assert same is pair
        assert not found.corrected
        assert found.angle == 0.0
        assert np.linalg.norm(found.aside) < 0.001
        assert found.rows_after < 0.1
        assert f"{name} aligned" in found.text


def test_correction_brings_the_depths_back(taken):
    """By the matcher, an independent judge: 0.2° of yaw shift all disparities by 2 px, which correction takes back."""
    settings = TerrainSettings()
    good = disparity(taken("nav1"), settings)
    off = taken("nav1", (0.1, 0.2, 0.0))
    corrected, _ = align_pair(off)
    before = np.nanmedian(np.abs(disparity(off, settings) - good))
    after = np.nanmedian(np.abs(disparity(corrected, settings) - good))
    assert before > 1.5
    assert after < 0.2


def test_exposure_vignetting_and_noise_do_not_matter(taken):
    pair = taken("nav1", (0.0, 0.2, 0.0))
    rng = np.random.default_rng(4)
    v, u = np.mgrid[: pair.left.shape[0], : pair.left.shape[1]]
    shade = 1.0 / (1.0 + 0.3 * ((u - u.mean()) ** 2 + (v - v.mean()) ** 2) / u.mean() ** 2) ** 2

    def poor(image, gain):
        faint = 90.0 + 0.3 * (image.astype(float) - 90.0)
        return np.clip(gain * shade * faint + rng.normal(0.0, 1.5, image.shape), 0, 255).astype(np.uint8)

    hard = ImagePair(
        "nav1", 0.0, poor(pair.left, 1.0), poor(pair.right, 0.75), pair.camera_left, pair.camera_right, pair.T_site_base
    )
    found = estimate_rotation(hard)
    assert np.abs(found.rotation - np.deg2rad([0.0, 0.2, 0.0])).max() < FLOOR


@pytest.mark.parametrize("moved", [(0.005, 0.0, 0.005), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)])
def test_a_right_image_of_another_moment_is_refused(taken, moved):
    """The rover moved between the images. As the ground is nearly a plane, a turned camera would explain most of it."""
    with pytest.raises(InvalidImages, match=r"nav2: .* mm off its baseline, rows disagree by \d\.\d+ px"):
        align_pair(taken("nav2", moved=moved))


def test_rows_that_no_rotation_explains_are_refused(taken):
    """A lens's distortion that nobody took out: rows bend."""
    pair = taken("nav0")
    v, u = np.mgrid[:480, :640].astype(np.float32)
    bent = cv2.remap(pair.right, u, v + 3.0 * np.sin(u / 30.0).astype(np.float32), cv2.INTER_LINEAR)
    with pytest.raises(InvalidImages, match=r"nav0: rows disagree by [12]\.\d+ px after correction"):
        align_pair(with_right(pair, bent.astype(np.uint8)))


def test_too_few_matches_are_told(taken):
    pair = taken("nav0")
    dim = np.full_like(pair.right, 90)
    dim[200:240, 300:360] = pair.right[200:240, 300:360]
    same, found = align_pair(with_right(pair, dim))
    assert same.digest == with_right(pair, dim).digest
    assert found.matches < FEWEST_MATCHES
    assert not found.checked
    assert np.isinf(found.uncertainty).all()
    assert "not checked" in found.text
    blank = with_right(pair, np.full_like(pair.right, 90))
    assert estimate_rotation(blank).matches == 0


def test_no_yaw_is_claimed_where_it_can_not_be_seen(taken):
    """The middle of the image has no perspective: pitch and roll are found there, yaw is left alone."""
    pair = taken("nav1", (0.2, 0.2, 0.0))
    rows, cols = slice(170, 310), slice(200, 440)
    left, right = (
        Camera(c.name, 240, 140, c.fx, c.fy, c.cx - 200, c.cy - 170, c.T_base_camera)
        for c in (pair.camera_left, pair.camera_right)
    )
    found = estimate_rotation(
        ImagePair("middle", 0.0, pair.left[rows, cols], pair.right[rows, cols], left, right, pair.T_site_base)
    )
    assert found.uncertainty[1] > np.deg2rad(0.04)
    assert found.rotation[1] == 0.0
    assert abs(found.rotation[0] - np.deg2rad(0.2)) < FLOOR


def narrow(bend: float, yaw_deg: float = 0.0) -> ImagePair:
    """A plane in a view 12° wide, seen by a right camera whose rows are bent by ``bend`` px in the corners."""
    texture = cv2.GaussianBlur(np.random.default_rng(3).uniform(0, 255, (480, 900)), (0, 0), 1.5)
    texture = np.clip(128 + 6.0 * (texture - texture.mean()), 0, 255).astype(np.uint8)
    v, u = np.mgrid[:480, :640].astype(np.float32)
    left = cv2.remap(texture, u + 100, v, cv2.INTER_CUBIC)
    right = cv2.remap(texture, u + 160, v + bend * (u - 320) / 320 * (v - 240) / 240, cv2.INTER_CUBIC)
    cameras = [
        Camera(side, 640, 480, 3000.0, 3000.0, 320.0, 240.0, frames.transform(None, (x, 0.0, 0.0)))
        for side, x in (("left", 0.0), ("right", 0.2))
    ]
    pair = ImagePair("narrow", 0.0, left, right.astype(np.uint8), cameras[0], cameras[1], np.eye(4))
    return turn_right_image(pair, np.deg2rad([0.0, -yaw_deg, 0.0]))


def test_bent_rows_of_a_narrow_view_are_not_taken_for_yaw():
    """A tenth of a pixel in the corners, as good lenses leave it, would be a yaw of 0.3°: 16 px of disparity."""
    pair = narrow(0.1)
    same, found = align_pair(pair)
    assert same is pair
    assert found.rows_after < 0.1
    assert found.uncertainty[1] < np.deg2rad(0.04)  # so small a spread was no reason to claim it


@pytest.mark.parametrize(("mistaken", "accepted"), [(0.4, True), (0.7, False)])
def test_mistaken_matches_refuse_no_pair_while_they_are_the_minority(taken, monkeypatch, mistaken, accepted):
    """On a board for calibration half of the corners were joined to those a square further; rows are fine."""
    pair = taken("nav1", (0.2, 0.0, 0.0))
    left, right = matches(pair)
    rng = np.random.default_rng(5)
    drawn = rng.random(len(left))
    right[drawn < mistaken, 1] += rng.choice([-25.0, 20.0], int((drawn < mistaken).sum()))
    right[drawn > 0.8, 1] += rng.uniform(-4.0, 4.0, int((drawn > 0.8).sum()))
    monkeypatch.setattr(epipolar, "matches", lambda _: (left, right))
    if accepted:
        _, found = align_pair(pair)
        assert np.abs(found.rotation - np.deg2rad([0.2, 0.0, 0.0])).max() < FLOOR
        assert found.rows_before > 1.0 > 0.5 > found.rows_after
    else:
        with pytest.raises(InvalidImages, match=r"nav1: rows disagree by 2\d\.\d+ px"):
            align_pair(pair)


def test_the_same_pair_gives_the_same_answer(taken):
    pair = taken("haz1", (0.0, 0.0, 0.2))
    assert estimate_rotation(pair).digest == estimate_rotation(pair).digest
    assert align_pair(pair)[0].digest == align_pair(pair)[0].digest


def test_turning_there_and_back(taken):
    pair = taken("nav0")
    angles = np.deg2rad([0.2, -0.1, 0.3])
    back = turn_right_image(turn_right_image(pair, angles), -angles)
    inside = np.s_[10:-10, 10:-10]
    assert np.abs(back.right[inside].astype(int) - pair.right[inside]).mean() < 6.0


def test_matches_agree_with_the_scene(taken):
    """In a good pair no match may have a negative disparity or leave its row: an independent look at the matcher."""
    left, right = matches(taken("nav1"))
    assert len(left) > 500
    assert np.quantile(np.abs(left[:, 1] - right[:, 1]), 0.95) < 0.3
    assert np.quantile(left[:, 0] - right[:, 0], 0.02) > 0.0


@pytest.mark.parametrize(("axis", "within_deg"), [("pitch", 0.02), ("yaw", 0.08), ("roll", 0.02)])
def test_photographs(motorcycle, axis, within_deg):
    """A view 41° wide tells yaw only to some hundredths of a degree, and says so."""
    planted = np.deg2rad(0.2) * np.array(AXES[axis])
    found = estimate_rotation(turn_right_image(motorcycle, -planted))
    as_taken = estimate_rotation(motorcycle)
    assert as_taken.angle < np.deg2rad(0.05)
    i = list(AXES).index(axis)
    assert abs(found.rotation[i] - planted[i]) < np.deg2rad(within_deg)
    assert found.uncertainty[1] > 3 * found.uncertainty[[0, 2]].max()


def test_the_map_says_what_was_corrected_and_what_was_left_out(athlete, taken, rock_state):
    pairs = taken("nav0"), taken("nav3", (0.0, 0.15, 0.1)), taken("nav4", (0.0, 1.0, 0.0))
    dem = build_terrain(athlete, Snapshot(rock_state, pairs), TerrainSettings(matcher="3way"))
    assert re.fullmatch(
        r"images, 2 pairs, nav3 corrected by 0\.1[789]°, without nav4 \(turned by (0\.99|1\.00|1\.01)°\)", dem.name
    )
