"""Scans: files of points, through the libraries that keep each format well.

=================== =====================================================================
``.ply``            points without faces (trimesh)
``.pcd``            every kind of encoding (pypcd4); points without coordinates are left out
``.las .laz``       scaled coordinates and classes (laspy, lazrs); what the coordinate system says of units is heeded
``.xyz .csv .txt``  text: three numbers first in each row, or columns that a heading calls x, y, z
``.vtk``            legacy VTK of points (meshio)
``.npz .png``       a depth image with its calibration, see :mod:`footfall.io.depth_files`
=================== =====================================================================
"""

import io
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from footfall.core.arrays import Array, Bytes
from footfall.core.errors import InvalidTerrain
from footfall.terrain.scan import Scan

if TYPE_CHECKING:
    from rasterio.crs import CRS


SCANS = (".pcd", ".las", ".laz", ".xyz", ".csv", ".txt", ".vtk")
"""Endings that only scans have."""

MAX_POINTS = 40_000_000
"""More are refused by what the header states, before they are unpacked."""

_AT_ONCE = 1 << 20
"""Points of a LAS file that are unpacked together."""

MAX_COORDINATE = 1e8


def read_scan(content: bytes, name: str) -> Scan:
    """The points of a file and what it declares of them. Raises InvalidTerrain saying what is wrong."""
    ending = Path(name).suffix.lower()
    if ending not in _READERS:
        raise InvalidTerrain(f"{name} can't be a scan: its name must end in one of {', '.join(_READERS)}")
    if not content:
        raise InvalidTerrain(f"{name} is empty")
    try:
        return _READERS[ending](content, name)
    except (InvalidTerrain, MemoryError):
        raise
    except Exception as err:  # the parsers raise whatever they trip over
        raise InvalidTerrain(
            f"{name} can't be read as a {ending[1:].upper()} file of points: it is damaged or cut"
        ) from err


def scan_of(
    points: Any,
    name: str,
    *,
    unit: str | None = None,
    up: str | None = None,
    classes: Bytes | None = None,
    camera: bool = False,
) -> Scan:
    """A scan of points (n, 3), those that are not finite left out; the rest as :class:`Scan` has it."""
    points = np.ascontiguousarray(points, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise InvalidTerrain(f"{name} has no points")
    _require_few(len(points), name)
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise InvalidTerrain(f"none of the {len(points)} points of {name} has finite coordinates")
    dropped = int((~finite).sum())
    if dropped:
        points = points[finite]
        classes = None if classes is None else classes[finite]
    if np.abs(points).max() > MAX_COORDINATE:
        raise InvalidTerrain(f"{name} has coordinates beyond {MAX_COORDINATE:g}")
    return Scan(points, name, unit, up, classes, dropped, camera)


def _require_few(count: int, name: str) -> None:
    if count > MAX_POINTS:
        raise InvalidTerrain(f"{name} has {count} points, more than {MAX_POINTS} are refused; thin it out", count=count)


def ply_has_faces(content: bytes) -> bool:
    """Whether a PLY is a mesh; one without faces is a scan."""
    header = content[:65536].partition(b"end_header")[0]
    stated = re.search(rb"^element\s+face\s+(\d+)", header, re.MULTILINE)
    return stated is not None and int(stated[1]) > 0


def _ply(content: bytes, name: str) -> Scan:
    import trimesh

    if ply_has_faces(content):
        raise InvalidTerrain(f"{name} is a mesh, no scan: read it as a terrain file, without --scan")
    if re.search(rb"^element\s+tristrips\s+[1-9]", content[:65536].partition(b"end_header")[0], re.MULTILINE):
        raise InvalidTerrain(f"{name} holds triangle strips, which are not read; write it as triangles")
    stated = re.search(rb"^element\s+vertex\s+(\d+)", content[:65536], re.MULTILINE)
    loaded: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    points = np.asarray(loaded.vertices)
    if stated is None or len(points) < int(stated[1]):
        raise InvalidTerrain(f"{name} is cut: it states more points than it holds")
    return scan_of(points, name)


def _pcd(content: bytes, name: str) -> Scan:
    from pypcd4.pypcd4 import PointCloud

    stated = re.search(rb"^POINTS\s+(\d+)", content[:65536], re.MULTILINE)
    _require_few(0 if stated is None else int(stated[1]), name)
    cloud = PointCloud.from_fileobj(io.BufferedReader(io.BytesIO(content)))
    missing = [axis for axis in "xyz" if axis not in cloud.fields]
    if missing:
        raise InvalidTerrain(f"{name} has no field {', '.join(missing)}; it has {', '.join(cloud.fields)}")
    points = np.column_stack([np.asarray(cloud.pc_data[axis], np.float64).ravel() for axis in "xyz"])
    if len(points) < cloud.points:
        raise InvalidTerrain(f"{name} is cut: it states {cloud.points} points and holds {len(points)}")
    return scan_of(points, name)


def _las(content: bytes, name: str) -> Scan:
    import laspy

    with laspy.open(io.BytesIO(content)) as opened:
        header, count = opened.header, opened.header.point_count
        _require_few(count, name)
        points, classes, held = np.empty((count, 3)), np.empty(count, np.uint8), 0
        for part in opened.chunk_iterator(_AT_ONCE):  # what else a point has is many times as much
            these = slice(held, held := held + len(part))
            points[these] = np.column_stack([np.asarray(axis, np.float64) for axis in (part.x, part.y, part.z)])
            classes[these] = np.asarray(part.classification, np.uint8)
            points[these][np.asarray(part.withheld, bool)] = np.nan  # deleted, as the format has it
    if held < count:
        raise InvalidTerrain(f"{name} is cut: it states {count} points and holds {held}")
    # feet, degrees and what is not true to scale are refused, as in other formats
    projection = _coordinate_system(header, name)
    if projection is not None:
        from footfall.io.terrain_projection import check_true_to_scale

        low, high = header.mins, header.maxs
        check_true_to_scale(projection, (low[0], low[1], high[0], high[1]), name)
    return scan_of(points, name, unit=None if projection is None else "m", up="z", classes=classes)


def projection_in(content: bytes, name: str) -> "CRS | None":
    """The coordinate system that a scan states itself: of LAS files; None where it doesn't."""
    if not name.lower().endswith((".las", ".laz")):
        return None
    import laspy

    with laspy.open(io.BytesIO(content)) as opened:
        return _coordinate_system(opened.header, name)


_PROJECTED, _GEOGRAPHIC, _VERTICAL, _LENGTHS, _HEIGHTS = 3072, 2048, 4096, 3076, 4099
"""Keys of GeoTIFF, which LAS files use too."""


def _coordinate_system(header: Any, name: str) -> "CRS | None":
    """The coordinate system of a LAS file. Raises InvalidTerrain for all but metres."""
    from footfall.io.terrain_projection import check_crs, check_projection_text

    for record in (*header.vlrs, *(header.evlrs or ())):
        if type(record).__name__ == "WktCoordinateSystemVlr" and record.string.strip("\0 "):
            return check_projection_text(record.string.strip("\0 "), name)
    for record in header.vlrs:
        if type(record).__name__ != "GeoKeyDirectoryVlr":
            continue
        keys = {key.id: key.value_offset for key in record.geo_keys if key.tiff_tag_location == 0}
        for kind, number in (("lengths", _LENGTHS), ("heights", _HEIGHTS)):
            if keys.get(number, _METRE) not in (0, _METRE):
                raise InvalidTerrain(
                    f"{name} has {kind} in another unit than metres (EPSG:{keys[number]}); reproject it first"
                )
        codes = {
            number: keys[number] for number in (_PROJECTED, _GEOGRAPHIC, _VERTICAL) if 0 < keys.get(number, 0) < 32767
        }
        found = {number: _of_epsg(code, name) for number, code in codes.items()}
        for one in found.values() if _PROJECTED not in found else (found[_PROJECTED], found.get(_VERTICAL)):
            check_crs(one, name)
        return found.get(_PROJECTED)
    return None


_METRE = 9001


def _of_epsg(code: int, name: str) -> "CRS":
    from rasterio.crs import CRS
    from rasterio.errors import CRSError

    try:
        return CRS.from_epsg(code)
    except CRSError as err:
        raise InvalidTerrain(f"{name} states EPSG:{code}, which is no coordinate system that we know") from err


def _text(content: bytes, name: str) -> Scan:
    lines = content[:65536].decode("utf-8", "replace").lstrip("\ufeff").splitlines()
    if not lines:
        raise InvalidTerrain(f"{name} is empty")
    comments = 0
    while comments < len(lines) and (
        not lines[comments].strip() or lines[comments].lstrip().startswith(("#", "//", "%"))
    ):
        comments += 1
    if comments == len(lines):
        raise InvalidTerrain(f"{name} has no rows of numbers")
    first = lines[comments]
    separator = next((s for s in (";", ",", "\t") if s in first), None)
    words = [word.strip().strip('"') for word in (first.split(separator) if separator else first.split())]
    columns = (0, 1, 2)
    skip = comments
    if len(words) == 1 and words[0].isdecimal():
        skip += 1  # how many points there are, as in PTS files
    elif not all(_is_number(word) for word in words[:3]):
        columns, skip = _columns(words, name), skip + 1
    elif len(words) < 3:
        raise InvalidTerrain(f"{name} needs three numbers in each row, there are {len(words)}")
    table = _numbers(content, separator, skip, columns, name)
    return scan_of(table, name)


def _columns(words: list[str], name: str) -> tuple[int, int, int]:
    """Which columns a heading calls x, y and z."""
    plain = [re.sub(r"[\[(].*", "", word).strip().lower().lstrip("/#") for word in words]
    found = [plain.index(axis) if axis in plain else -1 for axis in "xyz"]
    if min(found) < 0:
        raise InvalidTerrain(f"{name} begins with {', '.join(words[:6])}: its heading needs columns x, y and z")
    return found[0], found[1], found[2]


def _numbers(content: bytes, separator: str | None, skip: int, columns: tuple[int, ...], name: str) -> Array:
    try:
        return np.loadtxt(
            io.StringIO(content.decode("utf-8", "replace").lstrip("\ufeff")),
            delimiter=separator,
            skiprows=skip,
            usecols=columns,
            comments=("#", "//", "%"),
            ndmin=2,
        )
    except (ValueError, IndexError) as err:
        where = re.search(r"at row (\d+)", str(err))
        row = "a row" if where is None else f"row {int(where[1]) + skip + 1}"
        raise InvalidTerrain(f"{name}: {row} does not have a number in each of the columns x, y and z") from err


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def require_unit_of_heading(content: bytes, name: str, unit: str | None) -> None:
    """Raise InvalidTerrain where the heading of a text says another unit than is stated, or degrees."""
    if not name.lower().endswith((".xyz", ".csv", ".txt")):
        return
    heading = content[:65536].decode("utf-8", "replace").lstrip("\ufeff").lstrip().partition("\n")[0]
    for said in re.findall(r"[xyzXYZ]\s*[\[(]\s*([^\])]{1,20}?)\s*[\])]", heading):
        meant = _SAID.get(said.lower())
        if meant == "deg":
            raise InvalidTerrain(f"{name} has coordinates in degrees, as its heading says; reproject it to metres")
        if None not in (meant, unit) and meant != unit:
            raise InvalidTerrain(
                f"the heading of {name} says {said}, not {unit}: state --unit {meant}, or correct the heading",
                unit=meant,
            )


_SAID = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), "cm"),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), "mm"),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), "km"),
    **dict.fromkeys(("ft", "foot", "feet"), "ft"),
    **dict.fromkeys(("us-ft", "us ft", "usft", "ftus", "us survey foot", "us survey feet"), "us-ft"),
    **dict.fromkeys(("deg", "degree", "degrees", "°"), "deg"),
}
"""How headings spell units."""


def require_no_viewpoint(content: bytes, name: str) -> None:
    """Raise InvalidTerrain for a PCD that names a viewpoint: whether its points are in the frame of it, none says."""
    named = re.search(rb"^VIEWPOINT[ \t]+([^\r\n]+)", content[:65536], re.MULTILINE)
    if not name.lower().endswith(".pcd") or named is None:
        return
    words = named[1].decode("ascii", "replace").split()
    if words[:3] + words[4:] == ["0"] * 6 or not all(_is_number(word) for word in words):
        return
    x, y, z, _, *turn = (float(word) for word in words)
    if any((x, y, z, *turn)):
        raise InvalidTerrain(
            f"{name} was taken from the viewpoint {' '.join(words)}, and PCD does not say whether its points are in "
            f"its frame: if they are, state where that was, such as --pose {','.join(words)}; if they are in site, "
            "--pose 0,0,0,1,0,0,0"
        )


def rounding_of(content: bytes, name: str, points: Array) -> float:
    """How far numbers of 32 bit may move these points [their unit]; 0 where a file has more digits, or is text."""
    header = content[:65536]
    of_32 = {
        ".ply": rb"^property float(?:32)? [xyz]\s*$",
        ".pcd": rb"^SIZE[ \t]+4\b",
        ".vtk": rb"^POINTS[ \t]+\d+[ \t]+float\b",
    }.get(Path(name).suffix.lower())
    if of_32 is None or re.search(of_32, header, re.MULTILINE) is None:
        return 0.0
    return float(np.abs(points).max()) * 2.0**-23


_SURFACES = ("triangle", "quad", "polygon")


def _vtk(content: bytes, name: str) -> Scan:
    import meshio

    if re.match(rb"[^\n]*\n[^\n]*\n\s*(?:ASCII|BINARY)\s+DATASET\s+POLYDATA", content):
        return scan_of(_vtk_polydata(content, name), name)
    # meshio reads legacy VTK by path only, and no POLYDATA
    with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
        path = Path(folder) / "scan.vtk"
        path.write_bytes(content)
        read = meshio.vtk.read(path)
    held = sorted({block.type for block in read.cells if block.type.startswith(_SURFACES)})
    if held:
        raise InvalidTerrain(f"{name} holds a surface ({', '.join(held)}), no scan: write it as PLY, OBJ or STL")
    points = np.asarray(read.points, np.float64)
    return scan_of(points, name)


_VTK_NUMBERS = {b"float": ">f4", b"double": ">f8", b"int": ">i4", b"long": ">i8", b"short": ">i2"}


def _vtk_polydata(content: bytes, name: str) -> Array:
    """The points of legacy POLYDATA, in text or as big-endian numbers."""
    header = re.search(rb"\bPOINTS\s+(\d{1,10})\s+(\w+)[ \t]*\r?\n", content)
    if header is None or header[2] not in _VTK_NUMBERS:
        raise InvalidTerrain(f"{name} has no POINTS of {', '.join(kind.decode() for kind in _VTK_NUMBERS)}")
    count, kind, body = int(header[1]), np.dtype(_VTK_NUMBERS[header[2]]), content[header.end() :]
    text = re.match(rb"[^\n]*\n[^\n]*\n\s*ASCII", content) is not None
    numbers: list[bytes] = body.split(None, 3 * count) if text else []
    length = 3 * count * kind.itemsize
    if (len(numbers) < 3 * count) if text else (len(body) < length):
        raise InvalidTerrain(f"{name} is cut: it states more points than it holds")
    if text:
        points, rest = np.array(numbers[: 3 * count], np.float64), b" ".join(numbers[3 * count :])
    else:
        points, rest = np.frombuffer(body[:length], kind).astype(np.float64), body[length:]
    if re.search(rb"(?:^|\s)(?:POLYGONS|TRIANGLE_STRIPS)\s+[1-9]", rest):
        raise InvalidTerrain(f"{name} holds a surface, no scan: write it as PLY, OBJ or STL")
    return points.reshape(-1, 3)


_READERS: dict[str, Callable[[bytes, str], Scan]] = {
    ".ply": _ply,
    ".pcd": _pcd,
    ".las": _las,
    ".laz": _las,
    ".xyz": _text,
    ".csv": _text,
    ".txt": _text,
    ".vtk": _vtk,
}
