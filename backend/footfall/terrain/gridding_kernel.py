"""Heights of cells from very many points, compiled: points are sorted by cell, then each cell is looked at alone."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array

_MAD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

_FAR = 3.5
"""Returns so many robust deviations from the middle of their surface are left out (Iglewicz & Hoaglin, 1993)."""


@njit()
def extent(points: Array) -> tuple[Array, Array]:
    """Lowest and highest x and y of points, in one pass over them."""
    low, high = points[0, :2].copy(), points[0, :2].copy()
    for k in range(len(points)):
        for axis in range(2):
            low[axis] = min(low[axis], points[k, axis])
            high[axis] = max(high[axis], points[k, axis])
    return low, high


@njit()
def by_cell(points: Array, x0: float, y0: float, resolution: float, rows: int, cols: int) -> tuple[NDArray, Array]:
    """Where each cell's heights begin, (cells + 1,), and all heights, cell by cell; a point's is the nearest centre."""
    begin, cells = np.zeros(rows * cols + 1, np.int64), np.empty(len(points), np.int32)
    for k in range(len(points)):
        col = int(np.floor((points[k, 0] - x0) / resolution + 0.5))
        row = int(np.floor((points[k, 1] - y0) / resolution + 0.5))
        cells[k] = row * cols + col if 0 <= row < rows and 0 <= col < cols else -1
        if cells[k] >= 0:
            begin[cells[k] + 1] += 1
    begin = np.cumsum(begin)
    at, heights = begin[:-1].copy(), np.empty(begin[-1])
    for k in range(len(points)):
        cell = cells[k]
        if cell >= 0:
            heights[at[cell]] = points[k, 2]
            at[cell] += 1
    return begin, heights


@njit()
def surfaces(
    begin: NDArray, heights: Array, gap: float, least_share: float, least_count: int, deviation: float, lowest: bool
) -> tuple[Array, Array, NDArray]:
    """Height, variance of it and returns used of each cell; NaN, NaN and 0 where there are too few.

    A cell's returns, sorted, are cut where they lie more than ``gap`` apart; of the surfaces that have enough of the
    returns the highest is taken, or the lowest. Its height is the mean of what lies near its median.
    """
    cells = len(begin) - 1
    height, variance, count = np.full(cells, np.nan), np.full(cells, np.nan), np.zeros(cells, np.int64)
    for cell in range(cells):
        n = begin[cell + 1] - begin[cell]
        if n < least_count:
            continue
        z = np.sort(heights[begin[cell] : begin[cell + 1]])
        # one return of four or more is no surface
        least = max(2.0 if n >= 4 else 1.0, least_share * n)
        first, last = _surface(z, gap, least, lowest)
        if last - first < least_count:
            continue
        part = z[first:last]
        middle = _median(part)
        spread = max(_MAD * _median(np.sort(np.abs(part - middle))), deviation)
        total, squares, used = 0.0, 0.0, 0
        for one in part:
            off = one - middle
            if abs(off) <= _FAR * spread:
                total += off
                squares += off * off
                used += 1
        mean = total / used
        scatter = max(squares / used - mean * mean, 0.0) * used / max(used - 1, 1)
        height[cell] = middle + mean
        variance[cell] = max(scatter, deviation * deviation) / used
        count[cell] = used
    return height, variance, count


@njit()
def _surface(z: Array, gap: float, least: float, lowest: bool) -> tuple[int, int]:
    """First and past the last of the sorted returns of the surface; all of them where no part has enough."""
    found = (0, len(z))
    first = 0
    for i in range(1, len(z) + 1):
        if i == len(z) or z[i] - z[i - 1] > gap:
            if i - first >= least:
                found = (first, i)
                if lowest:
                    return found
            first = i
    return found


@njit()
def _median(z: Array) -> float:
    n = len(z)
    return z[n // 2] if n % 2 else 0.5 * (z[n // 2 - 1] + z[n // 2])


@njit()
def supported(height: Array, gap: float, around: int) -> tuple[NDArray, NDArray, NDArray]:
    """Of each cell's known neighbours within so many cells: how many there are, lie at its height, lie below it.

    At its height: no farther than ``gap`` times as many cells as it is away.
    """
    rows, cols = height.shape
    known, alike, below = (
        np.zeros((rows, cols), np.int64),
        np.zeros((rows, cols), np.int64),
        np.zeros((rows, cols), np.int64),
    )
    for row in range(rows):
        for col in range(cols):
            if np.isnan(height[row, col]):
                continue
            for r in range(max(row - around, 0), min(row + around + 1, rows)):
                for c in range(max(col - around, 0), min(col + around + 1, cols)):
                    if (r == row and c == col) or np.isnan(height[r, c]):
                        continue
                    off = height[row, col] - height[r, c]
                    known[row, col] += 1
                    alike[row, col] += abs(off) <= gap * max(abs(r - row), abs(c - col))
                    below[row, col] += off > gap
    return known, alike, below
