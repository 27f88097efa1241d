"""Many views of one grid cell made into one height."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.terrain.grid_depth import CellSamples

_BAND = 256
"""Rows cleaned at a time: 25 copies of a whole large map would not fit into memory."""


class Fused(NamedTuple):
    """Cells of a grid after fusion, each (rows, cols).

    heights: float32 [m], NaN where nobody looked. texture: uint8 grey of the best view, 0 where unknown.
    variance: float32 [m²], NaN where unknown. count: uint16, measurements that agreed. view: int16 index of the best
    view, −1 where none.
    """

    heights: NDArray[np.float32]
    texture: NDArray[np.uint8]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    view: NDArray[np.int16]


def fuse(samples: list[CellSamples], geometry: GridGeometry, gate: float) -> Fused:
    """One height for each cell out of what all views say; ``samples``: one for each view.

    In each cell: the median of the heights, weighted by inverse variance; then the weighted mean of those within
    ``gate`` [m] of it, so that one view that is wrong (a reflection, a leg that moved) does not pull the others.
    The mean is the gated Kalman update of a height that stands still, in its information form (Maybeck, Stochastic
    Models, Estimation and Control, 1979, §5.7): the inverse variances add up, in whatever order.
    """
    cell = np.concatenate([s.cell for s in samples])
    height = np.concatenate([s.height for s in samples])
    weight = 1.0 / np.concatenate([s.variance for s in samples])
    grey = np.concatenate([s.grey for s in samples])
    view = np.repeat(np.arange(len(samples)), [len(s.cell) for s in samples])
    size = geometry.rows * geometry.cols
    heights, variance = np.full(size, np.nan, np.float32), np.full(size, np.nan, np.float32)
    texture, count, best_view = np.zeros(size, np.uint8), np.zeros(size, np.uint16), np.full(size, -1, np.int16)
    if len(cell):
        order = np.lexsort((grey, weight, height, cell))
        cell, height, weight, grey, view = cell[order], height[order], weight[order], grey[order], view[order]
        first = np.flatnonzero(np.r_[True, cell[1:] != cell[:-1]])
        group = np.repeat(np.arange(len(first)), np.diff(np.r_[first, len(cell)]))
        median = _weighted_median(height, weight, first, group)
        trusted = weight * (np.abs(height - median[group]) <= gate)
        information = np.bincount(group, trusted)
        at = cell[first]
        heights[at] = np.bincount(group, trusted * height) / information
        variance[at] = 1.0 / information
        count[at] = np.minimum(np.bincount(group, trusted > 0), np.iinfo(np.uint16).max)
        best = np.lexsort((-trusted, group))[first]
        texture[at] = np.clip(np.rint(grey[best]), 1, 255)
        best_view[at] = view[best]
    shape = geometry.shape
    return Fused(
        heights.reshape(shape),
        texture.reshape(shape),
        variance.reshape(shape),
        count.reshape(shape),
        best_view.reshape(shape),
    )


def _weighted_median(height: NDArray, weight: NDArray, first: NDArray, group: NDArray) -> NDArray[np.float64]:
    """Of each group of sorted heights: the first that has half of the group's weight at or below it."""
    total = np.bincount(group, weight)
    running = np.cumsum(weight)
    before = (running - weight)[first]
    reached = running - before[group] >= (0.5 - 1e-6) * total[group]
    index = np.where(reached, np.arange(len(height)), len(height))
    return height[np.minimum(np.minimum.reduceat(index, first), len(height) - 1)]


def despike(heights: NDArray[np.float32], limit: float, min_neighbours: int) -> NDArray[np.float32]:
    """Cells further than ``limit`` [m] from the median of their 5 × 5 neighbours take that median.

    Cells with fewer than ``min_neighbours`` known ones among those 25 (themselves included) become unknown; unknown
    cells stay so.
    """
    rows, cols = heights.shape
    wide = np.pad(heights, 2, constant_values=np.nan)
    out = np.empty_like(heights)
    for start in range(0, rows, _BAND):
        band = heights[start : start + _BAND]
        height = len(band)
        around = np.stack([wide[start + i : start + i + height, j : j + cols] for i in range(5) for j in range(5)])
        around.sort(axis=0)  # NaN last
        known = np.isfinite(around).sum(axis=0)
        middle = np.take_along_axis(around, (np.maximum(known, 1) - 1)[None] // 2, axis=0)[0]
        cleaned = np.where(np.abs(band - middle) > limit, middle, band)
        cleaned[np.isnan(band) | (known < min_neighbours)] = np.nan
        out[start : start + height] = cleaned
    return out
