"""A stereo pair from two ``camera_info`` of ROS, as files or as echoed messages (docs/calibration.md).

What a message says is taken as REP 104 and ``image_geometry`` have it: K, R, P and D are of the whole image of the
sensor, ``width`` and ``height`` its size; ``roi`` is the part of it that was taken, ``binning_x`` and ``binning_y``
by how much that was scaled down.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import transform
from footfall.io.calibration_files import (
    calibration_text,
    camera_model,
    either,
    numbers,
    only,
    require_plausible_baseline,
    rotation_from,
    whole,
)
from footfall.io.image_files import LEVEL_FORWARD
from footfall.io.other_calibrations import CAMERA_INFO, refuse_other_calibration
from footfall.io.plain_yaml import parse_messages
from footfall.telemetry.calibration import CameraModel, PairCalibration

_LENSES: dict[str, dict[int, str]] = {
    "plumb_bob": {0: "none", 4: "plumb_bob", 5: "plumb_bob"},
    "rational_polynomial": {8: "rational", 12: "rational", 14: "rational"},
    "equidistant": {4: "fisheye"},
    "fisheye": {4: "fisheye"},
    "none": {0: "none"},
}
"""Distortion model of ROS → how many numbers D may have → the model that is."""

_SPELLINGS = (
    ("image_width", "width"),
    ("image_height", "height"),
    ("camera_matrix", "K", "k"),
    ("distortion_coefficients", "D", "d"),
    ("rectification_matrix", "R", "r"),
    ("projection_matrix", "P", "p"),
)
"""Names that files and messages have for one thing."""

_ALONE = ("distortion_model", "camera_model", "binning_x", "binning_y", "roi", "header", "camera_name")
_KNOWN = (*(name for names in _SPELLINGS for name in names), *_ALONE)
_ROI = ("x_offset", "y_offset", "height", "width", "do_rectify")
_PINHOLE = "pinhole"


def read_camera_info(
    left: str | Path, right: str | Path, *, name: str | None = None, T_base_camera: ArrayLike | None = None
) -> PairCalibration:
    """A pair from the two ``camera_info`` files of a ROS stereo calibration (or ``topic echo`` of the messages).

    How the cameras stand to each other is taken from their rectification and projection matrices.
    T_base_camera: pose of the left camera, (4, 4), which ROS keeps elsewhere; by default level along +x.
    Raises InvalidImages naming the file and the field.
    """
    left, right = Path(left), Path(right)
    T_left = np.array(LEVEL_FORWARD if T_base_camera is None else T_base_camera, float)
    one, other = _Info(left), _Info(right)
    name = name or left.stem
    _require_one_calibration(one, other)
    # both rectified frames are parallel; the projection holds −f·B in its fourth column
    baseline = one.shift - other.shift
    if not baseline > 0:
        raise InvalidImages(
            f"{right.name}: the baseline must be above zero, the projection matrices of {left.name} and {right.name} "
            f"make it {baseline:z.4f} m; are the files swapped, or is this no stereo calibration?",
            pair=name,
        )
    require_plausible_baseline(baseline, f"{right.name}: projection_matrix (its fourth number is −fx × baseline)")
    R_left_right = one.rectification.T @ other.rectification
    T_left_right = transform(R_left_right, one.rectification.T @ [baseline, 0.0, 0.0])
    return PairCalibration(name, one.model(f"{name} left", T_left), other.model(f"{name} right", T_left @ T_left_right))


def _require_one_calibration(one: "_Info", other: "_Info") -> None:
    """Raise InvalidImages where the rectified images are not of one pair: its rows, and its focal length, are one."""
    for entry, (row, column) in (("fx", (0, 0)), ("fy", (1, 1)), ("cy", (1, 2))):
        ours, theirs = one.P[row, column], other.P[row, column]
        if abs(ours - theirs) > 1e-4 * one.P[1, 1]:
            raise InvalidImages(
                f"{other.where}: projection_matrix has {entry} = {theirs:g}, that of {one.where} {ours:g}; those of a "
                "stereo pair have the same: are the files of two calibrations?"
            )


class _Info:
    """One camera_info, in the spelling of files (``camera_matrix``) or of messages (``K``, ``k``)."""

    def __init__(self, path: Path) -> None:
        self.where = path.name
        raw = _one_message(path)
        only(raw, _KNOWN, self.where)
        for names in _SPELLINGS:
            given = [name for name in names if raw.get(name) is not None]
            if len(given) > 1:
                raise InvalidImages(f"{self.where}: {' and '.join(given)} are the same thing; give one of them")
        self.full = tuple(
            whole(either(raw, self.where, *names), f"{self.where}: {names[0]}") for names in _SPELLINGS[:2]
        )
        self.K = self._matrix(raw, (3, 3), *_SPELLINGS[2])
        if np.abs(self.K[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > 1e-9 or abs(self.K[2, 2] - 1.0) > 1e-9:
            raise InvalidImages(f"{self.where}: camera_matrix must be [fx, 0, cx, 0, fy, cy, 0, 0, 1]")
        self.kind, self.distortion = self._lens(raw)
        self.rectification = rotation_from(
            self._matrix(raw, (3, 3), *_SPELLINGS[4]), f"{self.where}: rectification_matrix"
        )
        self.P = self._matrix(raw, (3, 4), *_SPELLINGS[5])
        self.shift = self._shift(self.P)
        self.offset, self.size, self.binning = self._taken(raw)

    def model(self, name: str, T_base_camera: NDArray[np.float64]) -> CameraModel:
        """The camera as its images are: of the part that was taken, scaled down by the binning."""
        (bx, by), (x, y), K = self.binning, self.offset, self.K
        intrinsics = (K[0, 0] / bx, K[1, 1] / by, (K[0, 2] - x) / bx, (K[1, 2] - y) / by)
        size = (self.size[0] // bx, self.size[1] // by)
        return camera_model(self.where, name, size, intrinsics, self.kind, self.distortion, T_base_camera)

    def _lens(self, raw: Mapping[str, object]) -> tuple[str, NDArray[np.float64]]:
        ros_model = either(raw, self.where, "distortion_model")
        if not isinstance(ros_model, str) or ros_model not in _LENSES:
            raise InvalidImages(
                f"{self.where}: the distortion model {ros_model!r} is unknown; known are {', '.join(_LENSES)}"
            )
        camera = raw.get("camera_model")
        if camera is not None and camera not in (_PINHOLE, ros_model):
            raise InvalidImages(
                f"{self.where}: camera_model {camera!r} with distortion_model {ros_model!r} is not read; a camera of "
                f"ROS is {_PINHOLE}, its lens said by distortion_model"
            )
        D = self._matrix(raw, None, *_SPELLINGS[3])
        if ros_model in ("plumb_bob", "none") and not D.any():
            return "none", np.zeros(0)  # however many zeros: no lens bends by them
        counts = _LENSES[ros_model]
        if len(D) not in counts:
            raise InvalidImages(
                f"{self.where}: distortion_coefficients (D) has {len(D)} numbers; {ros_model} takes "
                f"{' or '.join(map(str, counts))} coefficients"
            )
        return counts[len(D)], D

    def _shift(self, P: NDArray[np.float64]) -> float:
        """Where the rectified camera lies along x, as P has it [m]."""
        if not (P[0, 0] > 0 and P[1, 1] > 0):
            raise InvalidImages(f"{self.where}: projection_matrix needs a focal length above zero")
        if np.abs([*P[0, 1:2], P[1, 0], *P[2, :2], P[2, 2] - 1.0, P[2, 3]]).max() > 1e-9:
            raise InvalidImages(f"{self.where}: projection_matrix must be [fx, 0, cx, Tx, 0, fy, cy, Ty, 0, 0, 1, 0]")
        if abs(P[1, 3]) > 1e-6 * P[1, 1]:
            raise InvalidImages(
                f"{self.where}: projection_matrix has Ty = {P[1, 3]:g}: the cameras stand over each other, and "
                "FootFall matches pairs side by side"
            )
        return float(P[0, 3] / P[0, 0])

    def _taken(self, raw: Mapping[str, object]) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
        """Offset and size of the part that was taken, in pixels of the whole image, and the binning."""
        bins = tuple(self._count(raw, f"binning_{axis}") or 1 for axis in "xy")
        roi = raw.get("roi")
        if not isinstance(roi, dict) and roi is not None:
            raise InvalidImages(f"{self.where}: roi must have {', '.join(_ROI)}")
        roi = roi or {}
        only(roi, _ROI, f"{self.where}, roi")
        if not isinstance(roi.get("do_rectify", False), bool):
            raise InvalidImages(f"{self.where}, roi: do_rectify must be true or false, not {roi['do_rectify']!r}")
        x, y, width, height = (self._count(roi, name, "roi: ") for name in ("x_offset", "y_offset", "width", "height"))
        if (width, height) == (0, 0) and (x, y) == (0, 0):
            width, height = self.full  # as REP 104 has it
        if not (width and height and x + width <= self.full[0] and y + height <= self.full[1]):
            raise InvalidImages(
                f"{self.where}, roi: {width} × {height} pixels from ({x}, {y}) are no part of the whole image, "
                f"{self.full[0]} × {self.full[1]}; width and height of the message are the whole image's (REP 104)"
            )
        if not self._center_is_inside():
            raise InvalidImages(
                f"{self.where}: camera_matrix has its centre at ({self.K[0, 2]:g}, {self.K[1, 2]:g}), outside of "
                f"{self.full[0]} × {self.full[1]} pixels (binning_x {bins[0]}, binning_y {bins[1]}): by REP 104 width "
                "and height are the whole image's, before binning and roi, and K is of it. Give these, or the "
                "camera_info of the images as they are, with binning 0"
            )
        return (x, y), (width, height), (bins[0], bins[1])

    def _center_is_inside(self) -> bool:
        return 0 <= self.K[0, 2] < self.full[0] and 0 <= self.K[1, 2] < self.full[1]

    def _count(self, raw: Mapping[str, object], name: str, within: str = "") -> int:
        given = raw.get(name)
        if given is None:
            return 0
        if isinstance(given, bool) or not isinstance(given, int) or given < 0:
            raise InvalidImages(f"{self.where}: {within}{name} must be a whole number, zero or more, not {given!r}")
        return given

    def _matrix(self, raw: Mapping[str, object], shape: tuple[int, int] | None, *names: str) -> NDArray[np.float64]:
        body = either(raw, self.where, *names)
        data = body
        if isinstance(body, dict):
            only(body, ("rows", "cols", "data"), f"{self.where}, {names[0]}")
            data = body.get("data")
            self._require_shape(body, shape, names[0])
        return numbers(data, shape, f"{self.where}: {names[0]}")

    def _require_shape(self, body: Mapping[str, object], shape: tuple[int, int] | None, name: str) -> None:
        said = (body.get("rows"), body.get("cols"))
        if None not in said and shape is not None and said != shape:
            raise InvalidImages(
                f"{self.where}: {name} says {said[0]} rows and {said[1]} columns; it has {shape[0]} and {shape[1]}"
            )


def _one_message(path: Path) -> dict[str, object]:
    """What a file says, once or in several messages that say the same of the camera."""
    text = calibration_text(path)
    refuse_other_calibration(text, path.name, CAMERA_INFO)
    try:
        messages = parse_messages(text)
    except InvalidInput as err:
        raise InvalidImages(f"{path.name}: {err.message}", **err.details) from err
    first = _untimed(messages[0])
    for number, one in enumerate(messages[1:], start=2):
        other = _untimed(one)
        differing = [name for name in {**first, **other} if first.get(name) != other.get(name)]
        if differing:
            raise InvalidImages(
                f"{path.name} has {len(messages)} messages, and message {number} differs from the first in "
                f"{', '.join(differing)}; give one calibration (`ros2 topic echo --once`)"
            )
    return messages[0]


def _untimed(message: dict[str, object]) -> dict[str, object]:
    """A message without when and as which it came."""
    header = message.get("header")
    if not isinstance(header, dict):
        return message
    return message | {"header": {name: item for name, item in header.items() if name not in ("seq", "stamp")}}
