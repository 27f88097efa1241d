"""Depth images: how far the ground is along a camera's axis, with the calibration that makes points of it.

``.npz`` holds ``depth`` (rows, cols) [m], or whole numbers with their ``depth_scale``, not finite or not above zero
where unknown, and either the calibration too (``focal_length`` or ``fx`` and ``fy``, ``cx``, ``cy`` [px]) or a file
has it. ``.png`` has 16 bits, unknown where it has 0 or the count that it declares transparent; its calibration says
``depth_scale``, the metres of one count. The highest count of 16 bits, 65535, is unknown in both: no depth, or more
than they hold.
The image is rectified: it has no lens distortion.
"""

import io
import math
import zipfile
from collections.abc import Mapping

import numpy as np
from PIL import Image

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.misread import Unreadable
from footfall.io.image_files import MAX_PIXELS, of_larger_images
from footfall.io.scan_files import scan_of
from footfall.io.terrain_grid_files import check_npz_size
from footfall.terrain.scan import Scan

DEPTH_IMAGES = (".npz", ".png")
_HIGHEST = 65535
"""Count of 16 bits that stands for no depth, or for one beyond them."""
_FAR = 100.0
"""Floats that are all whole, half of them above this, are counts: no depth image is of so many metres sharp."""
_METRES = ("", "m", "metre", "metres", "meter", "meters")
_UNITS = ("unit", "units", "depth_unit", "depth_units")
_UNREAD = ("scale", "offset", "nodata", "no_data", "fill_value", "mask", "valid")
"""Arrays of an ``.npz`` that would change what its depths mean."""
_LENS = ("d", "dist", "dist_coeffs", "distortion", "distortion_coeffs", "distortion_coefficients")
"""Arrays of a lens's distortion, of which zeros change nothing."""
_COEFFICIENTS = 14
_MATRIX = ("k", "camera_matrix", "intrinsics", "intrinsic_matrix")
"""Arrays that say the calibration once more, (3, 3)."""
MEMBERS = ("focal_length", "fx", "fy", "cx", "cy", "depth_scale")


def read_depth(content: bytes, name: str, calibration: Mapping[str, object] | None = None) -> Scan:
    """The points of a depth image in the frame of its camera, z forward, x to the right, y down [m]."""
    members: dict[str, object] = dict(calibration or {})
    matrix: Array | None = None
    unknown = sorted(set(members) - set(MEMBERS))
    if unknown:
        raise InvalidTerrain(f"the calibration of {name} may have {', '.join(MEMBERS)}, not {', '.join(unknown)}")
    if name.lower().endswith(".npz"):
        depth, own, whole, unit, matrix = _npz(content, name)
        members = {**own, **members}
        if unit not in _METRES and "depth_scale" not in members:
            raise InvalidTerrain(
                f"{name} says that its unit is {unit[:40]!r}, and would be read as metres; state depth_scale, the "
                "metres of one",
                unit=unit,
            )
        # whole numbers are counts, as of a 16-bit image: no depth is measured in whole metres
        factor = float(_number(members, "depth_scale", name)) if whole or "depth_scale" in members else 1.0
    else:
        depth = _png(content, name)
        factor = _number(members, "depth_scale", name)
    if factor <= 0:
        raise InvalidTerrain(f"depth_scale of {name} must be above zero [m], not {factor:g}")
    fx, fy = (_number(members, axis if axis in members else "focal_length", name) for axis in ("fx", "fy"))
    cx, cy = (_number(members, one, name) for one in ("cx", "cy"))
    if fx <= 0 or fy <= 0:
        raise InvalidTerrain(f"the focal length of {name} must be above zero [px]")
    if matrix is not None and not np.allclose([fx, fy, cx, cy], matrix[[0, 1, 0, 1], [0, 1, 2, 2]], rtol=1e-3):
        raise InvalidTerrain(
            f"{name} has the camera matrix {matrix[:2].round(2).tolist()}, and would be read with fx {fx:g}, "
            f"fy {fy:g}, cx {cx:g}, cy {cy:g}; state those of the image as it is, or leave the matrix out"
        )
    rows, cols = depth.shape
    if of_larger_images(cx, cy, cols, rows):
        raise InvalidTerrain(
            f"the calibration of {name} has its centre at ({cx:g}, {cy:g}), in the far corner of {cols} × {rows} "
            "pixels: it is of larger images; bring focal length, cx and cy to the size of this one"
        )
    row, col = np.indices(depth.shape, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        z = np.where(np.isfinite(depth) & (depth > 0), depth * factor, np.nan)
    points = np.stack([(col - cx) / fx * z, (row - cy) / fy * z, z], axis=-1).reshape(-1, 3)
    return scan_of(points, name, unit="m", camera=True)


def _npz(content: bytes, name: str) -> tuple[Array, dict[str, object], bool, str, Array | None]:
    """Depth, what it says of the calibration, whether the depths are whole numbers, the unit that it states, and a
    camera matrix.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            check_npz_size(packed, name, small=_LENS)
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            found = {one: archive[one] for one in ("depth", *MEMBERS) if one in archive.files}
            units = [str(archive[one].item()) for one in archive.files if one.lower() in _UNITS]
            unread = sorted(one for one in archive.files if one.lower() in _UNREAD)
            bent = [one for one in archive.files if one.lower() in _LENS and _bends(archive[one])]
            matrices = [archive[one] for one in archive.files if one.lower() in _MATRIX]
    except MemoryError:
        raise
    except Unreadable as err:
        raise InvalidTerrain(f"{name} can't be read: {err}") from err
    except Exception as err:  # damaged archives raise whatever zip and numpy trip over
        raise InvalidTerrain(f"{name} is damaged, or no npz archive of arrays") from err
    if unread:
        raise InvalidTerrain(
            f"{name} has an array {unread[0]}, which would be passed over; make depths without a value NaN or 0, scale "
            "them by depth_scale alone, and leave it out"
        )
    if bent:
        raise InvalidTerrain(
            f"{name} has an array {bent[0]}, of a lens that distorts: depths are read of rectified images; rectify it, "
            "and leave that array out"
        )
    if "depth" not in found:
        raise InvalidTerrain(f"{name} has no array 'depth' (rows, cols) [m]")
    depth = found.pop("depth")
    if depth.ndim != 2 or depth.dtype.kind not in "fiu" or not 0 < depth.size <= MAX_PIXELS:
        raise InvalidTerrain(f"depth of {name} needs rows × cols of real numbers [m], not {depth.dtype} {depth.shape}")
    own = {one: array.item() for one, array in found.items() if array.size == 1}
    whole = depth.dtype.kind in "iu" or _whole_floats(depth)
    counts = depth.astype(np.float64)
    if whole:
        counts[counts == _HIGHEST] = np.nan
    matrix = next((one for one in matrices if one.shape == (3, 3) and one.dtype.kind in "fiu"), None)
    return counts, own, whole, units[0].strip().lower() if units else "", matrix


def _bends(lens: Array) -> bool:
    return lens.dtype.kind in "fiu" and lens.size <= _COEFFICIENTS and bool(lens.any())


def _whole_floats(depth: Array) -> bool:
    """Whether an image of floats holds counts, as of a picture of 16 bits that was turned to floats."""
    known = depth[np.isfinite(depth) & (depth > 0)]
    return len(known) > 0 and bool(np.median(known) > _FAR) and bool((known == np.rint(known)).all())


def _png(content: bytes, name: str) -> Array:
    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as image:
            if image.width * image.height > MAX_PIXELS:
                raise InvalidTerrain(f"{name} has {image.width} × {image.height} pixels; the limit is {MAX_PIXELS}")
            if not image.mode.startswith("I"):
                raise InvalidTerrain(f"{name} has pixels of mode {image.mode}; a depth image is grey with 16 bits")
            depth, clear = np.array(image, np.float64), image.info.get("transparency")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as err:
        raise InvalidTerrain(f"{name} is damaged, or no PNG") from err
    depth[depth == _HIGHEST] = np.nan
    if clear is not None:
        depth[depth == clear] = np.nan
    return depth


def _number(members: Mapping[str, object], member: str, name: str) -> float:
    if member not in members:
        raise InvalidTerrain(
            f"{name} needs a calibration with {member}: JSON with focal_length (or fx and fy), cx, cy [px], and of "
            "whole numbers depth_scale [m per count]",
            missing=member,
        )
    found = members[member]
    if isinstance(found, bool) or not isinstance(found, (int, float)) or not math.isfinite(found):
        raise InvalidTerrain(f"{member} of the calibration of {name} must be a finite number")
    return float(found)
