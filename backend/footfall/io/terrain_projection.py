"""What a file says of its coordinates and heights: only metres, true to scale, make a terrain."""

import re
from collections.abc import Sequence

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
_SPHEROID = re.compile(r'(?:SPHEROID|ELLIPSOID)\["[^"]*",([0-9.eE+]+),([0-9.eE+]+)')


def check_crs(crs: CRS | None, name: str) -> None:
    """Refuse coordinates that are not metres; none at all are taken as local metres."""
    if crs is None:
        return
    if crs.is_geographic:
        raise InvalidTerrain(
            f"the coordinates of {name} are degrees ({crs.to_string()[:60]}); reproject it to metres, such as UTM"
        )
    try:
        unit, factor = crs.linear_units_factor
    except CRSError:
        return
    if abs(factor - 1.0) > 1e-9:
        raise InvalidTerrain(f"the coordinates of {name} are in {unit} ({factor:g} m); reproject it to metres")


def check_projection_text(wkt: str, name: str) -> None:
    """Refuse what a .prj file beside a grid says, unless it says metres."""
    try:
        crs = CRS.from_wkt(wkt, morph_from_esri_dialect=True)
    except CRSError as err:
        raise InvalidTerrain(f"{name} does not describe coordinates: {err}") from err
    check_crs(crs, name)


def check_height_unit(unit: str | None, name: str) -> None:
    """Refuse heights whose file says that they are not metres, in its band or its vertical coordinates."""
    if (unit or "").strip().lower() not in _METRES:
        raise InvalidTerrain(
            f"the heights of {name} are in {unit!r}; bring them to metres, and the unit that the file states too",
            unit=unit,
        )


def check_true_to_scale(crs: CRS | None, bounds: Sequence[float], name: str) -> None:
    """Refuse a projection whose metres are not the ground's at the middle of ``bounds`` (west, south, east, north).

    Web maps (Mercator) stretch everything by 1 / cos(latitude), plate carrée east against north: slopes come out wrong.
    """
    if crs is None or not crs.is_projected:
        return
    found = _lengths(crs, 0.5 * (bounds[0] + bounds[2]), 0.5 * (bounds[1] + bounds[3]))
    if found is not None and max(abs(found[0] - 1.0), abs(found[1] - 1.0)) > MOST_STRETCH:
        raise InvalidTerrain(
            f"{name} is not true to scale: there a metre of its coordinates is {found[0]:.3f} m of ground along the "
            f"columns' axis and {found[1]:.3f} m along the rows'; reproject it, such as to UTM or a projection about "
            "its middle",
            lengths=list(found),
        )


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
