"""Calibration of stereo pairs from files of FootFall's own (docs/calibration.md), and what all kinds of them share."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages, InvalidInput
from footfall.core.frames import inverse, transform
from footfall.core.misread import Unreadable
from footfall.core.written import utf8_of
from footfall.io.image_files import LEVEL_FORWARD
from footfall.io.other_calibrations import OWN, PAIRS, refuse_other_calibration
from footfall.io.plain_yaml import parse_yaml
from footfall.telemetry.calibration import CameraModel, PairCalibration

FORMAT, VERSION = OWN, 1

LONGEST_BASELINE = 5.0
"""[m]; a pair farther apart sees nothing of a rover's surroundings: its length is in millimetres or centimetres."""
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
    if FORMAT not in (text := calibration_text(path)):
        refuse_other_calibration(text, path.name, PAIRS)
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


def _pair(where: str, name: str, body: object) -> PairCalibration:
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
    require_plausible_baseline(
        float(np.linalg.norm((inverse(T_left) @ T_right)[:3, 3])), f"{where}, right: {given[0]}", pair=name
    )
    left = _camera(f"{where}, left", f"{name} left", body["left"], T_left)
    right = _camera(f"{where}, right", f"{name} right", body["right"], T_right)
    return PairCalibration(name, left, right)


def _camera(where: str, name: str, body: Mapping[str, object], T_base_camera: NDArray[np.float64]) -> CameraModel:
    size = either(body, where, "image_size")
    if not isinstance(size, list) or len(size) != 2:
        raise InvalidImages(f"{where}: image_size must be [width, height]")
    width, height = (whole(one, f"{where}: image_size") for one in size)
    fx, fy, cx, cy = numbers(either(body, where, "intrinsics"), (1, 4), f"{where}: intrinsics [fx, fy, cx, cy]")[0]
    model = either(body, where, "model")
    distortion = numbers(body.get("distortion", []), None, f"{where}: distortion")
    return camera_model(where, name, (width, height), (fx, fy, cx, cy), model, distortion, T_base_camera)


def camera_model(
    where: str,
    name: str,
    size: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
    model: object,
    distortion: NDArray[np.float64],
    T_base_camera: NDArray[np.float64],
) -> CameraModel:
    """A camera from its parts. Raises InvalidImages, saying ``where``."""
    try:
        fx, fy, cx, cy = intrinsics
        return CameraModel(name, *size, fx, fy, cx, cy, str(model), distortion, T_base_camera)
    except InvalidInput as err:
        raise InvalidImages(f"{where}: {err.message}", **err.details) from err


def parsed_file(path: Path) -> dict[str, object]:
    """The mapping that a small YAML file holds. Raises InvalidImages naming the file."""
    text = calibration_text(path)
    try:
        return parse_yaml(text)
    except InvalidInput as err:
        raise InvalidImages(f"{path.name}: {err.message}", **err.details) from err


def calibration_text(path: Path) -> str:
    """The text of a small file. Raises InvalidImages naming the file."""
    if not path.is_file():
        raise InvalidImages(f"there is no calibration file {path}")
    if path.stat().st_size > _MOST_BYTES:
        raise InvalidImages(f"{path.name} is larger than 1 MiB: no calibration file")
    try:
        return utf8_of(path.read_bytes())
    except Unreadable as err:
        raise InvalidImages(f"{path.name} is no text file: {err}") from err


def require_plausible_baseline(length: float, where: str, **details: Any) -> None:
    """Raise InvalidImages, saying ``where``, for a distance of the cameras [m] that can't be in metres."""
    if length > LONGEST_BASELINE:
        raise InvalidImages(
            f"{where} makes the baseline {length:.4g} m, {LONGEST_BASELINE:g} m at most; lengths are in metres: "
            f"were they written in millimetres ({length / 1000:.4g} m) or centimetres ({length / 100:.4g} m)?",
            baseline=length,
            **details,
        )


def only(raw: Mapping[str, object], known: tuple[str, ...], where: str) -> None:
    """Raise InvalidImages for keys that are not ``known``."""
    strange = [key for key in raw if key not in known]
    if strange:
        raise InvalidImages(f"{where}: {', '.join(strange)} is unknown here; known are {', '.join(known)}")


def either(raw: Mapping[str, object], where: str, *names: str) -> object:
    """The first member of these names. Raises InvalidImages where none is there."""
    for name in names:
        if raw.get(name) is not None:
            return raw[name]
    raise InvalidImages(f"{where}: {names[0]} is missing")


def whole(number: object, where: str) -> int:
    """A whole number above zero. Raises InvalidImages."""
    if isinstance(number, bool) or not isinstance(number, int) or number < 1:
        raise InvalidImages(f"{where} must be a whole number above zero, not {number!r}")
    return number


def numbers(given: object, shape: tuple[int, int] | None, where: str) -> NDArray[np.float64]:
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


def pose_from(given: object, where: str) -> NDArray[np.float64]:
    """A pose, (4, 4), its rotation made exact. Raises InvalidImages, saying ``where``."""
    T = numbers(given, (4, 4), where)
    if not np.allclose(T[3], [0.0, 0.0, 0.0, 1.0], atol=1e-9):
        raise InvalidImages(f"{where}: the last row must be 0 0 0 1")
    return transform(rotation_from(T[:3, :3], where), T[:3, 3])


def rotation_from(R: NDArray[np.float64], where: str) -> NDArray[np.float64]:
    """The nearest rotation to one that was written with few digits."""
    U, _, V = np.linalg.svd(R)
    nearest = U @ V
    if np.abs(nearest - R).max() > 1e-3 or np.linalg.det(nearest) < 0:
        raise InvalidImages(f"{where} is no rotation")
    return nearest
