"""Calibrations of cameras in formats that are not read, by what stands in them, and what makes one of them that is."""

import re

from footfall.core.errors import InvalidImages

OWN = "footfall-calibration"
"""What FootFall's own file calls its format."""

_JSON = 'JSON of one rectified pair, {"focal_length": …, "cx": …, "cy": …, "baseline": …, "doffs": …},'

_COLMAP_MODELS = "PINHOLE is none, OPENCV plumb_bob, FULL_OPENCV rational, OPENCV_FISHEYE fisheye"
_NERF = f"write {OWN}: its cameras look along -z, with y up, and the unit of its poses is unknown"
_FORMATS: tuple[tuple[str, str, str], ...] = (
    (
        "a chain of cameras of Kalibr",
        r"^cam\d+:[^\n]*\n(?:[ \t-][^\n]*\n)*?[ \t]+(?:T_cn_cnm1|camera_model|distortion_coeffs):",
        f"write {OWN}: radtan is plumb_bob, equidistant is fisheye, resolution is image_size, and T_left_camera of the "
        "right camera is the inverse of its T_cn_cnm1, which takes points from the left camera into the right one",
    ),
    (
        "a sensor of the EuRoC sets",
        r"^T_BS:",
        f"write {OWN}: radial-tangential is plumb_bob, resolution is image_size, and T_left_camera of the right camera "
        "is the inverse of the left T_BS times the right one",
    ),
    (
        "matrices of OpenCV",
        r"\A%YAML:|^[^#\n]*!!opencv-matrix|<opencv_storage>",
        f"write {OWN}: T_left_camera of the right camera is the inverse of R and T of stereoCalibrate, with T in "
        "metres, whatever the unit of the board's squares was",
    ),
    (
        "cameras or poses of COLMAP",
        r"^# *(?:Camera list with one line|Image list with two lines)"
        r"|\A\d+ (?:(?:SIMPLE_)?(?:PINHOLE|RADIAL)|(?:FULL_)?OPENCV|OPENCV_FISHEYE) \d+ \d+ ",
        f"write {OWN}: {_COLMAP_MODELS}; cx and cy are 0.5 less, as COLMAP counts from the corner of the first pixel; "
        "its poses are of the world in the camera, and their unit is unknown: the distance of the cameras has to be "
        "measured, in metres",
    ),
    (
        "a calib.txt of the Middlebury sets",
        r"^cam0 *= *\[",
        f"write {_JSON} with the first, third and sixth number of cam0, the baseline in metres, where it has "
        "millimetres, and doffs as it is",
    ),
    (
        "projections of the KITTI sets",
        r"^P(?:_rect_0)?[0-3]: ",
        f"write {_JSON} with the first, third and seventh number of P0, and baseline = −P1[3] / P1[0], in metres",
    ),
    ("poses of NeRF", r'\A\s*\{(?s:.*)"(?:fl_x|camera_angle_x)"', _NERF),
)
PAIRS, PAIR, CAMERA_INFO = f"a {OWN}", "the JSON of one rectified pair", "camera_info of one camera"
"""FootFall's own kinds, and the one of ROS that it reads."""
_READ: dict[str, tuple[str, str]] = {
    PAIRS: (rf"^format:\s*['\"]?{OWN}", "it is for a folder of pairs: --images DIR --calibration FILE"),
    PAIR: (r'\A\s*\{(?s:.*)"focal_length"', "it is for one pair: LEFT RIGHT --calibration FILE"),
    CAMERA_INFO: (
        r"^(?:image_width|camera_matrix|distortion_model|K|k):",
        "give those of both cameras, left file first: --images DIR --calibration LEFT.yaml --calibration RIGHT.yaml",
    ),
}


def refuse_other_calibration(text: str, name: str, read: str) -> None:
    """Raise InvalidImages for a calibration of another kind than the one that is read, saying what would be right.

    text: of the file. read: PAIRS, PAIR or CAMERA_INFO.
    """
    elsewhere = [(kind, sign, how) for kind, (sign, how) in _READ.items() if kind != read]
    for kind, sign, how in (*_FORMATS, *elsewhere):
        if (found := re.search(sign, text, re.MULTILINE)) is not None:
            line = 1 + text.count("\n", 0, found.start())
            raise InvalidImages(f"{name} is {kind}, as line {line} says, which is not read here; {how}", line=line)
