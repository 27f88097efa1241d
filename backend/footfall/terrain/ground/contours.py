"""Contour lines of a Dem: where its triangles meet level planes."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate

STEPS = (0.1, 0.2, 0.5)
"""From one line to the next [m], or ten, a hundred, … times as far."""
MOST_LEVELS = 20
"""That the ground is cut at, by the step that is chosen for it."""
LIFTED_BY = 1e-9
"""Corners at a level count as this much above it [m]: a flat triangle at a level has no line."""


def contour_step(dem: Dem) -> float:
    """The least of the round steps [m] that gives ``MOST_LEVELS`` lines at most between lowest and highest ground."""
    relief = float(np.nanmax(dem.heights) - np.nanmin(dem.heights))
    power = 1.0
    while True:
        for step in STEPS:
            if relief <= MOST_LEVELS * step * power:
                return step * power
        power *= 10.0


def contours(dem: Dem, step: float) -> Array:
    """Pieces of the lines at all whole multiples of ``step`` [m], (n, 2, 3) in site, lowest level first.

    Each crosses one triangle of the ground. Raises InvalidInput for a step that is not positive.
    """
    if not 0 < step < np.inf:
        raise InvalidInput(f"contour lines need a positive step [m], not {step}")
    mesh = triangulate(dem)
    corners = np.asarray(mesh.vertices, float)[mesh.triangles]
    lowest, highest = corners[..., 2].min(axis=1), corners[..., 2].max(axis=1)
    first, last = np.floor(lowest / step).astype(np.int64), np.floor(highest / step).astype(np.int64)
    count = last - first
    triangle = np.repeat(np.arange(len(corners)), count)
    turn = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    level = (first[triangle] + 1 + turn) * step
    order = np.argsort(level, kind="stable")
    return _cut(corners[triangle[order]], level[order])


def _cut(corners: Array, level: Array) -> Array:
    """Where the planes z = level (n,) cut triangles (n, 3, 3), each of which has a corner below and one not below."""
    above = corners[..., 2] + LIFTED_BY >= level[:, None]
    # the corner that is alone on its side: two edges leave it through the plane
    alone = np.argmax(above == (above.sum(axis=1) == 1)[:, None], axis=1)
    rows = np.arange(len(corners))
    tip = corners[rows, alone]
    ends = []
    for turn in (1, 2):
        other = corners[rows, (alone + turn) % 3]
        rise = other[:, 2] - tip[:, 2]
        share = np.clip((level - tip[:, 2]) / np.where(rise == 0, 1.0, rise), 0.0, 1.0)
        point = tip + share[:, None] * (other - tip)
        point[:, 2] = level
        ends.append(point)
    return np.stack(ends, axis=1)
