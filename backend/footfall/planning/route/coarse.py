"""Ways over grids that are too large to look at whole: over coarse cells first, then over the fine ones on that way."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_dilation

from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress, part
from footfall.planning.route.field import CostField

MOST_CELLS = 1 << 20
"""Grids of more cells are looked at coarsely first."""
BESIDE = 4
"""Coarse cells beside the coarse way whose fine cells are looked at; where that fails, twice as many, and so on."""


def cheapest_way(
    geometry: GridGeometry, costs: Array, begin: ArrayLike, goal: ArrayLike, progress: Progress = no_progress
) -> tuple[Array, float]:
    """The cheapest way over a grid of costs.

    Of a grid of more than MOST_CELLS it is the cheapest only near the coarse one, where all but blocked ground counts
    by its mean.

    Args:
        geometry: the grid.
        costs: (rows, cols) of a metre, infinite where blocked.
        begin: x, y (2,) in site [m].
        goal: x, y (2,) in site [m].
        progress: called with a fraction 0…1 and a text; what it raises ends the work.

    Returns:
        Points (n, 2) [m] and what the way costs; no points and infinite where none leads.

    Raises:
        InvalidInput: begin or goal is outside or blocked.
    """
    if costs.size <= MOST_CELLS:
        return CostField(geometry, costs, goal).plan(begin, progress)
    size = math.ceil(math.sqrt(costs.size / MOST_CELLS)) * 2
    coarse_geometry, coarse = _coarser(geometry, costs, size)
    way, _ = CostField(coarse_geometry, coarse, goal).plan(begin, part(progress, 0.0, 0.3))
    if not len(way):
        return way, math.inf
    beside = BESIDE
    while True:
        near, whole = _near(coarse_geometry, way, beside)
        fine = np.repeat(np.repeat(near, size, 0), size, 1)[: geometry.rows, : geometry.cols]
        rows, cols = (np.flatnonzero(fine.any(axis=axis)) for axis in (1, 0))
        south, north, west, east = rows[0], rows[-1] + 1, cols[0], cols[-1] + 1
        inside = np.where(fine, costs, math.inf)[south:north, west:east]
        corner = (geometry.x0 + west * geometry.resolution, geometry.y0 + south * geometry.resolution)
        rows, cols = inside.shape
        window = GridGeometry(float(corner[0]), float(corner[1]), geometry.resolution, rows, cols)
        found, cost = CostField(window, inside, goal).plan(begin, part(progress, 0.3, 1.0))
        if len(found) or whole:
            return found, cost
        beside *= 2


def _coarser(geometry: GridGeometry, costs: Array, size: int) -> tuple[GridGeometry, Array]:
    """Mean costs of what is not blocked in blocks of cells; infinite where all is."""
    rows, cols = (math.ceil(count / size) for count in geometry.shape)
    total, count = np.zeros((rows, cols)), np.zeros((rows, cols))
    free = np.isfinite(costs)
    for layer, source in ((total, np.where(free, costs, 0.0)), (count, free)):
        padded = np.zeros((rows * size, cols * size))
        padded[: geometry.rows, : geometry.cols] = source
        layer += padded.reshape(rows, size, cols, size).sum(axis=(1, 3))
    means = np.where(count > 0, total / np.maximum(count, 1.0), math.inf)
    shift = 0.5 * (size - 1) * geometry.resolution
    return GridGeometry(geometry.x0 + shift, geometry.y0 + shift, size * geometry.resolution, rows, cols), means


def _near(geometry: GridGeometry, way: Array, beside: int) -> tuple[NDArray[np.bool_], bool]:
    """Cells within ``beside`` of a way, and whether those are all."""
    near = np.zeros(geometry.shape, bool)
    for a, b in pairwise(way):
        count = 2 + math.ceil(2 * float(np.linalg.norm(b - a)) / geometry.resolution)
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        rows, cols = geometry.cell(points[:, 0], points[:, 1])
        near[np.clip(rows, 0, geometry.rows - 1), np.clip(cols, 0, geometry.cols - 1)] = True
    near = np.asarray(binary_dilation(near, np.ones((3, 3), bool), iterations=beside), bool)
    return near, bool(near.all())
