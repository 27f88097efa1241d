"""A folder of photographed stereo pairs: ``NAME_left.png``, ``NAME_right.png`` and, where wanted, ``pairs.yaml``.

The layout and the files are described in docs/calibration.md.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.io.calibration_files import (
    numbers,
    only,
    parsed_file,
    pose_from,
    read_usable_calibrations,
)
from footfall.io.camera_info import read_camera_info
from footfall.io.image_files import IMAGE_ENDINGS, claimed_pixels, read_image
from footfall.telemetry.calibration import PairCalibration
from footfall.telemetry.photographs import PhotographedPair, Photographs

FORMAT, VERSION = "footfall-pairs", 1
PAIRS_FILE = "pairs.yaml"

MAX_PAIRS = 64
MAX_IMAGE_BYTES = 64 << 20
MAX_PIXELS = 400_000_000
"""Of all images together."""

_SIDES = ("left", "right")
_UNREAD = (".bmp", ".webp", ".gif", ".jp2", ".exr", ".heic", ".dng", ".raw")
"""Endings of pictures that are taken note of where none that can be read is there: so that their pair is named."""
_KEYS = ("calibration", "time", "time_right", "T_site_base")


class SaidOfPair(TypedDict, total=False):
    """What ``pairs.yaml`` says of one pair. calibration: the name of another pair's cameras, which took it."""

    time: float
    time_right: float
    T_site_base: NDArray[np.float64]
    calibration: str


def pair_and_side(file: str) -> tuple[str, str] | None:
    """Pair name and side that an image file's name says; None where it is no image of a pair."""
    return _pair_and_side(Path(file), IMAGE_ENDINGS)


def _pair_and_side(path: Path, endings: Sequence[str]) -> tuple[str, str] | None:
    name, _, side = path.stem.rpartition("_")
    side = side.lower()
    return (name, side) if name and side in _SIDES and path.suffix.lower() in endings else None


def read_photographs(
    folder: str | Path,
    calibration: Sequence[str | Path],
    names: Sequence[str] | None = None,
    T_site_base: NDArray[np.float64] | None = None,
) -> Photographs:
    """The pairs of a folder, or those of ``names``, with their calibrations.

    T_site_base: where those were taken of which ``pairs.yaml`` does not say it, (4, 4); by default identity.
    calibration: one file of FootFall's own, or left and right ``camera_info`` of ROS. A pair that lacks an image, a
    readable one, a calibration or a finite pose is left out, by its name. Raises InvalidImages where the folder or the
    calibration can't be used at all, there is too much of it, or no pair is left.
    """
    folder = Path(folder)
    files = _files(folder)
    chosen = sorted(files) if names is None else list(names)
    unknown = [name for name in chosen if name not in files]
    if unknown:
        raise InvalidImages(
            f"there is no pair {', '.join(unknown)} in {folder.name}; there are {', '.join(sorted(files))}"
        )
    if len(chosen) > MAX_PAIRS:
        raise InvalidImages(f"{len(chosen)} pairs are more than {MAX_PAIRS}; name the ones wanted", limit=MAX_PAIRS)
    rigs, bad_rigs = _calibrations(calibration)
    about, left_out = _about(folder / PAIRS_FILE, chosen)
    pairs: list[PhotographedPair] = []
    pixels = 0
    for name in chosen:
        if name in left_out:
            continue
        said = about.get(name, {})
        try:
            rig = _rig(name, said.get("calibration"), rigs, bad_rigs)
            left, right = (_image(name, side, files[name][side]) for side in _SIDES)
        except InvalidImages as err:
            left_out[name] = err.message
            continue
        pixels += left.size + right.size
        if pixels > MAX_PIXELS:
            raise InvalidImages(f"the images have more than {MAX_PIXELS} pixels together; name fewer pairs", pair=name)
        pose = said.get("T_site_base", np.eye(4) if T_site_base is None else T_site_base)
        pairs.append(PhotographedPair(name, rig, left, right, said.get("time", 0.0), said.get("time_right"), pose))
    pairs, without_place = _require_places(pairs, about)
    return Photographs(tuple(pairs), left_out | without_place)


def pixels_in(folder: str | Path, names: Sequence[str] | None = None) -> int:
    """How many pixels :func:`read_photographs` would unpack at most, by the heads of the images."""
    found = _files(Path(folder))
    sides = [files for name in (found if names is None else names) for files in found.get(name, {}).values()]
    return sum(claimed_pixels(file.read_bytes()) for files in sides for file in files)


def _files(folder: Path) -> dict[str, dict[str, list[Path]]]:
    if not folder.is_dir():
        raise InvalidImages(f"there is no folder {folder}")
    found: dict[str, dict[str, list[Path]]] = {}
    for endings in (IMAGE_ENDINGS, _UNREAD):
        for path in sorted(folder.iterdir()):
            which = _pair_and_side(path, endings)
            if which is not None:
                there = found.setdefault(which[0], {side: [] for side in _SIDES})[which[1]]
                if endings is IMAGE_ENDINGS or not there:
                    there.append(path)
    if not found:
        raise InvalidImages(
            f"there is no image pair in {folder.name}; a pair is NAME_left.png and NAME_right.png "
            f"(or {', '.join(ending for ending in IMAGE_ENDINGS if ending != '.png')})"
        )
    return found


def _image(name: str, side: str, files: list[Path]) -> np.ndarray:
    if len(files) != 1:
        what = (
            f"is missing ({name}_{side}.png)" if not files else f"is there twice ({', '.join(f.name for f in files)})"
        )
        raise InvalidImages(f"pair {name}: the {side} image {what}", pair=name)
    if files[0].stat().st_size > MAX_IMAGE_BYTES:
        raise InvalidImages(f"pair {name}: {files[0].name} is larger than {MAX_IMAGE_BYTES >> 20} MiB", pair=name)
    try:
        return read_image(files[0])
    except InvalidImages as err:
        raise InvalidImages(f"pair {name}: {err.message}", pair=name) from err


def _calibrations(files: Sequence[str | Path]) -> tuple[dict[str, PairCalibration], dict[str, str]]:
    if len(files) == 1:
        return read_usable_calibrations(files[0])
    if len(files) == 2:
        rig = read_camera_info(*files)
        return {rig.name: rig}, {}
    raise InvalidImages(
        f"needs one calibration file of FootFall, or the left and the right camera_info of ROS, not {len(files)} files"
    )


def _rig(name: str, said: str | None, rigs: dict[str, PairCalibration], bad: dict[str, str]) -> PairCalibration:
    """The calibration of a pair: the one that it names, or of its own name, or the only one there is."""
    only_one = next(iter(rigs | bad), None) if len(rigs) + len(bad) == 1 else None
    wanted = said or (name if name in rigs or name in bad else only_one) or name
    if wanted in bad:
        raise InvalidImages(f"pair {name}: {bad[wanted]}", pair=name)
    if wanted not in rigs:
        raise InvalidImages(f"pair {name}: there is no calibration {wanted}; there are {', '.join(rigs)}", pair=name)
    return rigs[wanted]


def _about(path: Path, chosen: Sequence[str]) -> tuple[dict[str, SaidOfPair], dict[str, str]]:
    """What ``pairs.yaml`` says of each pair, and what is wrong with what it says of others."""
    if not path.is_file():
        return {}, {}
    raw = parsed_file(path)
    if raw.get("format") != FORMAT or raw.get("version") != VERSION:
        raise InvalidImages(f"{path.name}: needs `format: {FORMAT}` and `version: {VERSION}` (see docs/calibration.md)")
    only(raw, ("format", "version", "pairs"), path.name)
    bodies = raw.get("pairs")
    if not isinstance(bodies, dict):
        raise InvalidImages(f"{path.name}: `pairs` must say something of pairs by their names")
    about: dict[str, SaidOfPair] = {}
    left_out: dict[str, str] = {}
    for name in chosen:
        if name in bodies:
            try:
                about[name] = _one(f"pair {name}: {path.name}", bodies[name])
            except InvalidImages as err:
                left_out[name] = err.message
    return about, left_out


def _time(given: object, where: str) -> float:
    return float(numbers([given], (1, 1), where)[0, 0])


def _one(where: str, body: object) -> SaidOfPair:
    if not isinstance(body, dict):
        raise InvalidImages(f"{where}: needs some of {', '.join(_KEYS)}")
    only(body, _KEYS, where)
    said: SaidOfPair = {}
    if "time" in body:
        said["time"] = _time(body["time"], f"{where}: time")
    if "time_right" in body:
        said["time_right"] = _time(body["time_right"], f"{where}: time_right")
    if "T_site_base" in body:
        said["T_site_base"] = pose_from(body["T_site_base"], f"{where}: T_site_base")
    if "calibration" in body:
        if not isinstance(body["calibration"], str):
            raise InvalidImages(f"{where}: calibration must be the name of one")
        said["calibration"] = body["calibration"]
    return said


def _require_places(
    pairs: Sequence[PhotographedPair], about: dict[str, SaidOfPair]
) -> tuple[list[PhotographedPair], dict[str, str]]:
    """The pairs whose place is known, and why each other one is left out.

    One rig can't have taken two pairs at one place: that would lay their grounds over each other. Where it bears the
    name of one of them, the others have no calibration of their own. Raises InvalidImages where that does not tell.
    """
    placed: list[PhotographedPair] = []
    left_out: dict[str, str] = {}
    unplaced: dict[str, list[PhotographedPair]] = {}
    for pair in pairs:
        if "T_site_base" in about.get(pair.name, {}):
            placed.append(pair)
        else:
            unplaced.setdefault(pair.calibration.digest, []).append(pair)
    for alike in unplaced.values():
        own = [pair for pair in alike if pair.name == pair.calibration.name] if len(alike) > 1 else alike
        if not own:
            names = [pair.name for pair in alike]
            raise InvalidImages(
                f"{' and '.join(names[:2])} were taken by the same cameras, {alike[0].calibration.name}: "
                f"say in {PAIRS_FILE} where each was taken (T_site_base)",
                pairs=names,
            )
        placed += own
        for pair in alike:
            if pair not in own:
                left_out[pair.name] = (
                    f"pair {pair.name}: there is no calibration {pair.name}, and {PAIRS_FILE} does not say where the "
                    f"cameras of {pair.calibration.name} took it (T_site_base)"
                )
    return [pair for pair in pairs if pair in placed], left_out
