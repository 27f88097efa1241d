"""What a raster's first band says that it holds, by its description, unit and metadata: heights in metres, or not.

GDAL takes what a NetCDF file says along into a GeoTIFF, as ``positive`` of the band and ``x#units`` of the file.
"""

import re

from rasterio.io import DatasetReader

from footfall.core.errors import InvalidTerrain

_HEIGHTS = re.compile(
    r"height|elevation|altitude|relief|topograph|bare ?earth|surface model|\b(?:elev|d[ehst]m|z)\b", re.IGNORECASE
)
_OTHERS = re.compile(
    r"slope|aspect|hill ?shade|curvature|roughness|ruggedness|intensity|reflect|emissivity|radiance|insolation|albedo|"
    r"back ?scatter|temperature|moisture|humidity|rainfall|precipitation|velocity|density|probability|confidence|"
    r"\b(?:count|mask|class|temp|thermal|depth|thickness|wind|risk|hazard|cost|distance|coherence|amplitude|speed|"
    r"fraction|percentage|ratio|shadow|flow (?:accumulation|direction)|land ?(?:cover|use)|(?:nd|e|sa)[vw]i|t[pr]i)"
    r"(?:e?s|ified|ification)?\b",
    re.IGNORECASE,
)
_ABOUT_HEIGHTS = re.compile(
    r"\b(?:standard errors?|std(?: ?dev)?|stdev|sigma|rmse?|errors?|uncertain\w*|variances?|deviations?|accuracy|"
    r"precision|quality|differences?|changes?|anomal\w*|shaded?|hillshade|ind(?:ex|ices)|wetness|gradients?|number of|"
    r"slopes? of|aspects? of|roughness|curvature)\b",
    re.IGNORECASE,
)
"""Of heights, and no heights themselves."""

_OF_THINGS = re.compile(
    r"\b(?:canopy|vegetation|trees?|buildings?|snow|waves?|clouds?|geoid)(?: surface| top)? (?:heights?|elevations?)\b|"
    r"\bheights?(?: of [a-z ]+)? above (?:the )?(?:ground|nearest|terrain)\b|\b(?:chm|ndsm)\b|\bcanopy height model\b",
    re.IGNORECASE,
)
"""Heights of what stands on the ground or lies over it, counted from there; of the geoid over the ellipsoid."""
_BEHIND = re.compile(r"[,;(]| (?:from|by|with|without|of|for|at|in|above|over|on|relative|derived|after|using)\b")
"""Where a name goes on to say how it was made, or of what."""

_METRES = re.compile(r"(?:m|met(?:re|er)s?)(?: *(?:a\.?s\.?l\.?|above\b.*|\(.*\)))?|", re.IGNORECASE)
_NAMES = ("long_name", "standard_name", "description", "name", "band_name", "netcdf_varname", "grib_comment")
_UNITS = ("units", "unit", "unittype", "grib_unit")
_AXES = {"x", "y", "lon", "lat", "longitude", "latitude", "easting", "northing"}
_ALONG = re.compile(r"(?:projection|grid)_[xy]_coordinate|(?:grid_)?(?:longitude|latitude)|[XY]")


def check_band_is_of_heights(source: DatasetReader, name: str) -> None:
    """Refuse a raster whose first band is said to be something else than heights in metres, upwards."""
    if source.crs is None:
        _check_coordinates(source.tags(), name)
    tags = {key.lower(): said for key, said in source.tags(1).items()}
    for unit in (source.units[0], *(tags[key].strip(" []") for key in _UNITS if key in tags)):
        _check_unit(unit, name)
    if tags.get("positive", "").strip().lower() == "down":
        raise InvalidTerrain(
            f"the heights of {name} are depths: it says that they count downwards (positive: down); turn their sign, "
            "and take what it says of that out: gdal_calc.py -A … --calc=-A"
        )
    which = "the band" if source.count == 1 else f"the first of {source.count} bands"
    own = [source.descriptions[0], *(tags[key] for key in _NAMES if key in tags)]
    whole = source.tags().get("TIFFTAG_IMAGEDESCRIPTION", "").strip()
    if source.count == 1 and not any(own) and _OTHERS.match(whole):  # further on it may tell of the place
        own.append(whole)
    for about in own:
        if about and not _may_be_heights(about, sole=source.count == 1):
            raise InvalidTerrain(
                f"{which} of {name} is called {about[:60]!r}; heights must be the first band, or the only one "
                "(gdal_translate -b 2 …); if these are heights, let its description say so"
            )


def _check_unit(unit: str | None, name: str) -> None:
    if not _METRES.fullmatch((unit or "").strip()):
        raise InvalidTerrain(
            f"the heights of {name} are in {unit!r}; bring them to metres, and the unit that the file states too",
            unit=unit,
        )


def _check_coordinates(tags: dict[str, str], name: str) -> None:
    """Refuse coordinates that NetCDF had in another unit than metres, where no coordinate system says what they are."""
    for key, unit in tags.items():
        axis, _, about = key.partition("#")
        along = {tags.get(f"{axis}#{one}", "") for one in ("axis", "standard_name")}
        if about != "units" or not (axis.lower() in _AXES or any(map(_ALONG.fullmatch, along))):
            continue
        if unit.strip() != "1" and not _METRES.fullmatch(unit.strip()):
            raise InvalidTerrain(
                f"the coordinates of {name} are in {unit!r}, as it says of {axis}, and no coordinate system says more; "
                "bring them to metres, and take what it says of that out: gdal_translate -nomd -a_ullr WEST NORTH EAST "
                "SOUTH …, or reproject it",
                unit=unit,
            )


def _may_be_heights(about: str, sole: bool) -> bool:
    """Whether a band of that name may hold heights; beside others it has to be called so."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])|[_\-./]+", " ", re.sub(r"\([^)]*[0-9][^)]*\)|\[.*?\]", "", about))
    if _ABOUT_HEIGHTS.search(words) or _OF_THINGS.search(words):
        return False
    if _HEIGHTS.search(words):
        # the last noun says what it is: a DEM slope is a slope, a DEM by thermal images a DEM
        ends = [[found.end() for found in kind.finditer(_BEHIND.split(words)[0])] for kind in (_OTHERS, _HEIGHTS)]
        return max(ends[0], default=-1) <= max(ends[1], default=-1)
    return sole and not _OTHERS.search(words)
