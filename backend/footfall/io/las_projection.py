"""Which coordinate system a LAS file says its points have, by WKT or by the keys of GeoTIFF."""

import io
import re
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from footfall.core.errors import InvalidTerrain
from footfall.io.geo_keys import HEIGHTS, LENGTHS, METRE, USER_DEFINED, require_metres

if TYPE_CHECKING:
    from rasterio.crs import CRS


def projection_in(content: bytes, name: str) -> "CRS | None":
    """The coordinate system that a scan states itself: of LAS files; None where it doesn't."""
    if not name.lower().endswith((".las", ".laz")):
        return None
    import laspy

    with laspy.open(io.BytesIO(content)) as opened:
        return coordinate_system(opened.header, name)


_PROJECTED, _GEOGRAPHIC, _VERTICAL = 3072, 2048, 4096
_MODEL, _IS_PROJECTED = 1024, 1
_ON_THE_GLOBE = {2: "geographic, in degrees", 3: "geocentric"}
"""Kinds of coordinates that need no code for it to be told that they are no metres on a map."""
_OLD_HEIGHTS = frozenset((*range(5001, 5034), *range(5101, 5107)))
"""Codes of heights of the first GeoTIFF, such as 5103 (NAVD 88), which EPSG has for other things."""


def coordinate_system(header: Any, name: str) -> "CRS | None":
    """The coordinate system of a LAS file. Raises InvalidTerrain for all but metres."""
    from footfall.io.terrain_projection import check_crs, check_projection_text

    records = [record for record in header.vlrs if type(record).__name__ == "GeoKeyDirectoryVlr"]
    keys = {key.id: key.value_offset for key in records[0].geo_keys if key.tiff_tag_location == 0} if records else {}
    for record in (*header.vlrs, *(header.evlrs or ())):
        if type(record).__name__ == "WktCoordinateSystemVlr" and (wkt := record.string.strip("\0 ")):
            if not re.search(r"\bVERT", wkt):  # what heights are, the keys may say alone
                _require_heights_in_metres(keys, name)
            return check_projection_text(wkt, name)
    if not records:
        return None
    require_metres("lengths", keys.get(LENGTHS, METRE), name)
    _require_heights_in_metres(keys, name)
    found = {number: _of_epsg(keys[number], name) for number in (_PROJECTED, _GEOGRAPHIC) if _is_code(keys, number)}
    if keys.get(_PROJECTED) == USER_DEFINED:
        found[_PROJECTED] = _of_all_keys(header, name)
    if _PROJECTED in found or keys.get(_MODEL) == _IS_PROJECTED:
        found.pop(_GEOGRAPHIC, None)  # what the projection is made from
    for one in found.values():
        check_crs(one, name)
    if _PROJECTED not in found and (kind := _ON_THE_GLOBE.get(keys.get(_MODEL, 0))) is not None:
        raise InvalidTerrain(f"the coordinates of {name} are {kind}, as its keys say; reproject it, such as to UTM")
    return found.get(_PROJECTED)


def _is_code(keys: Mapping[int, int], number: int) -> bool:
    return 0 < keys.get(number, 0) < USER_DEFINED


def _require_heights_in_metres(keys: Mapping[int, int], name: str) -> None:
    from footfall.io.terrain_projection import check_crs

    require_metres("heights", keys.get(HEIGHTS, METRE), name)
    if not _is_code(keys, _VERTICAL):
        return
    code = keys[_VERTICAL]
    if code not in _OLD_HEIGHTS:
        check_crs(_of_epsg(code, name), name)
    elif keys.get(HEIGHTS) != METRE:
        raise InvalidTerrain(
            f"{name} names its heights by the old code {code}, which says no unit, and states none: let it say "
            f"VerticalUnits {METRE} (metres) where these are metres, or reproject it first"
        )


def _of_epsg(code: int, name: str) -> "CRS":
    from rasterio.crs import CRS
    from rasterio.errors import CRSError

    try:
        return CRS.from_epsg(code)
    except CRSError as err:
        raise InvalidTerrain(f"{name} states EPSG:{code}, which is no coordinate system that we know") from err


_TAGS = {"GeoKeyDirectoryVlr": (34735, "u2"), "GeoDoubleParamsVlr": (34736, "f8"), "GeoAsciiParamsVlr": (34737, "s")}
"""Records of a LAS file that a GeoTIFF has as tags, and of what they are made."""
_TYPES = {"u2": 3, "f8": 12, "s": 2}
"""Numbers of TIFF for these."""


def _of_all_keys(header: Any, name: str) -> "CRS":
    """A projection that the file defines itself, as a GeoTIFF with the same keys has it."""
    from PIL import Image
    from PIL.TiffImagePlugin import ImageFileDirectory_v2
    from rasterio.errors import NotGeoreferencedWarning, RasterioError
    from rasterio.io import MemoryFile

    tags = ImageFileDirectory_v2()
    for record in header.vlrs:
        if type(record).__name__ in _TAGS:
            tag, kind = _TAGS[type(record).__name__]
            tags.tagtype[tag] = _TYPES[kind]
            held = record.record_data_bytes()
            tags[tag] = held.decode("latin-1").rstrip("\0") if kind == "s" else np.frombuffer(held, f"<{kind}").tolist()
    content = io.BytesIO()
    Image.new("L", (1, 1)).save(content, "TIFF", tiffinfo=tags)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            with MemoryFile(content.getvalue()) as memory, memory.open(driver="GTiff") as opened:
                crs = opened.crs
        except RasterioError:
            crs = None
    if crs is None or not crs.is_projected:
        raise InvalidTerrain(
            f"{name} has a projection of its own (ProjectedCSType {USER_DEFINED}) that its keys don't describe; let "
            "it state an EPSG code or WKT, or reproject it, such as to UTM"
        )
    return crs
