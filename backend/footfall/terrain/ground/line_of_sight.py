"""Which points can be seen over the ground."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

TOLERANCE = 0.02
"""Ground has to rise by more than this above a line of sight to hide what is behind it [m]: less is roughness."""

_SAMPLES_AT_ONCE = 500_000


def in_sight(dem: Dem, eye: ArrayLike, points: ArrayLike) -> NDArray[np.bool_]:
    """Whether the ground leaves the line from an eye to points free.

    Looked at once in every cell on the way: what is narrower than a cell may be missed. Unknown ground hides nothing.

    Args:
        dem: the ground, in site.
        eye: (3,) in site [m].
        points: (n, 3) in site [m].

    Returns:
        (n,).
    """
    eye, points = np.asarray(eye, float), np.asarray(points, float)
    way = points - eye
    known = dem.heights[np.isfinite(dem.heights)]
    top = float(known.max()) - TOLERANCE if known.size else -np.inf
    begin, end = _below(eye[2], way[:, 2], top)
    length = np.maximum(end - begin, 0.0) * np.hypot(way[:, 0], way[:, 1])
    count = np.ceil(length / dem.geometry.resolution).astype(np.int64)
    free = np.ones(len(points), bool)
    # alike long ones together: as many samples are taken of each as the longest of them needs
    order = np.argsort(count, kind="stable")
    order = order[np.searchsorted(count[order], 1) :]
    while len(order):
        rays = order[-max(1, _SAMPLES_AT_ONCE // int(count[order[-1]])) :]
        order = order[: len(order) - len(rays)]
        share = (np.arange(int(count[rays[-1]])) + 0.5) / int(count[rays[-1]])
        t = begin[rays, None] + (end - begin)[rays, None] * share
        x, y, z = (eye[axis] + t * way[rays, axis, None] for axis in range(3))
        with np.errstate(invalid="ignore"):
            free[rays] = ~(height_at(dem, x, y) > z + TOLERANCE).any(axis=1)
    return free


def _below(height: float, climb: Array, top: float) -> tuple[Array, Array]:
    """Shares from, to of the way, 0…1, along which a ray is no higher than ``top`` [m]; from > to where it never is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = (top - height) / climb
    level = np.where(height <= top, 0.0, 2.0)
    begin = np.where(climb < 0, np.clip(crossing, 0.0, 2.0), level)
    end = np.where(climb > 0, np.minimum(crossing, 1.0), 1.0)
    return begin, end
