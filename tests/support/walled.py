"""Level ground for small robots with a wall that a straight way to GOAL meets, and that a way round its end passes."""

import numpy as np
from shapely.geometry import Polygon, box

from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights

GOAL = (1.3, -0.6)
HALF, CELL = 2.0, 0.02
WALL: Polygon = box(0.6, -0.3, 0.7, HALF)
"""What of the ground is the wall, in site [m]."""


def walled(height: float = 0.5, wall: Polygon = WALL) -> Dem:
    """The ground, 4 m × 4 m about the origin, with a wall so high [m]."""
    at = np.arange(-round(HALF / CELL), round(HALF / CELL) + 1) * CELL
    west, south, east, north = wall.bounds
    inside = (west <= at) & (at <= east) & ((south <= at) & (at <= north))[:, None]
    return from_heights(np.where(inside, np.float32(height), np.float32(0)), CELL, float(at[0]), float(at[0]), "a wall")
