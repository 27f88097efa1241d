"""Compiled: samples brought together by cell and made into one height each; the median of each cell's neighbours."""

import numpy as np
from numba import prange
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array


@njit()
def by_cell(cell: NDArray[np.int64], cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Samples in the order of their cells, and where each cell's begin, (cells + 1,): counting sort."""
    begin = np.zeros(cells + 1, np.int64)
    for c in cell:
        begin[c + 1] += 1
    for c in range(cells):
        begin[c + 1] += begin[c]
    place = begin[:-1].copy()
    order = np.empty(len(cell), np.int64)
    for i in range(len(cell)):
        order[place[cell[i]]] = i
        place[cell[i]] += 1
    return order, begin


@njit(parallel=True, error_model="numpy")
def fuse_cells(
    order: NDArray[np.int64],
    begin: NDArray[np.int64],
    height: Array,
    weight: Array,
    grey: Array,
    gate: float,
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.int64]]:
    """Of each cell: height (NaN = none), Σ weight, samples trusted and the best sample (−1 = none).

    Sorts the samples of each cell within ``order``, so that the result does not depend on the order they came in.
    """
    cells = len(begin) - 1
    heights, information = np.full(cells, np.nan), np.zeros(cells)
    count, best = np.zeros(cells, np.int64), np.full(cells, -1, np.int64)
    for k in prange(cells):
        c = np.int64(k)
        mine = order[begin[c] : begin[c + 1]]
        if len(mine) == 0:
            continue
        for i in range(1, len(mine)):
            one = mine[i]
            j = i
            while j > 0 and (
                height[mine[j - 1]] > height[one]
                or (
                    height[mine[j - 1]] == height[one]
                    and (
                        weight[mine[j - 1]] > weight[one]
                        or (weight[mine[j - 1]] == weight[one] and grey[mine[j - 1]] > grey[one])
                    )
                )
            ):
                mine[j] = mine[j - 1]
                j -= 1
            mine[j] = one
        total = 0.0
        for i in mine:
            total += weight[i]
        running, median = 0.0, height[mine[-1]]
        for i in mine:
            running += weight[i]
            if running >= (0.5 - 1e-6) * total:
                median = height[i]
                break
        moment = 0.0
        for i in mine:
            if abs(height[i] - median) <= gate:
                information[c] += weight[i]
                moment += weight[i] * height[i]
                count[c] += 1
                if best[c] < 0 or weight[i] > weight[best[c]]:
                    best[c] = i
        heights[c] = moment / information[c]
    return heights, information, count, best


@njit()
def _sort(values: NDArray[np.float32], n: int) -> None:
    """The first n in ascending order, in place; for a few dozen at most."""
    for i in range(1, n):
        one = values[i]
        j = i
        while j > 0 and values[j - 1] > one:
            values[j] = values[j - 1]
            j -= 1
        values[j] = one


@njit(parallel=True)
def median_around(
    heights: NDArray[np.float32], radius: int, where: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Lower median around each known cell, lower median of the distances from it, and the number of known cells.

    All three of the known cells of the square around each known cell that is asked for; NaN, NaN and 0 at others.
    where: (rows, cols).
    """
    rows, cols = heights.shape
    median, spread = np.full((rows, cols), np.nan, np.float32), np.full((rows, cols), np.nan, np.float32)
    known = np.zeros((rows, cols), np.int64)
    for k in prange(rows):
        row = np.int64(k)
        around = np.empty((2 * radius + 1) ** 2, np.float32)
        for col in range(cols):
            if np.isnan(heights[row, col]) or not where[row, col]:
                continue
            n = 0
            for i in range(max(row - radius, 0), min(row + radius, rows - 1) + 1):
                for j in range(max(col - radius, 0), min(col + radius, cols - 1) + 1):
                    if not np.isnan(heights[i, j]):
                        around[n] = heights[i, j]
                        n += 1
            _sort(around, n)
            middle = around[(n - 1) // 2]
            for i in range(n):
                around[i] = abs(around[i] - middle)
            _sort(around, n)
            median[row, col], spread[row, col], known[row, col] = middle, around[(n - 1) // 2], n
    return median, spread, known
