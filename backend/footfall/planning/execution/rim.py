"""How far a wheel is over the ground: a ball of its radius, which may fall until it touches."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at


def rim_clearance(dem: Dem, hubs: Array, radius: float) -> Array:
    """How far balls of a wheel's radius can fall before they touch the ground.

    Args:
        dem: the ground, in site.
        hubs: (n, 3) their middles, in site [m].
        radius: of the balls [m].

    Returns:
        (n,) [m]; negative: they would have to rise. Unknown ground is left out; NaN where all is unknown.
    """
    above = _above(dem, hubs, radius)[2]
    known = np.isfinite(above).any(axis=1)
    out = np.full(len(hubs), np.nan)
    out[known] = np.nanmin(above[known], axis=1)
    return out


def touching_place(dem: Dem, hub: Array, radius: float) -> Array | None:
    """Where a ball would touch the ground as it falls.

    Args:
        dem: the ground, in site.
        hub: (3,) its middle, in site [m].
        radius: of the ball [m].

    Returns:
        x, y (2,) in site [m]; None where all ground below it is unknown.
    """
    dx, dy, above = _above(dem, hub[None], radius)
    if not np.isfinite(above).any():
        return None
    at = int(np.nanargmin(above[0]))
    return np.array([hub[0] + dx[at], hub[1] + dy[at]])


def ground_known(dem: Dem, hubs: Array, radius: float) -> NDArray[np.bool_]:
    """Whether all ground straight below balls is known.

    Args:
        dem: the ground, in site.
        hubs: (n, 3) their middles, in site [m].
        radius: how far to each side [m].

    Returns:
        (n,).
    """
    dx, dy = _disc(dem, radius)
    heights = height_at(dem, hubs[:, :1] + dx, hubs[:, 1:2] + dy)
    return np.asarray(np.isfinite(heights).all(axis=1))


def _above(dem: Dem, hubs: Array, radius: float) -> tuple[Array, Array, Array]:
    """Offsets (k,) each, and how far the balls' undersides there are over the ground, (n, k); NaN: unknown."""
    dx, dy = _disc(dem, radius)
    lower = np.sqrt(np.maximum(radius * radius - dx * dx - dy * dy, 0.0))
    return dx, dy, hubs[:, 2:] - lower - height_at(dem, hubs[:, :1] + dx, hubs[:, 1:2] + dy)


def _disc(dem: Dem, radius: float) -> tuple[Array, Array]:
    """A lattice in the disc about the origin, as fine as the map or finer, (k,) each [m]."""
    steps = max(4, int(np.ceil(radius / dem.geometry.resolution)))
    offsets = np.linspace(-radius, radius, 2 * steps + 1)
    dx, dy = (part.ravel() for part in np.meshgrid(offsets, offsets))
    inside = dx * dx + dy * dy <= radius * radius
    return dx[inside], dy[inside]
