"""Keys of GeoTIFF, which say what coordinates are; LAS files use them too."""

import io
import struct
from collections.abc import Mapping
from pathlib import Path

from PIL.TiffImagePlugin import ImageFileDirectory_v2

from footfall.core.errors import InvalidTerrain

LENGTHS, HEIGHTS = 3076, 4099
"""Keys of units: of coordinates, and of heights."""
USER_DEFINED = 32767
METRE = 9001
_DIRECTORY = 34735
_BIG = 43


def geo_keys(source: bytes | Path) -> dict[int, int]:
    """Keys with a number each, of a GeoTIFF by its content or path; none where it has none, or is no TIFF."""
    with io.BytesIO(source) if isinstance(source, bytes) else source.open("rb") as file:
        head = file.read(8)
        try:
            if _BIG in head[2:4]:
                head += file.read(8)
            tags = ImageFileDirectory_v2(head)
            file.seek(tags.next)
            tags.load(file)
            numbers = [int(number) for number in tags.get(_DIRECTORY, ())]
        except (SyntaxError, struct.error, ValueError, TypeError, OSError, KeyError, IndexError):
            return {}
    rows = [numbers[i : i + 4] for i in range(4, len(numbers) - 3, 4)]
    return {key: number for key, tag, _, number in rows if tag == 0}


def require_metres_by_keys(keys: Mapping[int, int], name: str) -> None:
    """Raise InvalidTerrain where keys state another unit than metres by a code.

    GDAL takes some for metres: of coordinates whose system has no code all but feet, of heights with the old code of a
    system, such as 5103 (NAVD 88), all.
    """
    for key, kind in ((LENGTHS, "lengths"), (HEIGHTS, "heights")):
        if keys.get(key, METRE) != USER_DEFINED:
            require_metres(kind, keys.get(key, METRE), name)


def require_metres(kind: str, unit: int, name: str) -> None:
    """Raise InvalidTerrain for the code of another unit than metres; 0 says none."""
    if unit not in (0, METRE):
        raise InvalidTerrain(f"{name} has {kind} in another unit than metres (EPSG:{unit}); reproject it first")
