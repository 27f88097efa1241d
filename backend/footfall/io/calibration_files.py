"""Calibration of stereo pairs from files: FootFall's own YAML and ROS ``camera_info`` (docs/calibration.md)."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import transform
from footfall.io.image_files import LEVEL_FORWARD
from footfall.io.plain_yaml import parse_yaml
from footfall.telemetry.calibration import CameraModel, PairCalibration

FORMAT, VERSION = "footfall-calibration", 1

_ROS_MODELS = {
    "plumb_bob": "plumb_bob",
    "rational_polynomial": "rational",
    "equidistant": "fisheye",
    "fisheye": "fisheye",
}
_MOST_BYTES = 1 << 20
_CAMERA_KEYS = ("image_size", "intrinsics", "model", "distortion", "T_base_camera", "T_left_camera")


def read_calibration(path: str | Path) -> tuple[PairCalibration, ...]:
    """All pairs of a FootFall calibration file, in order. Raises InvalidImages naming the file, pair and field."""
    found, left_out = read_usable_calibrations(path)
    for reason in left_out.values():
        raise InvalidImages(reason)
    return tuple(found.values())


def read_usable_calibrations(path: str | Path) -> tuple[dict[str, PairCalibration], dict[str, str]]:
    """The pairs of a FootFall calibration file by name, and what is wrong with each other one.

    Raises InvalidImages, naming the file, where it is no such file.
    """
    path = Path(path)
    raw = parsed_file(path)
    if raw.get("format") != FORMAT or raw.get("version") != VERSION:
        raise InvalidImages(f"{path.name}: needs `format: {FORMAT}` and `version: {VERSION}` (see docs/calibration.md)")
    only(raw, ("format", "version", "pairs"), path.name)
    pairs = raw.get("pairs")
    if not isinstance(pairs, dict) or not pairs:
        raise InvalidImages(f"{path.name}: `pairs` must hold at least one pair by its name")
    found: dict[str, PairCalibration] = {}
    left_out: dict[str, str] = {}
    for name, body in pairs.items():
        try:
            found[name] = _pair(f"{path.name}, pair {name}", name, body)
        except InvalidImages as err:
            left_out[name] = err.message
    return found, left_out


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
    # both rectified frames are parallel; the projection holds −f·B in its fourth column
    baseline = one.shift - other.shift
    if not baseline > 0:
        raise InvalidImages(
            f"{right.name}: the baseline must be above zero, the projection matrices of {left.name} and {right.name} "
            f"make it {baseline:.4f} m; are the files swapped, or is this no stereo calibration?",
            pair=name,
        )
    R_left_right = one.rectification.T @ other.rectification
    T_left_right = transform(R_left_right, one.rectification.T @ [baseline, 0.0, 0.0])
    return PairCalibration(name, one.model(f"{name} left", T_left), other.model(f"{name} right", T_left @ T_left_right))


class _Info:
    """One camera_info file, in the spelling of files (``camera_matrix``) or of messages (``K``, ``k``)."""

    def __init__(self, path: Path) -> None:
        self.where = path.name
        raw = parsed_file(path)
        self.width = _whole(_either(raw, self.where, "image_width", "width"), f"{self.where}: image_width")
        self.height = _whole(_either(raw, self.where, "image_height", "height"), f"{self.where}: image_height")
        self.K = self._matrix(raw, (3, 3), "camera_matrix", "K", "k")
        ros_model = _either(raw, self.where, "distortion_model")
        if ros_model not in _ROS_MODELS:
            raise InvalidImages(
                f"{self.where}: the distortion model {ros_model!r} is unknown; known are {', '.join(_ROS_MODELS)}"
            )
        self.distortion = self._matrix(raw, None, "distortion_coefficients", "D", "d")
        self.kind = _ROS_MODELS[ros_model]
        self.rectification = _rotation(
            self._matrix(raw, (3, 3), "rectification_matrix", "R", "r"), f"{self.where}: rectification_matrix"
        )
        P = self._matrix(raw, (3, 4), "projection_matrix", "P", "p")
        if not P[0, 0] > 0:
            raise InvalidImages(f"{self.where}: projection_matrix needs a focal length above zero")
        self.shift = float(P[0, 3] / P[0, 0])

    def model(self, name: str, T_base_camera: NDArray[np.float64]) -> CameraModel:
        K = self.K
        if np.abs(K[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > 1e-9 or abs(K[2, 2] - 1.0) > 1e-9:
            raise InvalidImages(f"{self.where}: camera_matrix must be [fx, 0, cx, 0, fy, cy, 0, 0, 1]")
        size, intrinsics = (self.width, self.height), (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        return _model(self.where, name, size, intrinsics, self.kind, self.distortion, T_base_camera)

    def _matrix(self, raw: dict[str, Any], shape: tuple[int, int] | None, *names: str) -> NDArray[np.float64]:
        body = _either(raw, self.where, *names)
        data = body.get("data") if isinstance(body, dict) else body
        return numbers(data, shape, f"{self.where}: {names[0]}")


def _pair(where: str, name: str, body: Any) -> PairCalibration:
    if not isinstance(body, dict):
        raise InvalidImages(f"{where}: needs `left` and `right`", pair=name)
    only(body, ("left", "right"), where)
    for side in ("left", "right"):
        if not isinstance(body.get(side), dict):
            raise InvalidImages(f"{where}: the calibration of the {side} camera is missing", pair=name)
        only(body[side], _CAMERA_KEYS, f"{where}, {side}")
    if "T_left_camera" in body["left"]:
        raise InvalidImages(f"{where}, left: T_left_camera belongs to the right camera", pair=name)
    given = [key for key in ("T_base_camera", "T_left_camera") if key in body["right"]]
    if len(given) != 1:
        raise InvalidImages(f"{where}, right: needs its pose, either T_base_camera or T_left_camera", pair=name)
    T_left = LEVEL_FORWARD
    if "T_base_camera" in body["left"]:
        T_left = pose_from(body["left"]["T_base_camera"], f"{where}, left: T_base_camera")
    T_right = pose_from(body["right"][given[0]], f"{where}, right: {given[0]}")
    if given[0] == "T_left_camera":
        T_right = T_left @ T_right
    left = _camera(f"{where}, left", f"{name} left", body["left"], T_left)
    right = _camera(f"{where}, right", f"{name} right", body["right"], T_right)
    return PairCalibration(name, left, right)


def _camera(where: str, name: str, body: dict[str, Any], T_base_camera: NDArray[np.float64]) -> CameraModel:
    size = _either(body, where, "image_size")
    if not isinstance(size, list) or len(size) != 2:
        raise InvalidImages(f"{where}: image_size must be [width, height]")
    width, height = (_whole(one, f"{where}: image_size") for one in size)
    fx, fy, cx, cy = numbers(_either(body, where, "intrinsics"), (1, 4), f"{where}: intrinsics [fx, fy, cx, cy]")[0]
    model = _either(body, where, "model")
    distortion = numbers(body.get("distortion", []), None, f"{where}: distortion")
    return _model(where, name, (width, height), (fx, fy, cx, cy), model, distortion, T_base_camera)


def _model(
    where: str,
    name: str,
    size: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
    model: Any,
    distortion: NDArray[np.float64],
    T_base_camera: NDArray[np.float64],
) -> CameraModel:
    try:
        fx, fy, cx, cy = intrinsics
        return CameraModel(name, *size, fx, fy, cx, cy, str(model), distortion, T_base_camera)
    except InvalidInput as err:
        raise InvalidImages(f"{where}: {err.message}", **err.details) from err


def parsed_file(path: Path) -> dict[str, Any]:
    """The mapping that a small YAML file holds. Raises InvalidImages naming the file."""
    if not path.is_file():
        raise InvalidImages(f"there is no calibration file {path}")
    if path.stat().st_size > _MOST_BYTES:
        raise InvalidImages(f"{path.name} is larger than 1 MiB: no calibration file")
    try:
        return parse_yaml(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as err:
        raise InvalidImages(f"{path.name} is no text file") from err
    except InvalidInput as err:
        raise InvalidImages(f"{path.name}: {err.message}", **err.details) from err


def only(raw: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    """Raise InvalidImages for keys that are not ``known``."""
    strange = [key for key in raw if key not in known]
    if strange:
        raise InvalidImages(f"{where}: {', '.join(strange)} is unknown here; known are {', '.join(known)}")


def _either(raw: dict[str, Any], where: str, *names: str) -> Any:
    for name in names:
        if raw.get(name) is not None:
            return raw[name]
    raise InvalidImages(f"{where}: {names[0]} is missing")


def _whole(number: Any, where: str) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or number < 1:
        raise InvalidImages(f"{where} must be a whole number above zero, not {number!r}")
    return number


def numbers(given: Any, shape: tuple[int, int] | None, where: str) -> NDArray[np.float64]:
    """Finite numbers of a list or a list of rows; ``shape`` None: one row of any length."""
    flat: list[Any] = []
    for one in given if isinstance(given, list) else [None]:
        flat += one if isinstance(one, list) else [one]
    if any(isinstance(one, bool) or not isinstance(one, (int, float)) for one in flat):
        raise InvalidImages(f"{where} must be a list of numbers")
    if not np.isfinite(flat).all():
        raise InvalidImages(f"{where} has a number that is not finite")
    if shape is None:
        return np.array(flat, float)
    if len(flat) != shape[0] * shape[1]:
        raise InvalidImages(f"{where} needs {shape[0] * shape[1]} numbers, not {len(flat)}")
    return np.array(flat, float).reshape(shape)


def pose_from(given: Any, where: str) -> NDArray[np.float64]:
    """A pose, (4, 4), its rotation made exact. Raises InvalidImages, saying ``where``."""
    T = numbers(given, (4, 4), where)
    if not np.allclose(T[3], [0.0, 0.0, 0.0, 1.0], atol=1e-9):
        raise InvalidImages(f"{where}: the last row must be 0 0 0 1")
    return transform(_rotation(T[:3, :3], where), T[:3, 3])


def _rotation(R: NDArray[np.float64], where: str) -> NDArray[np.float64]:
    """The nearest rotation to one that was written with few digits."""
    U, _, V = np.linalg.svd(R)
    nearest = U @ V
    if np.abs(nearest - R).max() > 1e-3 or np.linalg.det(nearest) < 0:
        raise InvalidImages(f"{where} is no rotation")
    return nearest
