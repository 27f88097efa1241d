"""The way that the chassis would go if only the ground's height mattered: a guide for the search, checked for nothing.

It leads from where the chassis is to the goal, straight or around what is in the way (``around.py``), at the height and
with a share of the slope of the ground under the feet; its heading goes evenly. A leg reaches a footfall from a *span*
of it.
"""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.walk.footprint import FOLLOWS_SLOPE, Footprint
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

STEP = 0.05
"""From one pose of the guide to the next [m]."""
METRES_A_RADIAN = 1.2
"""A turn by so much counts as so many metres of the way."""
_AROUND = 48
"""Places that the ground is looked at under each pose."""


@dataclass(frozen=True, eq=False)
class Guide:
    """vectors: (n, 6) x, y, z [m], roll, pitch, yaw [rad]; ways: (n,) how far along each is [m], the first at 0."""

    vectors: Array
    ways: Array

    @property
    def length(self) -> float:
        """How long the way is [m]."""
        return float(self.ways[-1])

    def at(self, way: float) -> Array:
        """The pose (6,) so far along [m]."""
        return np.array([np.interp(way, self.ways, column) for column in self.vectors.T])


def guide(dem: Dem, begin: Array, end: Array, footprint: Footprint, through: Array | None = None) -> Guide:
    """A way of the chassis, straight or from point to point, that follows the ground.

    Args:
        dem: the ground without holes, in site.
        begin: x, y [m] and yaw [rad], (3,).
        end: the same at the end, (3,).
        footprint: where feet are at ease, and how high the chassis is over them.
        through: points (n, 2) with both ends [m]; None: straight.

    Returns:
        The way.
    """
    through = np.array([begin[:2], end[:2]]) if through is None else through
    turn = (end[2] - begin[2] + math.pi) % (2 * math.pi) - math.pi
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(through, axis=0).T))])
    length = math.hypot(ways[-1], METRES_A_RADIAN * turn)
    count = max(2, 1 + math.ceil(length / STEP))
    share = np.linspace(0.0, 1.0, count)
    x, y = (np.interp(share * ways[-1], ways, column) for column in through.T)
    yaw = begin[2] + share * turn
    dx, dy = spread(float(np.hypot(footprint.feet[:, 0], footprint.feet[:, 1]).max()), _AROUND)
    z = height_at(dem, x[:, None] + dx, y[:, None] + dy)
    z = np.where(np.isfinite(z), z, np.nanmean(z))
    middle = z.mean(axis=1)
    east = ((z - middle[:, None]) * dx).sum(axis=1) / (dx**2).sum()
    north = ((z - middle[:, None]) * dy).sum(axis=1) / (dy**2).sum()
    c, s = np.cos(yaw), np.sin(yaw)
    rise, bank = c * east + s * north, c * north - s * east
    roll, pitch = np.arctan(FOLLOWS_SLOPE * bank), -np.arctan(FOLLOWS_SLOPE * rise)
    return Guide(np.column_stack([x, y, middle + footprint.height, roll, pitch, yaw]), share * length)


def spread(radius: float, count: int) -> tuple[Array, Array]:
    """Coordinates x and y (count,) [m] of places spread evenly over a disc of radius [m], after Vogel's sunflower."""
    number = np.arange(count) + 0.5
    away, angle = radius * np.sqrt(number / count), number * math.pi * (3.0 - math.sqrt(5.0))
    return away * np.cos(angle), away * np.sin(angle)
