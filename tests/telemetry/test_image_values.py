"""What cameras, pairs and snapshots refuse, and the baseline."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import rotation_rpy, transform
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState

STATE = RobotState("athlete", 0.0, np.zeros(36), np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")


def camera(**change):
    fields = {
        "name": "front-left",
        "width": 8,
        "height": 6,
        "fx": 10.0,
        "fy": 10.0,
        "cx": 3.5,
        "cy": 2.5,
        "T_base_camera": np.eye(4),
    }
    return Camera(**(fields | change))


def pair(baseline=0.2, T_base_left=None, **change):
    T_base_left = np.eye(4) if T_base_left is None else T_base_left
    fields = {
        "name": "front",
        "time": 0.0,
        "left": np.zeros((6, 8), np.uint8),
        "right": np.zeros((6, 8), np.uint8),
        "camera_left": camera(T_base_camera=T_base_left),
        "camera_right": camera(T_base_camera=T_base_left @ transform(translation=(baseline, 0, 0))),
        "T_site_base": np.eye(4),
    }
    return ImagePair(**(fields | change))


@given(st.floats(0.01, 2.0), st.tuples(*[st.floats(-3, 3)] * 3))
def test_the_baseline_does_not_depend_on_where_the_cameras_look(baseline, angles):
    T_base_left = transform(rotation_rpy(*angles), (1.0, -2.0, 3.0))
    assert pair(baseline, T_base_left).baseline == pytest.approx(baseline, abs=1e-12)


@pytest.mark.parametrize("baseline", [0.0, -0.2])
def test_swapped_or_coinciding_cameras_are_refused(baseline):
    with pytest.raises(InvalidImages, match="right camera"):
        pair(baseline)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"width": 0}, "size"),
        ({"height": -1}, "size"),
        ({"fx": 0.0}, "focal"),
        ({"fy": -5.0}, "focal"),
        ({"fx": np.nan}, "focal"),
        ({"fy": np.inf}, "finite intrinsics"),
        ({"cx": np.nan}, "finite intrinsics"),
        ({"cy": np.inf}, "finite intrinsics"),
        ({"T_base_camera": 2 * np.eye(4)}, "T_base_camera of front-left"),
        ({"T_base_camera": np.eye(3)}, "T_base_camera of front-left"),
        ({"T_base_camera": None}, "T_base_camera"),
    ],
    ids=lambda one: next(iter(one)) if isinstance(one, dict) else "",
)
def test_impossible_cameras_are_refused(change, text):
    with pytest.raises(InvalidInput, match=text):
        camera(**change)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"left": np.zeros((8, 6), np.uint8)}, "left image"),
        ({"right": np.zeros((6, 7), np.uint8)}, "right image"),
        ({"left": np.zeros((6, 8, 3), np.uint8)}, "left image"),
        ({"right": np.zeros((6, 8), np.float32)}, "right image is float32"),
        ({"left": np.zeros((6, 8), bool)}, "left image is bool"),
        ({"T_site_base": np.zeros((4, 4))}, "T_site_base"),
        ({"left": None}, "left"),
    ],
    ids=range(7),
)
def test_images_that_do_not_fit_their_camera_are_refused(change, text):
    with pytest.raises(InvalidInput, match=text):
        pair(**change)


def test_a_snapshot_needs_a_pair():
    assert Snapshot(STATE, (pair(),)).pairs[0].name == "front"
    with pytest.raises(InvalidImages, match="at least one"):
        Snapshot(STATE, ())


def test_one_pixel_changes_the_digest():
    image = np.zeros((6, 8), np.uint8)
    image[3, 4] = 1
    assert pair().digest != pair(left=image).digest != pair(right=image).digest
