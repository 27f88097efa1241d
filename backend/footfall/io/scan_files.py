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
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from footfall.core.arrays import Array, Bytes
from footfall.core.errors import InvalidTerrain
from footfall.core.misread import Unreadable
from footfall.core.written import number_of, require_no_utf16, require_plain_numbers
from footfall.io import scan_text
from footfall.io.las_projection import coordinate_system
from footfall.io.other_formats import refuse_other_format
from footfall.io.pcd_header import header_of, plain_pcd
from footfall.terrain.coarse_digits import of_32_bits
from footfall.terrain.scan import Scan

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
    refuse_other_format(name)
    if ending not in _READERS:
        raise InvalidTerrain(f"{name} can't be a scan: its name must end in one of {', '.join(_READERS)}")
    if not content:
        raise InvalidTerrain(f"{name} is empty")
    try:
        _require_plain_text(content, ending)
        return _READERS[ending](content, name)
    except (InvalidTerrain, MemoryError):
        raise
    except Unreadable as err:
        raise InvalidTerrain(f"{name} can't be read: {err}") from err
    except Exception as err:  # the parsers raise whatever they trip over
        raise InvalidTerrain(
            f"{name} can't be read as a {ending[1:].upper()} file of points: it is damaged or cut"
        ) from err


_TEXT_FORMS = {
    ".ply": rb"\Aply\s+format ascii",
    ".pcd": rb"^DATA[ \t]+ascii",
    ".vtk": rb"\A[^\n]*\n[^\n]*\n\s*ASCII\b",
}


def _require_plain_text(content: bytes, ending: str) -> None:
    """Raise Unreadable for text that is UTF-16, or has numbers that only Python reads."""
    if ending not in (".las", ".laz"):
        require_no_utf16(content)
    if ending in _TEXT_FORMS and re.search(_TEXT_FORMS[ending], content[:65536], re.MULTILINE):
        require_plain_numbers(content)


def scan_of(
    points: Any,
    name: str,
    *,
    unit: str | None = None,
    up: str | None = None,
    classes: Bytes | None = None,
    camera: bool = False,
) -> Scan:
    """A scan of points (n, 3) without those that no return gave; the rest as :class:`Scan` has it.

    Such points are not finite or, as many sensors write them, all in their origin: several at (0, 0, 0) exactly.
    """
    points = np.ascontiguousarray(points, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise InvalidTerrain(f"{name} has no points")
    _require_few(len(points), name)
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise InvalidTerrain(f"none of the {len(points)} points of {name} has finite coordinates")
    held = finite
    if np.count_nonzero(at_origin := (points == 0.0).all(axis=1)) > 1:
        held = finite & ~at_origin
        if not held.any():
            raise InvalidTerrain(f"all points of {name} that are finite are (0, 0, 0), which stands for no return")
    dropped = int((~held).sum())
    if dropped:
        points = points[held]
        classes = None if classes is None else classes[held]
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
    header = content[:65536].partition(b"end_header")[0]
    named = re.findall(rb"^property\s+\w+\s+([xyz])\s*$", header, re.MULTILINE)
    missing = [axis for axis in "xyz" if axis.encode() not in named]
    if missing:
        raise InvalidTerrain(f"{name} has no property {', '.join(missing)}; the points of a PLY are x, y and z")
    stated = re.search(rb"^element\s+vertex\s+(\d+)", header, re.MULTILINE)
    loaded: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    points = np.asarray(loaded.vertices)
    if stated is None or len(points) < int(stated[1]):
        raise InvalidTerrain(f"{name} is cut: it states more points than it holds")
    return scan_of(points, name)


def _pcd(content: bytes, name: str) -> Scan:
    from pypcd4.pypcd4 import PointCloud

    header = header_of(content)
    _require_few(header.points, name)
    missing = [axis for axis in "xyz" if axis not in header.fields]
    if missing:
        raise InvalidTerrain(f"{name} has no field {', '.join(missing)}; it has {', '.join(header.fields)}")
    cloud = PointCloud.from_fileobj(io.BufferedReader(io.BytesIO(plain_pcd(content, header))))
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
    projection = coordinate_system(header, name)
    if projection is not None:
        from footfall.io.terrain_projection import check_true_to_scale

        low, high = header.mins, header.maxs
        check_true_to_scale(projection, (low[0], low[1], high[0], high[1]), name)
    scan = scan_of(points, name, unit=None if projection is None else "m", up="z", classes=classes)
    return replace(scan, step=float(max(header.scales)))


def require_no_viewpoint(content: bytes, name: str) -> None:
    """Raise InvalidTerrain for a PCD that names a viewpoint: whether its points are in the frame of it, none says."""
    named = re.search(rb"^VIEWPOINT[ \t]+([^\r\n]+)", content[:65536], re.MULTILINE)
    if not name.lower().endswith(".pcd") or named is None:
        return
    words = named[1].decode("ascii", "replace").split()
    if words[:3] + words[4:] == ["0"] * 6 or any(number_of(word) is None for word in words):
        return
    x, y, z, _, *turn = (number_of(word) for word in words)
    if any((x, y, z, *turn)):
        raise InvalidTerrain(
            f"{name} was taken from the viewpoint {' '.join(words)}, and PCD does not say whether its points are in "
            f"its frame: if they are, state where that was, such as --pose {','.join(words)}; if they are in site, "
            "--pose 0,0,0,1,0,0,0"
        )


def rounding_of(content: bytes, name: str, points: Array) -> float:
    """How far numbers of 32 bit may move these points [their unit]; 0 where a file has more digits, and uses them."""
    ending, header = Path(name).suffix.lower(), content[:65536]
    if ending == ".pcd":
        single = header_of(content).single
    else:
        said = {
            ".ply": rb"^property\s+float(?:32)?\s+[xyz]\s*$",
            ".vtk": rb"^POINTS[ \t]+\d+[ \t]+float\b",
        }.get(ending)
        single = said is not None and re.search(said, header, re.MULTILINE) is not None
    return float(np.abs(points).max()) * 2.0**-23 if single or of_32_bits(points) else 0.0


_SURFACES = ("triangle", "quad", "polygon")
_OF_POINTS = ("vertex",)


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
    other = sorted({block.type for block in read.cells} - {*_OF_POINTS})
    if other:
        raise InvalidTerrain(
            f"{name} holds cells ({', '.join(other)}), no scan: their corners are no returns of the ground; write the "
            "points of the ground alone"
        )
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
    **dict.fromkeys(scan_text.ENDINGS, lambda content, name: scan_of(scan_text.read_points(content, name), name)),
    ".vtk": _vtk,
}
