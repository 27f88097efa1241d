"""What footfalls cost by the ground under the wheel: how steep and how rough it is, how old, and how sure.

A search puts feet elsewhere where that saves more than it costs. Limits are no matter of these costs: what is too steep
or lets a wheel in too deep is no footfall.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.planning.walk.footfalls import Footfalls
from footfall.planning.walk.guide import spread
from footfall.planning.walk.problem import FootfallCosts
from footfall.planning.walk.slope_frame import SlopeFrame
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.age import ages
from footfall.terrain.ground.surface import height_at

HOUR = 3600.0
_UNDER = 48
"""Places that the ground is looked at under a wheel."""


def costed(
    dem: Dem, places: Footfalls, radius: float, weights: FootfallCosts, frame: SlopeFrame | None = None
) -> Footfalls:
    """The places with what they cost.

    Args:
        dem: the ground, in site.
        places: where feet may be put.
        radius: of a wheel [m].
        weights: of slope, roughness, age and deviation.
        frame: of a slope, in whose frame places and ``dem`` are; it is the site's ground that knows its age. None: they
            are in site.

    Returns:
        The same places with costs.
    """
    costs = np.zeros(len(places.contacts))
    if weights.slope > 0:
        costs += weights.slope * np.arccos(np.clip(places.normals[:, 2], -1.0, 1.0))
    if weights.roughness > 0:
        costs += weights.roughness * roughness_under(dem, places, radius)
    remembers, at = (dem, places.contacts) if frame is None else (frame.dem, frame.to_site(places.contacts))
    if weights.age > 0:
        costs += weights.age / HOUR * oldest_under(remembers, at, radius)
    if weights.deviation > 0 and remembers.variance is not None:
        costs += weights.deviation * _most_under(remembers, np.sqrt(remembers.variance), at, radius)
    return replace(places, costs=costs)


def roughness_under(dem: Dem, places: Footfalls, radius: float) -> Array:
    """RMS distance of the ground around places from the plane that fits it best.

    Ground that is not known there is taken to lie in the plane of the contact.

    Args:
        dem: the ground, in site.
        places: where feet may be put.
        radius: how far around [m].

    Returns:
        (n,) [m].
    """
    (x, y, contact), normals = places.contacts.T, places.normals
    dx, dy = spread(radius, _UNDER)
    z = height_at(dem, x[:, None] + dx, y[:, None] + dy)
    plane = contact[:, None] - (normals[:, :1] * dx + normals[:, 1:2] * dy) / normals[:, 2:]
    z = np.where(np.isfinite(z), z, plane) - contact[:, None]
    columns = np.column_stack([dx, dy, np.ones(_UNDER)])
    off = z - z @ np.linalg.pinv(columns).T @ columns.T
    return normals[:, 2] * np.sqrt(np.square(off).mean(axis=1))


def oldest_under(dem: Dem, places: Array, radius: float) -> Array:
    """How much older the oldest ground around places is than the newest of the map.

    Args:
        dem: the ground, in site.
        places: (n, 3) in site [m].
        radius: how far around [m].

    Returns:
        (n,) [s]; 0 where nothing says.
    """
    return _most_under(dem, ages(dem), places, radius)


def _most_under(dem: Dem, layer: NDArray[np.float32], places: Array, radius: float) -> Array:
    """Largest number of a layer (rows, cols) in cells within ``radius`` [m] of places (n, 3); 0 where it knows none."""
    grid, (dx, dy) = dem.geometry, spread(radius, _UNDER)
    columns = np.rint((places[:, :1] + dx - grid.x0) / grid.resolution).astype(int)
    rows = np.rint((places[:, 1:2] + dy - grid.y0) / grid.resolution).astype(int)
    inside = (rows >= 0) & (rows < grid.rows) & (columns >= 0) & (columns < grid.cols)
    known = layer[np.clip(rows, 0, grid.rows - 1), np.clip(columns, 0, grid.cols - 1)].astype(float)
    return np.where(inside & np.isfinite(known), known, 0.0).max(axis=1)
