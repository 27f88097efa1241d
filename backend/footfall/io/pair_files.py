"""A photographed, rectified stereo pair with its calibration as one JSON file."""

import math
from pathlib import Path
from typing import Any

from footfall.core.errors import InvalidImages
from footfall.core.json_object import JsonObject
from footfall.core.misread import place_of
from footfall.core.strict_json import read_json
from footfall.io.calibration_files import require_plausible_baseline
from footfall.io.image_files import read_pair
from footfall.io.other_calibrations import PAIR, refuse_other_calibration
from footfall.telemetry.images import ImagePair

NEEDED = ("focal_length", "cx", "cy", "baseline")
OPTIONAL = ("doffs", "T_base_camera", "T_site_base", "name", "time")
_MOST_BYTES = 1 << 20


def read_calibrated_pair(left: str | Path, right: str | Path, calibration: str | Path) -> ImagePair:
    """Two rectified images and the JSON object of their calibration: the arguments of :func:`read_pair`.

    Raises InvalidImages naming the file and the member.
    """
    path = Path(calibration)
    members = _read_object(path)
    _require_calibration(members, path.name)
    return read_pair(left, right, **members)


def _read_object(path: Path) -> JsonObject:
    if not path.is_file():
        raise InvalidImages(f"there is no calibration file {path}")
    content = path.read_bytes()
    if len(content) > _MOST_BYTES:
        raise InvalidImages(f"{path.name} is too large for a calibration: {len(content)} bytes")
    refuse_other_calibration(content.decode("utf-8", "replace"), path.name, PAIR)
    try:
        members = read_json(content)
    except (ValueError, RecursionError) as err:
        raise InvalidImages(f"{path.name} is no JSON{place_of(err)}") from err
    if not isinstance(members, dict):
        raise InvalidImages(f"{path.name} needs an object with {', '.join(NEEDED)}")
    return members


def _require_calibration(members: JsonObject, name: str) -> None:
    missing = [member for member in NEEDED if member not in members]
    unknown = sorted(set(members) - {*NEEDED, *OPTIONAL})
    if missing or unknown:
        raise InvalidImages(
            f"{name} needs {', '.join(NEEDED)} and may have {', '.join(OPTIONAL)}; "
            f"missing: {', '.join(missing) or 'nothing'}, not known: {', '.join(unknown) or 'nothing'}",
            missing=missing,
            unknown=unknown,
        )
    for member in (*NEEDED, "doffs", "time"):
        if member in members and not _is_number(members[member]):
            raise InvalidImages(f"{name}: {member} needs to be a finite number", member=member)
    for member in ("T_base_camera", "T_site_base"):
        if member in members and not _is_matrix(members[member]):
            raise InvalidImages(f"{name}: {member} needs four rows of four finite numbers", member=member)
    require_plausible_baseline(members["baseline"], f"{name}: baseline")
    if not isinstance(members.get("name", ""), str):
        raise InvalidImages(f"{name}: name needs to be text", member="name")


def _is_number(item: Any) -> bool:
    return type(item) in (int, float) and math.isfinite(item)


def _is_matrix(item: Any) -> bool:
    return (
        isinstance(item, list)
        and len(item) == 4
        and all(isinstance(row, list) and len(row) == 4 and all(map(_is_number, row)) for row in item)
    )
