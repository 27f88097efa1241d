"""Where feet that end in balls, points or discs rest on the ground, and how far they are above it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

LATTICE = 8
"""Points of a ball's lower half to each side of its middle that are held against the ground: a ball sinks in by less
than 1 / (2 · LATTICE²) of its radius."""
FEET_OFF = 2e-3
"""How far a foot that stands may be from where it is said to be, and from the ground [m]."""
LEAST_DISC = 0.02
"""Radius of the ground whose normal counts, where the foot is smaller [m]."""


class Rest(NamedTuple):
    """Of a foot on the ground: centre of its sole, contact and the ground's normal, (3,) in site [m]; NaN: unknown."""

    center: Array
    contact: Array
    normal: Array


def rest(dem: Dem, x: float, y: float, radius: float) -> Rest:
    """The rest of a ball that is let down until it touches; a disc counts as the ball around it.

    Args:
        dem: the ground, in site.
        x: east, in site [m].
        y: north, in site [m].
        radius: of the ball, 0: a point [m].

    Returns:
        Centre, contact and normal of the ground.
    """
    dx, dy, up = _lower_half(radius)
    heights = height_at(dem, x + dx, y + dy)
    if not np.isfinite(heights).all():
        nothing = np.full(3, np.nan)
        return Rest(nothing, nothing, nothing)
    at = int(np.argmax(heights + up))
    center = np.array([x, y, heights[at] + up[at]])
    contact = np.array([x + dx[at], y + dy[at], heights[at]])
    return Rest(center, contact, normal_at(dem, x, y, max(radius, LEAST_DISC, dem.geometry.resolution)))


def rest_heights(dem: Dem, xy: ArrayLike, radius: float) -> Array:
    """Heights of a ball's centre that is let down at places.

    Args:
        dem: the ground, in site.
        xy: (n, 2) in site [m].
        radius: of the ball, 0: a point [m].

    Returns:
        (n,) [m]; NaN over unknown ground.
    """
    places = np.asarray(xy, float)
    dx, dy, up = _lower_half(radius)
    return (height_at(dem, places[:, 0, None] + dx, places[:, 1, None] + dy) + up).max(axis=1)


@lru_cache(maxsize=16)
def _lower_half(radius: float) -> tuple[Array, Array, Array]:
    """Offsets of points of a ball's lower half from its middle, and the middle's height above each, (k,) each [m]."""
    if radius == 0:
        return np.zeros(1), np.zeros(1), np.zeros(1)
    steps = np.arange(-LATTICE, LATTICE + 1) * (radius / LATTICE)
    dx, dy = np.tile(steps, len(steps)), np.repeat(steps, len(steps))
    inside = dx**2 + dy**2 <= radius**2
    dx, dy = np.asarray(dx[inside], float), np.asarray(dy[inside], float)
    return dx, dy, np.sqrt(np.maximum(radius**2 - dx**2 - dy**2, 0.0))
