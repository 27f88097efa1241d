"""Many views of one grid cell made into one height."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.terrain.grid_depth import CellSamples

_BAND = 256
"""Rows cleaned at a time: 25 copies of a whole large map would not fit into memory."""


def fuse(samples: list[CellSamples], geometry: GridGeometry, gate: float) -> tuple[NDArray, NDArray]:
    """Heights (rows, cols) float32, NaN where nobody looked, and grey (rows, cols) uint8 of the best view.

    In each cell: the median of the heights, weighted by inverse variance; then the weighted mean of those within
    ``gate`` [m] of it, so that one view that is wrong (a reflection, a leg that moved) does not pull the others.
    """
    cell = np.concatenate([s.cell for s in samples])
    height = np.concatenate([s.height for s in samples])
    weight = 1.0 / np.concatenate([s.variance for s in samples])
    grey = np.concatenate([s.grey for s in samples])
    heights = np.full(geometry.rows * geometry.cols, np.nan, np.float32)
    texture = np.zeros(geometry.rows * geometry.cols, np.uint8)
    if len(cell):
        order = np.lexsort((grey, weight, height, cell))
        cell, height, weight, grey = cell[order], height[order], weight[order], grey[order]
        first = np.flatnonzero(np.r_[True, cell[1:] != cell[:-1]])
        group = np.repeat(np.arange(len(first)), np.diff(np.r_[first, len(cell)]))
        median = _weighted_median(height, weight, first, group)
        trusted = weight * (np.abs(height - median[group]) <= gate)
        heights[cell[first]] = np.bincount(group, trusted * height) / np.bincount(group, trusted)
        best = np.lexsort((-trusted, group))[first]
        texture[cell[first]] = np.clip(np.rint(grey[best]), 1, 255)
    return heights.reshape(geometry.shape), texture.reshape(geometry.shape)


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
