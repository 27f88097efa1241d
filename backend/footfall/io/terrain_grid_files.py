"""Terrain as plain grids: ESRI ASCII grid, npz, grey picture. GeoTIFF has its own module."""

import codecs
import io
import json
import re
import struct
import warnings
import zipfile
import zlib
from dataclasses import replace

import numpy as np
from PIL import Image

from footfall.core.errors import InvalidTerrain
from footfall.core.misread import Unreadable, place_of
from footfall.core.written import how_to_write, number_of, require_plain_numbers
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_cell_count, from_heights
from footfall.terrain.ground.resample import square_cells

_MEMORY = ("variance", "count", "time", "source")
_MEANING = {"unit", "units", "scale", "offset", "nodata", "no_data", "fill_value", "mask", "crs", "transform"}
"""Arrays that would change what heights mean; others, such as a name, change nothing."""
_LONGEST_SOURCES = 1 << 16
_FEW = 64
_ASC_NODATA = -9999.0
_LONGEST_LINE = 1000
"""Of a header; what is longer holds heights."""
_AT_ONCE = 1 << 20
"""Heights that are compared at once: a comparison needs several times their memory."""
_ASC_KEYS = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value")

_SIX_DIGITS = re.compile(r"[+-]?\d(?:\.(\d{1,5}))?[eE]\+(0[6-9]|[1-9]\d)")
"""As ``%g`` writes numbers that have more than six; by hand they are written otherwise."""


def read_asc(content: bytes, name: str) -> Dem:
    """ESRI ASCII grid: ncols, nrows, xll and yll (corner or center), cellsize, NODATA_value (else −9999)."""
    content = content.removeprefix(codecs.BOM_UTF8)
    try:
        require_plain_numbers(content)
    except Unreadable as err:
        raise InvalidTerrain(f"{name} is no ASCII grid: {err}") from err
    if not content.isascii():
        raise InvalidTerrain(f"{name} is not text, so no ASCII grid")
    header, start = _asc_header(content, name)
    cols, rows, cell = header["ncols"], header["nrows"], header["cellsize"]
    if not (cols.is_integer() and rows.is_integer()):
        raise InvalidTerrain(f"{name} states {cols:g} columns and {rows:g} rows; they must be whole numbers")
    check_cell_count(rows, cols)
    wanted = int(rows * cols)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(content[start:], sep=" ")
        except (DeprecationWarning, ValueError) as err:
            raise InvalidTerrain(f"{name} has something other than numbers among its heights") from err
    if len(values) != wanted:
        raise InvalidTerrain(
            f"{name} holds {len(values)} heights where its header states {rows:g} × {cols:g}", count=len(values)
        )
    # header and heights may be rounded to different digits, such as the lowest float32
    nodata = header.get("nodata_value", _ASC_NODATA)
    for part in np.array_split(values, 1 + wanted // _AT_ONCE):  # views
        part[np.isclose(part, nodata, rtol=1e-6, atol=0.0)] = np.nan
    x0, y0 = (header[f"{a}llcenter"] if f"{a}llcenter" in header else header[f"{a}llcorner"] + cell / 2 for a in "xy")
    return from_heights(values.reshape(int(rows), int(cols))[::-1], cell, x0, y0, name)


def _asc_header(content: bytes, name: str) -> tuple[dict[str, float], int]:
    """(what it states, where its heights begin)"""
    header: dict[str, float] = {}
    steps: dict[str, float] = {}
    position = 0
    while position < len(content):
        end = content.find(b"\n", position)
        end = len(content) if end < 0 else end
        # a line may be the whole file, and its words need ten times its memory
        line = content[position : min(end, position + _LONGEST_LINE)].decode("ascii")
        words = line.split()
        if words and not words[0][0].isalpha():
            break
        if words and words[0].lower() == "nan":
            break
        if words:
            key = words[0].lower()
            if key not in _ASC_KEYS or len(words) != 2:
                raise InvalidTerrain(
                    f"{name} has a header line {line.strip()[:40]!r}; an ASCII grid has {', '.join(_ASC_KEYS)}"
                )
            given = {key, key.replace("corner", "center"), key.replace("center", "corner")} & header.keys()
            if given:
                raise InvalidTerrain(
                    f"{name} states {words[0]} beside {given.pop()}; which of them holds is not to tell"
                )
            stated = number_of(words[1])
            if stated is None:
                raise InvalidTerrain(
                    f"{name} states {words[0]} as {words[1][:40]!r}, which is no number{how_to_write(words[1])}"
                )
            header[key] = stated
            if (short := _SIX_DIGITS.fullmatch(words[1])) is not None:
                steps[words[0]] = 10.0 ** (int(short[2]) - len(short[1] or ""))
        position = end + 1
    missing = [key for key in ("ncols", "nrows", "cellsize") if key not in header]
    missing += [f"{a}llcorner" for a in "xy" if not {f"{a}llcorner", f"{a}llcenter"} & header.keys()]
    if missing:
        raise InvalidTerrain(f"{name} is no complete ASCII grid: its header lacks {', '.join(missing)}")
    for key, step in steps.items():
        if step > header["cellsize"] and key.lower() in _ASC_KEYS[2:6]:
            raise InvalidTerrain(
                f"{name} states {key} as {header[key.lower()]:.6g}, to {step:g} m, coarser than its cells of "
                f"{header['cellsize']:g} m: the place was written with too few digits; write all of them",
                step=step,
            )
    return header, position


def write_asc(dem: Dem) -> bytes:
    """ASCII grid with nine digits, which bring every float32 height back exactly."""
    grid = dem.geometry
    nodata = _ASC_NODATA
    while (dem.heights == nodata).any():
        nodata *= 10
    heights = np.where(np.isnan(dem.heights), nodata, dem.heights.astype(np.float64))
    out = io.StringIO()
    out.write(f"ncols {grid.cols}\nnrows {grid.rows}\nxllcenter {grid.x0!r}\nyllcenter {grid.y0!r}\n")
    out.write(f"cellsize {grid.resolution!r}\nNODATA_value {nodata:z.0f}\n")
    np.savetxt(out, heights[::-1], fmt="%.9g")
    return out.getvalue().encode("ascii")


def read_npz(content: bytes, name: str) -> Dem:
    """The arrays ``heights``, ``resolution``, ``x0``, ``y0`` and, if there, ``texture`` and the memory layers."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            check_npz_size(archive, name)
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            unread = sorted(_MEANING & {one.lower() for one in arrays.files})
            if unread:
                raise Unreadable(
                    f"its array {unread[0]} would be passed over; bring heights, resolution, x0 and y0 to metres, make "
                    "unknown cells NaN, and leave it out"
                )
            heights = arrays["heights"]
            resolution, x0, y0 = (_plain_number(arrays[key], key) for key in ("resolution", "x0", "y0"))
            texture = arrays["texture"] if "texture" in arrays.files else None
            memory: dict[str, np.ndarray | tuple[str, ...]] = {}
            if all(key in arrays.files for key in (*_MEMORY, "sources")):
                memory = {key: arrays[key] for key in _MEMORY}
                memory["sources"] = _sources(arrays["sources"])
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, TypeError, KeyError, RuntimeError) as err:
        raise InvalidTerrain(
            f"{name} can't be read: an npz terrain holds heights, resolution, x0 and y0 as plain numbers{_why(err)}"
        ) from err
    return replace(from_heights(heights, resolution, x0, y0, name, texture=texture), **memory)


def _plain_number(array: np.ndarray, key: str) -> float:
    if array.dtype.kind not in "fiu":
        raise Unreadable(f"{key} is no number, but {array.dtype}")
    return float(array[()])


def _why(err: Exception) -> str:
    return f": it has no {err.args[0].split()[0]}" if isinstance(err, KeyError) else place_of(err)


def _sources(text: np.ndarray) -> tuple[str, ...]:
    names = json.loads(text.tobytes().decode())
    if not isinstance(names, list) or not all(isinstance(one, str) for one in names):
        raise Unreadable("sources is no list of names")
    return tuple(names)


def check_npz_size(archive: zipfile.ZipFile, name: str, small: tuple[str, ...] = ()) -> None:
    """Refuse by the header alone, so that a small file can't ask for much memory.

    small: names, in lower case, of arrays that may be a row of a few numbers.
    """
    for member in archive.namelist():
        with archive.open(member) as stream:
            version = np.lib.format.read_magic(stream)
            read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(stream)
        if dtype.hasobject:
            raise Unreadable(f"{member} holds Python objects (a pickle), which are never read")
        if len(shape) == 2:
            check_cell_count(*shape)
        elif len(shape) == 1 and (
            (member == "sources.npy" and dtype == np.uint8 and shape[0] <= _LONGEST_SOURCES)
            or (member.removesuffix(".npy").lower() in small and shape[0] <= _FEW and dtype.itemsize <= 8)
        ):
            continue
        elif shape not in ((), (1,)) or dtype.itemsize > 64:
            raise Unreadable(f"{member} has the shape {shape}")


def write_npz(dem: Dem) -> bytes:
    grid = dem.geometry
    arrays = {
        "heights": dem.heights,
        "resolution": np.array(grid.resolution),
        "x0": np.array(grid.x0),
        "y0": np.array(grid.y0),
    }
    if dem.texture is not None:
        arrays["texture"] = dem.texture
    if dem.remembers:
        arrays |= {key: getattr(dem, key) for key in _MEMORY}
        arrays["sources"] = np.frombuffer(json.dumps(dem.sources).encode(), np.uint8)
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    return out.getvalue()


def read_png(
    content: bytes,
    name: str,
    size: tuple[float, float],
    height_range: tuple[float, float],
    resolution: float | None = None,
) -> Dem:
    """Grey picture of 8 or 16 bit: black is the lower, white the upper end of ``height_range`` [m].

    The grey that it declares transparent (``tRNS``) is unknown, as GDAL has it.

    size: (east, north) extent of the whole picture [m]; its south-west corner lies at (0, 0). Pixels
    that are not square, or another resolution, are brought to square cells by bilinear interpolation.
    """
    # the header is read here, because a decoder would already allocate what it promises
    if len(content) < 26 or content[12:16] != b"IHDR":
        raise InvalidTerrain(f"{name} is a corrupt PNG")
    cols, rows, depth, color = struct.unpack(">IIBB", content[16:26])
    if color != 0 or depth not in (8, 16):
        raise InvalidTerrain(f"{name} is no grey picture of 8 or 16 bit; heights can't be read from colours")
    check_cell_count(rows, cols)
    extent, span = np.asarray(size, float), np.asarray(height_range, float)
    if extent.shape != (2,) or not (np.isfinite(extent).all() and (extent > 0).all()):
        raise InvalidTerrain(f"size must be two positive numbers (east, north) in metres, not {size!r}")
    if span.shape != (2,) or not np.isfinite(span).all() or span[0] >= span[1]:
        raise InvalidTerrain(f"height_range must be (lower, upper) in metres, not {height_range!r}")
    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as picture:
            grey, clear = np.array(picture, dtype=np.float64), picture.info.get("transparency")
    except (OSError, SyntaxError, ValueError, struct.error) as err:
        raise InvalidTerrain(f"{name} is a corrupt PNG: it is damaged or cut") from err
    if clear is not None:
        grey[grey == clear] = np.nan
    heights = (span[0] + (span[1] - span[0]) * grey / (2**depth - 1))[::-1]
    spacing_x, spacing_y = extent[0] / cols, extent[1] / rows
    cell = float(min(spacing_x, spacing_y)) if resolution is None else resolution
    if max(abs(spacing_x - cell), abs(spacing_y - cell)) > 1e-9 * cell:
        heights = square_cells(heights, float(spacing_x), float(spacing_y), cell)
    return from_heights(heights, cell, float(spacing_x) / 2, float(spacing_y) / 2, name)
