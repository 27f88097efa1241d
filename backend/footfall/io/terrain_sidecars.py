"""Files beside a terrain file that change how it is read: heeded, or refused where they can't be.

GDAL heeds a mask (``.msk``), an auxiliary file (``.aux.xml``: no-data value, scale, offset, units, coordinates) and a
world file (``.tfw``) when it opens a raster by its path; a projection (``.prj``) lies beside rasters of several kinds.
"""

import re
from pathlib import Path

from footfall.core.errors import InvalidTerrain

WORLD_FILES = (".tfw", ".tifw", ".tiffw", ".wld", ".pgw", ".pngw", ".asw")
_BESIDE_NAME = (".msk", ".aux.xml", ".ovr", ".ovr.msk")
_BESIDE_STEM = (".prj", ".aux.xml", *WORLD_FILES)
MOST_BESIDE = 6
"""Files that an upload may have beside its terrain."""

# Statistics, histograms and the area or point convention of others change no height.
_MEANS_SOMETHING = re.compile(rb"<(SRS|GeoTransform|GCPList|NoDataValue|Scale|Offset|UnitType|MaskBand)\b")


def names_beside(name: str) -> frozenset[str]:
    """Names, in lower case, of the files that may belong to terrain file ``name``."""
    lower = name.lower()
    stem = lower.rpartition(".")[0] or lower
    return frozenset({lower + ending for ending in _BESIDE_NAME} | {stem + ending for ending in _BESIDE_STEM})


def beside(path: Path) -> list[Path]:
    """The files that lie beside a terrain file and belong to it, whatever the case of their names."""
    wanted = names_beside(path.name)
    return sorted(one for one in path.parent.iterdir() if one.name.lower() in wanted and one.is_file())


def projection_beside(path: Path) -> Path | None:
    """The ``.prj`` of a terrain file."""
    return next((one for one in beside(path) if one.suffix.lower() == ".prj"), None)


def changes_heights(path: Path) -> Path | None:
    """A file beside that GDAL would heed for heights or place, and the plain readers don't; None where none does."""
    for one in beside(path):
        lower = one.name.lower()
        if lower.endswith(".msk") or (lower.endswith(".aux.xml") and _MEANS_SOMETHING.search(one.read_bytes())):
            return one
    return None


def declares_no_value(path: Path) -> Path | None:
    """An auxiliary file that names a no-data value, which GDAL does not heed for ASCII grids; None where none does."""
    named = (one for one in beside(path) if one.name.lower().endswith(".aux.xml"))
    return next((one for one in named if b"<NoDataValue" in one.read_bytes()), None)


def require_read(path: Path) -> None:
    """Raise InvalidTerrain, naming both, where something lies beside a file that its reader does not heed."""
    unread = changes_heights(path) or next((one for one in beside(path) if one.suffix.lower() in WORLD_FILES), None)
    if unread is not None:
        raise InvalidTerrain(
            f"{unread.name} lies beside {path.name} and is not heeded for files of this kind; remove it if it does not "
            f"belong to it, or bring both into one GeoTIFF: gdal_translate {path.name} ground.tif",
            beside=unread.name,
        )
