"""Calibrations of others are refused by name, with what makes one of them that is read."""

import re

import pytest

from footfall.core.errors import InvalidImages
from footfall.io.calibration_files import read_usable_calibrations
from footfall.io.camera_info import read_camera_info
from footfall.io.pair_files import read_calibrated_pair

CAMERA = "  camera_model: pinhole\n  intrinsics: [461.0, 460.0, 360.0, 240.0]\n  resolution: [752, 480]\n"
KALIBR = f"cam0:\n  cam_overlaps: [1]\n{CAMERA}cam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.11]\n{CAMERA}"
EUROC = "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0]\nrate_hz: 20\n"
OPENCV = "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n"
OPENCV_XML = '<?xml version="1.0"?>\n<opencv_storage>\n<M1 type_id="opencv-matrix">\n'
COLMAP = (
    "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL\n1 OPENCV 752 480 458 457 367 248 0 0 0 0\n"
)
COLMAP_BARE = "1 SIMPLE_RADIAL 752 480 458 367 248 0.1\n"
POSES = "# Image list with two lines of data per image:\n1 1 0 0 0 0 0 0 1 a_left.png\n\n"
MIDDLEBURY = "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\ndoffs=131.111\nbaseline=193.001\n"
KITTI = "P0: 718 0 607 0 0 718 185 0 0 0 1 0\nP1: 718 0 607 -386 0 718 185 0 0 0 1 0\n"
NERF = '{\n "fl_x": 500,\n "frames": []}'
OTHERS = [
    (KALIBR, "a chain of cameras of Kalibr.*T_left_camera of the right camera is the inverse of its T_cn_cnm1"),
    (EUROC, "a sensor of the EuRoC sets, as line 2 says.*inverse of the left T_BS times the right one"),
    (OPENCV, "matrices of OpenCV.*inverse of R and T of stereoCalibrate, with T in metres"),
    (OPENCV_XML, "matrices of OpenCV"),
    (COLMAP, "of COLMAP.*cx and cy are 0.5 less.*unit is unknown"),
    (COLMAP_BARE, "of COLMAP"),
    (POSES, "of COLMAP.*of the world in the camera"),
    (MIDDLEBURY, "Middlebury.*in metres, where it has millimetres, and doffs"),
    (KITTI, "KITTI.*baseline = −P1"),
    (NERF, "NeRF.*look along -z, with y up"),
]
PAIR = '{"focal_length": 100.0, "cx": 1.0, "cy": 1.0, "baseline": 0.1}'
INFO = "image_width: 640\nimage_height: 480\ncamera_name: left\n"
OWN = "format: footfall-calibration\nversion: 1\npairs:\n  cam0:\n    left: 1\n"


def refusals(tmp_path, text):
    """What each reader says of a calibration: of pairs in a folder, of one pair, of camera_info."""
    path = tmp_path / "some.file"
    path.write_text(text)
    readers = (
        lambda: read_usable_calibrations(path),
        lambda: read_calibrated_pair(tmp_path / "l.png", tmp_path / "r.png", path),
        lambda: read_camera_info(path, path),
    )
    for reader in readers:
        with pytest.raises(InvalidImages) as refused:
            reader()
        yield refused.value.message


@pytest.mark.parametrize(("text", "words"), OTHERS)
def test_calibrations_of_others_are_refused_by_name_by_every_reader(text, words, tmp_path):
    for said in refusals(tmp_path, text):
        assert re.search(words, said), said


def test_calibrations_that_are_read_elsewhere_say_where(tmp_path):
    folder, pair, info = refusals(tmp_path, PAIR)
    assert folder == info
    assert folder.endswith("it is for one pair: LEFT RIGHT --calibration FILE")
    assert pair.startswith("there is no image file")
    folder, pair, info = refusals(tmp_path, INFO)
    assert folder == pair
    assert folder.endswith("--images DIR --calibration LEFT.yaml --calibration RIGHT.yaml")
    assert info.startswith("some.file: camera_matrix is missing")
    path = tmp_path / "own.yaml"
    path.write_text(OWN)
    assert list(read_usable_calibrations(path)[1]) == ["cam0"]
    with pytest.raises(InvalidImages, match=r"a footfall-calibration, as line 1 .*--images DIR"):
        read_calibrated_pair(tmp_path / "l.png", tmp_path / "r.png", path)


@pytest.mark.parametrize("comment", ["# once !!opencv-matrix", "# T_BS: none", "# cam0=[1 0 0]"])
def test_what_comments_tell_changes_nothing(comment, tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(f"{comment}\n{OWN}")
    assert list(read_usable_calibrations(path)[1]) == ["cam0"]
    path.write_text(f"{comment}\n{INFO}")
    with pytest.raises(InvalidImages, match="camera_matrix is missing"):
        read_camera_info(path, path)
