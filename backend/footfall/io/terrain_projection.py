"""What a file says of its coordinates and heights: only metres, true to scale, make a terrain."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rasterio.crs import CRS
from rasterio.errors import CRSError
from rasterio.warp import transform

from footfall.core.errors import InvalidTerrain

Array = NDArray[np.float64]

MOST_STRETCH = 0.01
"""A map whose metres are longer or shorter than the ground's by a larger share than this is refused."""

_METRES = ("", "m", "metre", "metres", "meter", "meters")
_WKT = re.compile(
    r'(?P<open>[A-Z][A-Z0-9]*)\[(?:"(?P<name>(?:[^"]|"")*)"(?:,(?P<number>[-+0-9.eE]+))?)?|"(?:[^"]|"")*"|(?P<close>\])'
)
_ELSEWHERE = frozenset(
    {"ELLIPSOID", "PRIMEM", "PARAMETER", "CONVERSION", "METHOD", "DATUM", "ENSEMBLE", "BASEGEOGCRS", "BASEGEODCRS",
     "BASEPROJCRS", "DERIVINGCONVERSION", "ABRIDGEDTRANSFORMATION", "USAGE", "AREA", "BBOX", "VERTICALEXTENT"}
)  # fmt: skip
_EPSG = re.compile(r"EPSG:\d{1,6}(?:\+\d{1,6})?")
_VERTICAL = frozenset({"VERTCRS", "VERTICALCRS"})
_SPHEROID = re.compile(r'(?:SPHEROID|ELLIPSOID)\["[^"]*",([0-9.eE+]+),([0-9.eE+]+)')


def check_crs(crs: CRS | None, name: str) -> None:
    """Refuse coordinates that are not metres; none at all are taken as local metres."""
    if crs is None:
        return
    if "geocentricX" in crs.to_wkt(version="WKT2_2019"):
        raise InvalidTerrain(f"the coordinates of {name} are geocentric; reproject it to metres on a map, such as UTM")
    for unit in units(crs):
        if unit.angle:
            raise InvalidTerrain(
                f"the coordinates of {name} are degrees ({crs.to_string()[:60]}); reproject it to metres, such as UTM"
            )
        if abs(unit.factor - 1.0) > 1e-9:
            what, how = (
                ("heights", "bring them to metres") if unit.height else ("coordinates", "reproject it to metres")
            )
            raise InvalidTerrain(
                f"the {what} of {name} are in {unit.name} ({unit.factor:g} m), as its coordinate system says; {how}",
                unit=unit.name,
            )


@dataclass(frozen=True)
class Unit:
    """A unit of a coordinate system. factor: to metres, or radians where it is of an angle; height: of its heights."""

    name: str
    factor: float
    angle: bool
    height: bool


def units(crs: CRS) -> list[Unit]:
    """Units of the coordinates of a system of any kind, compound and local ones too: those of WKT 2 (ISO 19162) that
    stand at the axes, not those of the ellipsoid, of parameters, or of what it is derived from.
    """
    wkt = crs.to_wkt(version="WKT2_2019")
    found: list[Unit] = []
    within: list[tuple[str, str]] = []
    for token in _WKT.finditer(wkt):
        if token["close"]:
            within = within[:-1]
        elif token["open"]:
            within.append((token["open"], token["name"] or ""))
            kinds = {kind for kind, _ in within}
            if token["open"] in ("LENGTHUNIT", "ANGLEUNIT") and token["number"] and not _ELSEWHERE & kinds:
                height = bool(_VERTICAL & kinds) or any(k == "AXIS" and "height" in name.lower() for k, name in within)
                found.append(Unit(token["name"], float(token["number"]), token["open"] == "ANGLEUNIT", height))
    return list(dict.fromkeys(found))


def check_projection_text(wkt: str, name: str) -> CRS:
    """The coordinates that a .prj file says, as WKT or an EPSG code; refuses all but metres."""
    try:
        code = _EPSG.fullmatch(wkt.strip())
        # no other texts: some name files and addresses, which GDAL would open
        crs = CRS.from_wkt(wkt, morph_from_esri_dialect=True) if code is None else CRS.from_string(code[0])
    except CRSError as err:
        raise InvalidTerrain(
            f"{name} does not describe coordinates: it begins with {wkt.strip()[:40]!r}; it needs WKT, such as "
            'PROJCS["WGS 84 / UTM zone 33N",…]'
        ) from err
    check_crs(crs, name)
    return crs


def check_height_unit(unit: str | None, name: str) -> None:
    """Refuse heights whose file says that they are not metres, in its band or its vertical coordinates."""
    if (unit or "").strip().lower() not in _METRES:
        raise InvalidTerrain(
            f"the heights of {name} are in {unit!r}; bring them to metres, and the unit that the file states too",
            unit=unit,
        )


def check_true_to_scale(crs: CRS | None, bounds: Sequence[float], name: str) -> None:
    """Refuse a projection whose metres are not the ground's anywhere in ``bounds`` (west, south, east, north).

    Web maps (Mercator) stretch everything by 1 / cos(latitude), plate carrée east against north: slopes come out wrong.
    """
    if crs is None or not crs.is_projected:
        return
    west, south, east, north = bounds
    places = [(x, y) for x in (0.5 * (west + east), west, east) for y in (0.5 * (south + north), south, north)]
    there = [(found, place) for place in places if (found := _lengths(crs, *place)) is not None]
    if not there:
        return
    off = [max(abs(one[0] - 1.0), abs(one[1] - 1.0)) for one, _ in there]
    # the middle first: what is wrong there is wrong everywhere
    worst = 0 if off[0] > MOST_STRETCH else int(np.argmax(off))
    found, (x, y) = there[worst]
    if off[worst] > MOST_STRETCH:
        where = "in its middle" if (x, y) == places[0] else "at its edge"
        raise InvalidTerrain(
            f"{name} is not true to scale: {where} a metre of its coordinates is {found[0]:z.3f} m of ground along the "
            f"columns' axis and {found[1]:z.3f} m along the rows'; reproject it, such as to UTM or a projection about "
            "its middle",
            lengths=list(found),
        )


def convergence(crs: CRS | None, bounds: Sequence[float]) -> tuple[float, float, float] | None:
    """How far true north is turned clockwise from the columns' axis [deg]: in the middle of ``bounds``, least, most.

    None where the coordinates say nothing of the globe.
    """
    if crs is None or not crs.is_projected or (geographic := _geographic_part(crs.to_wkt())) is None:
        return None
    west, south, east, north = bounds
    x, y = np.meshgrid((0.5 * (west + east), west, east), (0.5 * (south + north), south, north))
    globe = CRS.from_wkt(geographic)
    try:
        lon, lat, *_ = transform(crs, globe, x.ravel(), y.ravel())
        # towards the equator where the pole is in the way
        step = np.where(np.asarray(lat) < 89.0, 1e-3, -1e-3)
        ahead_x, ahead_y, *_ = transform(globe, crs, lon, np.asarray(lat) + step)
    except CRSError:
        return None
    sign = np.sign(step)
    turned = np.rad2deg(np.arctan2(sign * (np.asarray(ahead_x) - x.ravel()), sign * (np.asarray(ahead_y) - y.ravel())))
    if not np.isfinite(turned).all():
        return None
    around = turned[0] + (turned - turned[0] + 180.0) % 360.0 - 180.0
    return float(turned[0]), float(around.min()), float(around.max())


def _lengths(crs: CRS, x: float, y: float) -> tuple[float, float] | None:
    """Ground lengths of a coordinate metre along x and along y at a point; None where the file does not tell."""
    geographic, sizes = _geographic_part(crs.to_wkt()), _SPHEROID.search(crs.to_wkt())
    if geographic is None or sizes is None:
        return None
    half = 50.0
    across, along = [x - half, x + half, x, x], [y, y, y - half, y + half]
    try:
        lon, lat, *_ = transform(crs, CRS.from_wkt(geographic), across, along)
    except CRSError:
        return None
    if not np.isfinite([*lon, *lat]).all():
        return None
    places = _on_ellipsoid(np.deg2rad(lon), np.deg2rad(lat), float(sizes[1]), float(sizes[2]))
    lengths = np.linalg.norm(places[1::2] - places[0::2], axis=1) / (2.0 * half)
    return float(lengths[0]), float(lengths[1])


def _on_ellipsoid(lon: Array, lat: Array, axis: float, inverse_flattening: float) -> Array:
    """Points (n, 3) [m] of longitudes and latitudes (n,) [rad] (Snyder, *Map Projections*, USGS 1395, 1987, p. 13, 25).

    inverse_flattening: 0 of a sphere, as WKT has it.
    """
    flattening = 1.0 / inverse_flattening if inverse_flattening else 0.0
    squared = flattening * (2.0 - flattening)
    across = axis / np.sqrt(1.0 - squared * np.sin(lat) ** 2)
    equatorial = across * np.cos(lat)
    return np.stack(
        [equatorial * np.cos(lon), equatorial * np.sin(lon), (1.0 - squared) * across * np.sin(lat)], axis=1
    )


def _geographic_part(wkt: str) -> str | None:
    """The geographic coordinates that a projection is made from, out of its WKT."""
    start = wkt.find("GEOGCS[")
    depth = 0
    for end in range(start, len(wkt) if start >= 0 else start):
        depth += {"[": 1, "]": -1}.get(wkt[end], 0)
        if depth == 0 and wkt[end] == "]":
            return wkt[start : end + 1]
    return None
