"""Files beside a terrain file that change how it is read: heeded, or refused where they can't be.

=============================== ==================================================================================
mask                            ``.msk``
auxiliary file                  ``.aux.xml``, ``.aux`` (ERDAS): no-data value, scale, offset, unit, coordinates, place
place                           world files (``.tfw``, …), ``.tab`` (MapInfo), ``.rpb`` and ``_rpc.txt`` (rational
                                polynomials)
coordinates                     ``.prj``, ``.qpj`` (QGIS), beside files of every kind
what changes no height          ``.ovr``, ``.hdr``, ``.stx``, ``.clr``, ``.xml`` of others
=============================== ==================================================================================

GDAL heeds all but the coordinates when it opens a GeoTIFF by its path, and of an ASCII grid the mask and a part of the
auxiliary file. Other kinds of files are read by other means.
"""

import re
from pathlib import Path
from xml.etree import ElementTree

from footfall.core.errors import InvalidTerrain

WORLD_FILES = (".tfw", ".tifw", ".tiffw", ".wld", ".pgw", ".pngw", ".asw", ".ascw")
_PLACES = (*WORLD_FILES, ".tab", ".rpb", "_rpc.txt")
_COORDINATES = (".prj", ".qpj")
_NO_HEIGHTS = (".hdr", ".stx", ".clr", ".ovr")
_BESIDE_NAME = (".msk", ".aux.xml", ".aux", ".ovr", ".ovr.msk", ".xml")
_BESIDE_STEM = (".aux.xml", ".aux", *_COORDINATES, *_PLACES, *_NO_HEIGHTS)
MOST_BESIDE = 10
"""Files that an upload may have beside its terrain."""

# Statistics, histograms and the area or point convention of others change no height.
_MEANS_SOMETHING = re.compile(
    rb"<(SRS|GeoTransform|GCPList|GeodataXform|NoDataValue|Scale|Offset|UnitType|MaskBand|ColorInterp|Description)\b"
    rb'|<Metadata\s[^>]*domain="(RPC|GEOLOCATION)"'
)
_ASC_STATES = {
    b"NoDataValue": ("a no-data value", "write it as NODATA_value into"),
    b"GeoTransform": ("a place", "write it as xllcorner, yllcorner and cellsize into"),
}


def names_beside(name: str) -> frozenset[str]:
    """Names, in lower case, of the files that may belong to terrain file ``name``."""
    lower = name.lower()
    stem = lower.rpartition(".")[0] or lower
    return frozenset({lower + ending for ending in _BESIDE_NAME} | {stem + ending for ending in _BESIDE_STEM})


def beside(path: Path) -> list[Path]:
    """The files that lie beside a terrain file and belong to it, whatever the case of their names."""
    wanted = names_beside(path.name)
    return sorted(
        one for one in path.parent.iterdir() if one.name.lower() in wanted and one.is_file() and one.name != path.name
    )


def coordinates_beside(path: Path) -> list[tuple[str, str]]:
    """(file, text) of all that say what the coordinates of a terrain file are: ``.prj``, ``.qpj``, ``.aux.xml``."""
    texts = [(one.name, one.read_text("utf-8-sig", "replace")) for one in _of_kind(path, _COORDINATES)]
    for one in _auxiliary(path):
        found = _root(one).findtext("SRS")
        if found is not None:
            texts.append((one.name, found))
    return texts


def changes_heights(path: Path) -> Path | None:
    """A file beside that GDAL would heed for heights or place, and the plain readers don't; None where none does."""
    masks = [one for one in beside(path) if one.name.lower() == f"{path.name}.msk".lower()]
    erdas = [one for one in _of_kind(path, (".aux",)) if one.read_bytes()[:4] == b"EHFA"]
    meaning = [one for one in _auxiliary(path) if _MEANS_SOMETHING.search(one.read_bytes())]
    return next(iter((*masks, *meaning, *erdas)), None)


def mask_beside(path: Path) -> Path | None:
    """The mask of a raster."""
    return next((one for one in beside(path) if one.name.lower() == f"{path.name}.msk".lower()), None)


def place_beside(path: Path) -> Path | None:
    """A file that says where a raster lies."""
    return next(iter(_of_kind(path, _PLACES)), None)


def require_stated_once(path: Path) -> None:
    """Raise InvalidTerrain where an auxiliary file says what an ASCII grid states itself, which GDAL goes by."""
    for one in _auxiliary(path):
        for word, (what, how) in _ASC_STATES.items():
            if b"<" + word in one.read_bytes():
                raise InvalidTerrain(
                    f"{one.name} names {what}, which ASCII grids state themselves; {how} {path.name}, or make both a "
                    "GeoTIFF",
                    beside=one.name,
                )


def require_heeded(path: Path) -> None:
    """Raise InvalidTerrain where an auxiliary file lies beside a raster whose name GDAL does not look for."""
    for one in _auxiliary(path):
        if one.name != f"{path.name}.aux.xml" and _MEANS_SOMETHING.search(one.read_bytes()):
            raise InvalidTerrain(
                f"{one.name} lies beside {path.name}, whose auxiliary file would be called {path.name}.aux.xml; name "
                "it so, or remove it if it does not belong to it",
                beside=one.name,
            )


def require_read(path: Path) -> None:
    """Raise InvalidTerrain, naming both, where something lies beside a file that its reader does not heed."""
    unread = changes_heights(path) or place_beside(path)
    if unread is not None:
        raise InvalidTerrain(
            f"{unread.name} lies beside {path.name} and is not heeded for files of this kind; remove it if it does not "
            f"belong to it, or bring both into one GeoTIFF: gdal_translate {path.name} ground.tif",
            beside=unread.name,
        )


def require_alone(path: Path) -> None:
    """Raise InvalidTerrain where a mask or an auxiliary file of another terrain would change one that is written."""
    stale = changes_heights(path)
    if stale is not None and stale.name.lower().startswith(path.name.lower()):
        raise InvalidTerrain(
            f"{stale.name} lies where {path.name} is to be written, and would change how it is read; remove it, or "
            "write under another name",
            beside=stale.name,
        )


def _of_kind(path: Path, endings: tuple[str, ...]) -> list[Path]:
    return [one for one in beside(path) if one.name.lower().endswith(endings)]


def _auxiliary(path: Path) -> list[Path]:
    return _of_kind(path, (".aux.xml",))


def _root(path: Path) -> ElementTree.Element:
    """An auxiliary file. Raises InvalidTerrain for one that is damaged, as whatever it declared is lost."""
    text = path.read_bytes().decode("utf-8-sig", "replace")
    try:
        if re.search(r"<!(?!--|\[CDATA\[)", text):  # document types, and with them entities
            raise ElementTree.ParseError
        return ElementTree.fromstring(re.sub(r"^\s*<\?xml[^>]*\?>", "", text))
    except ElementTree.ParseError as err:
        raise InvalidTerrain(
            f"{path.name} is no whole XML, so what it declares is lost; write it anew, or remove it", beside=path.name
        ) from err
