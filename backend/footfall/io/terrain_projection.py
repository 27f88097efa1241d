"""What a file says of its coordinates and heights: only metres, true to scale, make a terrain."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rasterio._err import CPLE_BaseError
from rasterio.crs import CRS
from rasterio.errors import CRSError
from rasterio.warp import transform

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain

MOST_STRETCH = 0.01
"""A map whose metres are longer or shorter than the ground's by a larger share than this is refused."""

_WKT = re.compile(
    r'(?P<open>[A-Z][A-Z0-9]*)\[(?:"(?P<name>(?:[^"]|"")*)"(?:,(?P<number>[-+0-9.eE]+))?)?|"(?:[^"]|"")*"|(?P<close>\])'
)
_ELSEWHERE = frozenset(
    {"ELLIPSOID", "PRIMEM", "PARAMETER", "CONVERSION", "METHOD", "DATUM", "ENSEMBLE", "BASEGEOGCRS", "BASEGEODCRS",
     "BASEPROJCRS", "DERIVINGCONVERSION", "ABRIDGEDTRANSFORMATION", "USAGE", "AREA", "BBOX", "VERTICALEXTENT",
     "MERIDIAN", "TARGETCRS"}
)  # fmt: skip
_EPSG = re.compile(r"EPSG:\d{1,6}(?:\+\d{1,6})?")
_VERTICAL = frozenset({"VERTCRS", "VERTICALCRS"})
_AXIS = re.compile(r'AXIS\["(?:[^"]|"")*",([A-Za-z]+)')
_TURNED = ("west", "south")
_ANGLE = re.compile(r'PRIMEM\[(?:"[^"]*"|[^\[\]"]|\[[^\[\]]*\])*\],UNIT\["[^"]*",([0-9.eE+-]+)')
_SPHEROID = re.compile(r'(?:SPHEROID|ELLIPSOID)\["[^"]*",([0-9.eE+]+),([0-9.eE+]+)')


def check_crs(crs: CRS | None, name: str) -> None:
    """Refuse coordinates that are not metres; none at all are taken as local metres."""
    if crs is None:
        return
    wkt = crs.to_wkt(version="WKT2_2019")
    if "geocentricX" in wkt:
        raise InvalidTerrain(f"the coordinates of {name} are geocentric; reproject it to metres on a map, such as UTM")
    if "DERIVEDPROJCRS[" in wkt:
        raise InvalidTerrain(
            f"the coordinates of {name} are derived from a projection, and how long their metres are is not to tell; "
            "reproject it, such as to UTM"
        )
    _check_directions(_AXIS.findall(wkt), wkt.startswith("ENGCRS["), name)
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


def _check_directions(axes: list[str], local: bool, name: str) -> None:
    """Refuse depths, and local coordinates that run west or south; of projections :func:`convergence` tells that."""
    if "down" in (one.lower() for one in axes):
        raise InvalidTerrain(
            f"the heights of {name} are depths: its coordinate system counts them downwards; turn their sign and name "
            "a system of heights"
        )
    turned = [one.lower() for one in axes if local and one.lower() in _TURNED]
    if turned:
        raise InvalidTerrain(
            f"the coordinates of {name} run {' and '.join(turned)}, as its coordinate system says; turn it so that "
            "they run east and north"
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


def check_true_to_scale(crs: CRS | None, bounds: Sequence[float], name: str) -> None:
    """Refuse a projection whose metres are not the ground's anywhere in ``bounds`` (west, south, east, north).

    Web maps (Mercator) stretch everything by 1 / cos(latitude), plate carrée east against north: slopes come out wrong.
    """
    if crs is None or not crs.is_projected:
        return
    west, south, east, north = bounds
    places = [(x, y) for x in (0.5 * (west + east), west, east) for y in (0.5 * (south + north), south, north)]
    globe = _globe(crs)
    if globe is None:
        raise InvalidTerrain(
            f"how long the metres of {name} are is not to tell from its projection; reproject it, such as to UTM"
        )
    there = [_lengths(crs, globe, place, name) for place in places]
    if there[0].mirrored:
        raise InvalidTerrain(
            f"{name} is mirrored: the axes of its projection run clockwise; reproject it to one with axes east and "
            "north, such as UTM"
        )
    off = [max(abs(one.x - 1.0), abs(one.y - 1.0)) for one in there]
    # the middle first: what is wrong there is wrong everywhere
    worst = 0 if off[0] > MOST_STRETCH else int(np.argmax(off))
    if off[worst] > MOST_STRETCH:
        where = "in its middle" if worst == 0 else "at its edge"
        raise InvalidTerrain(
            f"{name} is not true to scale: {where} a metre of its coordinates is {there[worst].x:z.3f} m of ground "
            f"along the columns' axis and {there[worst].y:z.3f} m along the rows'; reproject it, such as to UTM or a "
            "projection about its middle",
            lengths=[there[worst].x, there[worst].y],
        )


def convergence(crs: CRS | None, bounds: Sequence[float]) -> tuple[float, float, float] | None:
    """How far true north is turned clockwise from the columns' axis [deg]: in the middle of ``bounds``, least, most.

    None where the coordinates say nothing of the globe.
    """
    if crs is None or not crs.is_projected or (globe := _globe(crs)) is None:
        return None
    west, south, east, north = bounds
    x, y = np.meshgrid((0.5 * (west + east), west, east), (0.5 * (south + north), south, north))
    try:
        lon, lat = globe.places(crs, x.ravel(), y.ravel())
        # towards the equator where the pole is in the way
        step = np.where(lat < np.radians(89.0), 1e-5, -1e-5)
        ahead_x, ahead_y, *_ = transform(globe.crs, crs, lon / globe.angle, (lat + step) / globe.angle)
    except (CRSError, CPLE_BaseError):
        return None
    sign = np.sign(step)
    turned = np.rad2deg(np.arctan2(sign * (np.asarray(ahead_x) - x.ravel()), sign * (np.asarray(ahead_y) - y.ravel())))
    if not np.isfinite(turned).all():
        return None
    around = turned[0] + (turned - turned[0] + 180.0) % 360.0 - 180.0
    return float(turned[0]), float(around.min()), float(around.max())


@dataclass(frozen=True)
class _Globe:
    """Geographic coordinates that a projection is made from. angle: their unit [rad]; axis: of the ellipsoid [m]."""

    crs: CRS
    angle: float
    axis: float
    inverse_flattening: float

    def places(self, crs: CRS, x: Sequence[float] | Array, y: Sequence[float] | Array) -> tuple[Array, Array]:
        """Longitudes and latitudes [rad]."""
        lon, lat, *_ = transform(crs, self.crs, x, y)
        return self.angle * np.asarray(lon, float), self.angle * np.asarray(lat, float)


@dataclass(frozen=True)
class _Lengths:
    """Ground lengths of a coordinate metre along x and along y, and whether y lies clockwise of x."""

    x: float
    y: float
    mirrored: bool


def _globe(crs: CRS) -> _Globe | None:
    """None where the coordinates say nothing of the globe."""
    wkt = crs.to_wkt()
    if "GEOGCS[" not in wkt:  # systems of three dimensions have no such form; their proj4 names two
        try:
            wkt = CRS.from_proj4(crs.to_proj4()).to_wkt()
        except CRSError:
            return None
    geographic, sizes = _geographic_part(wkt), _SPHEROID.search(wkt)
    if geographic is None or sizes is None:
        return None
    unit = _ANGLE.search(geographic)
    angle = np.pi / 180.0 if unit is None else float(unit[1])
    return _Globe(CRS.from_wkt(geographic), angle, float(sizes[1]), float(sizes[2]))


def _lengths(crs: CRS, globe: _Globe, place: tuple[float, float], name: str) -> _Lengths:
    """At a place. Raises InvalidTerrain where the projection has no ground there."""
    x, y = place
    half = 50.0
    try:
        lon, lat = globe.places(crs, [x - half, x + half, x, x], [y, y, y - half, y + half])
    except (CRSError, CPLE_BaseError):
        lon = lat = np.full(4, np.nan)
    if not np.isfinite([lon, lat]).all():
        raise InvalidTerrain(
            f"{name} lies where its projection has no ground, such as at ({x:z.0f}, {y:z.0f}); its place or its "
            "projection is wrong",
            place=[x, y],
        )
    points = _on_ellipsoid(lon, lat, globe.axis, globe.inverse_flattening)
    along_x, along_y = points[1] - points[0], points[3] - points[2]
    lengths = np.linalg.norm([along_x, along_y], axis=1) / (2.0 * half)
    mirrored = float(np.cross(along_x, along_y) @ points.mean(axis=0)) < 0.0
    return _Lengths(float(lengths[0]), float(lengths[1]), mirrored)


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
