"""camera_info of ROS: what changes the meaning of other fields is heeded as image_geometry does, or refused by name."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core.errors import InvalidImages
from footfall.io.camera_info import read_camera_info
from footfall.terrain.pairs.rectify import rectified_cameras

INFO = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [500.5, 0., 320.1, 0., 501.5, 239.2, 0., 0., 1.]
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {count}
  data: {distortion}
rectification_matrix:
  rows: 3
  cols: 3
  data: {R}
projection_matrix:
  rows: 3
  cols: 4
  data: [480., 0., 319., {shift},
         0., 480., 238., 0.,
         0., 0., 1., 0.]
"""

ECHO = """\
---
header:
  stamp:
    secs: 12
    nsecs: 0
  frame_id: "left: optical"
height: 480
width: 640
distortion_model: equidistant
d:
- 0.01
- -0.002
- 0.0003
- 0.0
k: [500.5, 0.0, 320.1, 0.0, 501.5, 239.2, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [480.0, 0.0, 319.0, %s, 0.0, 480.0, 238.0, 0.0, 0.0, 0.0, 1.0, 0.0]
roi:
  x_offset: 0
  do_rectify: false
"""

R_LEFT, R_RIGHT = (
    Rotation.from_euler("xyz", a, degrees=True).as_matrix() for a in ([0.5, 1.0, -0.2], [-0.3, 0.4, 0.6])
)


LEVEL = np.eye(3)


def info(R=LEVEL, shift=0.0, model="plumb_bob", distortion=(-0.3, 0.1, 0.0, 0.0, 0.0)) -> str:
    rows = [round(float(x), 8) for x in R.ravel()]
    return INFO.format(R=rows, shift=shift, model=model, count=len(distortion), distortion=list(distortion))


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def pair_of(folder: Path, right: str, left: str | None = None):
    """The pair of a right and a left camera_info, as texts."""
    return read_camera_info(write(folder, "left.yaml", left or info()), write(folder, "right.yaml", right))


def test_camera_info_gives_the_relative_pose(tmp_path):
    """Both cameras' rays to one far and one near point, turned by R, must fit P: ROS's own definition."""
    left = write(tmp_path, "left.yaml", info(R_LEFT))
    right = write(tmp_path, "right.yaml", info(R_RIGHT, shift=-96.0))
    pair = read_camera_info(left, right, name="mast")
    assert (pair.name, pair.left.model, pair.left.fx, pair.left.cy) == ("mast", "plumb_bob", 500.5, 239.2)
    for p_left in np.array([[0.1, 0.2, 3.0], [-1.0, 0.5, 50.0]]):
        p_right = np.linalg.inv(pair.T_left_right) @ np.r_[p_left, 1.0]
        rectified_left, rectified_right = R_LEFT @ p_left, R_RIGHT @ p_right[:3]
        assert np.allclose(rectified_left - rectified_right, [0.2, 0.0, 0.0], atol=1e-6)


def test_a_byte_order_mark_changes_nothing(tmp_path):
    marked = pair_of(tmp_path, "\ufeff" + info(shift=-96.0), "\ufeff" + info())
    assert marked.digest == pair_of(tmp_path, info(shift=-96.0)).digest


def test_camera_info_as_echoed_from_a_topic(tmp_path):
    pair = read_camera_info(write(tmp_path, "l.yaml", ECHO % "0.0"), write(tmp_path, "r.yaml", ECHO % "-48.0"))
    assert pair.left.model == "fisheye"
    assert pair.left.distortion.tolist() == [0.01, -0.002, 0.0003, 0.0]
    assert np.allclose(pair.T_left_right[:3, 3], [0.1, 0.0, 0.0])


@pytest.mark.parametrize(
    ("right", "says"),
    [
        (info(shift=0.0), "baseline must be above zero.*0.0000 m"),
        (info(shift=50.0), "swapped"),
        (info(shift=-50.0, model="thin_prism"), "thin_prism.*known are"),
        (info(shift=-50.0, model="[1, 2]"), r"\[1, 2\] is unknown; known are"),
        (info(shift=-50.0, distortion=(0.1, 0.2)), "D.* has 2 numbers; plumb_bob takes 0 or 4 or 5"),
        (info(shift=-50.0).replace("500.5", ".nan"), "camera_matrix has a number that is not finite"),
        (info(shift=-50.0).replace("500.5, 0.,", "500.5, 7.,"), r"camera_matrix must be \[fx, 0"),
        (info(shift=-50.0).replace("rectification_matrix", "other"), "other is unknown here"),
        (info(R=2 * np.eye(3), shift=-50.0), "no rotation"),
        (info(shift=-50.0).replace("image_width: 640", "image_width: 960"), "different sizes"),
        (info(shift=-50.0).replace("image_width: 640", "image_width: wide"), "whole number"),
        ("%YAML:1.0\nK: !!opencv-matrix\n", "line 1"),
        (info(shift=-50.0).replace("rows: 3", "rows: 9", 1), "says 9 rows and 3 columns; it has 3 and 3"),
        (
            info(shift=-50.0, distortion=(0.1, 0.2, 0.0, 0.0, 0.0)).replace("0.1, 0.2", "0.1,, 0.2"),
            "between two commas",
        ),
        (info(shift=-50.0).replace("500.5,", "0500,"), "camera_matrix must be a list of numbers"),
    ],
)
def test_wrong_camera_info_is_refused(tmp_path, right, says):
    with pytest.raises(InvalidImages, match=says):
        read_camera_info(write(tmp_path, "left.yaml", info()), write(tmp_path, "right.yaml", right))


@pytest.mark.parametrize(("at", "entry"), [(0, "fx"), (5, "fy"), (6, "cy")])
def test_files_of_two_calibrations_are_no_pair(tmp_path, at, entry):
    """A stereo calibration gives both rectified images one focal length and the same rows."""
    right = info(shift=-96.0)
    head, _, rest = right.partition("projection_matrix")
    before, _, numbers = rest.partition("data: [")
    values, _, after = numbers.partition("]")
    words = values.split(",")
    words[at] = f" {float(words[at]) + 5.0}"
    other = f"{head}projection_matrix{before}data: [{','.join(words)}]{after}"
    assert pair_of(tmp_path, right)
    with pytest.raises(InvalidImages, match=f"right.yaml: projection_matrix has {entry} = .*files of two calibrations"):
        pair_of(tmp_path, other)


# --- what changes the meaning of other fields


def with_fields(text: str, **fields: object) -> str:
    return text + "".join(f"{name}: {item}\n" for name, item in fields.items())


def roi(x: int, y: int, width: int, height: int) -> str:
    return f"roi:\n  x_offset: {x}\n  y_offset: {y}\n  width: {width}\n  height: {height}\n  do_rectify: true\n"


def pixels(camera, points: np.ndarray) -> np.ndarray:
    """Where a camera sees points of its own frame, by OpenCV."""
    D = np.array(camera.distortion) if camera.model != "none" else np.zeros(5)
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, D)[0][:, 0]


POINTS = np.random.default_rng(4).uniform([-0.5, -0.4, 2.0], [0.5, 0.4, 6.0], (20, 3))


def test_binning_and_region_are_of_the_whole_image(tmp_path):
    """REP 104: a pixel of the image = (a pixel of the whole image − the region's offset) / binning."""
    plain = pair_of(tmp_path, info(shift=-96.0))
    cut = "binning_x: 2\nbinning_y: 4\n" + roi(100, 40, 400, 360)
    taken = pair_of(tmp_path, info(shift=-96.0) + cut, info() + cut)
    for whole, part in ((plain.left, taken.left), (plain.right, taken.right)):
        assert (part.width, part.height) == (200, 90)
        assert np.allclose(pixels(part, POINTS), (pixels(whole, POINTS) - [100, 40]) / [2, 4], atol=1e-9)
    assert np.allclose(taken.T_left_right, plain.T_left_right)


@pytest.mark.parametrize("nothing", ["binning_x: 0\nbinning_y: 1\n", roi(0, 0, 0, 0), roi(0, 0, 640, 480)])
def test_no_binning_and_the_whole_region_change_nothing(tmp_path, nothing):
    plain, same = (pair_of(tmp_path, info(shift=-96.0) + more, info() + more) for more in ("", nothing))
    assert plain.digest == same.digest


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("binning_x: two\n", "binning_x must be a whole number"),
        ("binning_y: -2\n", "binning_y must be a whole number"),
        (roi(300, 0, 400, 480), r"roi: 400 × 480 pixels from \(300, 0\) are no part of the whole image, 640 × 480"),
        (roi(5, 0, 0, 0), "roi: 0 × 0 pixels"),
        ("roi: [0, 0, 640, 480]\n", "roi must have x_offset"),
        ("roi:\n  left: 3\n", "roi: left is unknown"),
        ("roi:\n  do_rectify: 1\n", "do_rectify must be true or false"),
        ("camera_model: omnidirectional\n", "camera_model 'omnidirectional'.*pinhole"),
        ("xi: 1.2\n", "xi is unknown here"),
        ("K: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n", "camera_matrix and K are the same thing"),
    ],
)
def test_what_would_change_the_meaning_is_refused_by_name(tmp_path, more, says):
    with pytest.raises(InvalidImages, match=f"right.yaml.*{says}"):
        pair_of(tmp_path, info(shift=-96.0) + more)


def test_a_size_after_binning_is_told(tmp_path):
    """Drivers that give the binned size with the whole sensor's K: no reading of it is sure."""
    half = info(shift=-96.0).replace("image_width: 640", "image_width: 320").replace("_height: 480", "_height: 240")
    for binning in (0, 2):
        with pytest.raises(InvalidImages, match=r"right.yaml.*centre at \(320.1, 239.2\).*binning_x .*REP 104"):
            pair_of(tmp_path, with_fields(half, binning_x=binning, binning_y=binning))


LENSES = {
    ("plumb_bob", 0): "none",
    ("none", 0): "none",
    ("plumb_bob", 4): "plumb_bob",
    ("plumb_bob", 5): "plumb_bob",
    ("rational_polynomial", 8): "rational",
    ("rational_polynomial", 12): "rational",
    ("rational_polynomial", 14): "rational",
    ("equidistant", 4): "fisheye",
}


@pytest.mark.parametrize("count", [0, 2, 4, 5, 8, 12, 14])
@pytest.mark.parametrize("model", ["plumb_bob", "none", "rational_polynomial", "equidistant"])
def test_each_number_of_coefficients_is_heeded_or_refused(tmp_path, model, count):
    D = [round(0.01 * (i + 1) * (-1) ** i, 3) for i in range(count)]
    text = info(shift=-96.0, model=model, distortion=D)
    if (model, count) not in LENSES:
        with pytest.raises(InvalidImages, match=rf"D\) has {count} numbers; {model} takes"):
            pair_of(tmp_path, text, info(model=model, distortion=D))
        return
    pair = pair_of(tmp_path, text, info(model=model, distortion=D))
    assert (pair.right.model, pair.right.distortion.tolist()) == (LENSES[model, count], D)
    rectified_cameras(pair)  # OpenCV takes them all


def test_the_sensor_s_tilt_counts(tmp_path):
    """The last two of fourteen numbers move pixels as Scheimpflug's tilt does, here against a rotation by hand."""
    tilt = 0.02
    D = [0.0] * 12 + [tilt, 0.0]
    plain, tilted = (
        pair_of(tmp_path, info(shift=-96.0, model="rational_polynomial", distortion=d)).right
        for d in ([0.0] * 13 + [1e-12], D)
    )
    x = np.c_[POINTS[:, :2] / POINTS[:, 2:], np.ones(len(POINTS))]
    R = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])
    seen = x @ (np.array([[R[2, 2], 0, -R[0, 2]], [0, R[2, 2], -R[1, 2]], [0, 0, 1]]) @ R).T
    seen = seen[:, :2] / seen[:, 2:] * [tilted.fx, tilted.fy] + [tilted.cx, tilted.cy]
    assert np.allclose(pixels(tilted, POINTS), seen, atol=1e-6)
    assert np.abs(pixels(tilted, POINTS) - pixels(plain, POINTS)).max() > 0.1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("-96.0", "-96000.0", r"projection_matrix .*baseline 200 m.*millimetres \(0.2 m\)"),
        ("         0., 480., 238., 0.", "         0., 480., 238., -48.", "Ty = -48: the cameras stand over each other"),
        ("         0., 480., 238., 0.", "         3., 480., 238., 0.", r"projection_matrix must be \[fx, 0, cx"),
    ],
)
def test_projections_that_mean_something_else_are_refused(tmp_path, old, new, says):
    text = info(shift=-96.0)
    assert old in text
    with pytest.raises(InvalidImages, match=f"right.yaml.*{says}"):
        pair_of(tmp_path, text.replace(old, new))


# --- what the tools print

ROS2_ECHO = """\
header:
  stamp:
    sec: {sec}
    nanosec: 5
  frame_id: cam
height: 240
width: 320
distortion_model: plumb_bob
d: []
k:
- 250.0
- 0.0
- {cx}
- 0.0
- 250.0
- 120.0
- 0.0
- 0.0
- 1.0
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [250.0, 0.0, 160.0, {tx}, 0.0, 250.0, 120.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""


def echoed(tx: float, *seconds: int, cx: float = 160.0) -> str:
    return "".join(ROS2_ECHO.format(sec=sec, tx=tx, cx=cx) for sec in seconds)


@pytest.mark.parametrize("seconds", [(7,), (7, 8, 9)])
def test_echoed_messages_end_in_dashes(tmp_path, seconds):
    """The text that `ros2 topic echo` prints: `---` behind each message, which differ by their stamps alone."""
    pair = pair_of(tmp_path, echoed(-50.0, *seconds), echoed(0.0, *seconds))
    assert (pair.left.model, pair.left.cx) == ("none", 160.0)
    assert pair.T_left_right[0, 3] == pytest.approx(0.2)


def test_messages_that_differ_are_refused(tmp_path):
    text = echoed(-50.0, 7) + echoed(-50.0, 8) + echoed(-50.0, 9, cx=161.0)
    with pytest.raises(InvalidImages, match=r"right.yaml has 3 messages, and message 3 differs from the first in k;"):
        pair_of(tmp_path, text, echoed(0.0, 7))
    cut = echoed(-50.0, 7, 8).split("  do_rectify")
    with pytest.raises(InvalidImages, match="message 2 differs from the first in roi"):
        pair_of(tmp_path, "  do_rectify".join(cut[:2]) + cut[2].removeprefix(": false\n"), echoed(0.0, 7))
