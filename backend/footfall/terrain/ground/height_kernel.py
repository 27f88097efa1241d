"""Height of the surface of a Dem at single places: compiled."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array

EDGE = 1e-9
"""Cells: a point this close to a block's edge belongs to both neighbours, as closed triangles do."""


@njit()
def heights_at(heights: NDArray[np.float32], u: Array, v: Array) -> Array:
    """Heights [m] at places (n,) in cells from the middle of the map's first; NaN off the map and where unknown."""
    out = np.empty(len(u))
    for i in range(len(u)):
        out[i] = height_in_cells(heights, u[i], v[i])
    return out


@njit()
def height_in_cells(heights: NDArray[np.float32], u: float, v: float) -> float:
    """As :func:`heights_at`, of one place."""
    height = _block_height(heights, u, v, 0.0, 0.0)
    if not np.isnan(height) or not (abs(u - np.rint(u)) <= EDGE or abs(v - np.rint(v)) <= EDGE):
        return height
    # a point on the rim of the known ground may fall, by rounding, into the block outside it
    for dv in (-EDGE, EDGE):
        for du in (-EDGE, EDGE):
            height = _block_height(heights, u, v, du, dv)
            if not np.isnan(height):
                return height
    return height


@njit()
def _block_height(heights: NDArray[np.float32], u: float, v: float, du: float, dv: float) -> float:
    """Linear interpolation in the block that (u + du, v + dv) [cells] falls into."""
    col, row = np.floor(u + du), np.floor(v + dv)
    if not (0 <= col < heights.shape[1] - 1 and 0 <= row < heights.shape[0] - 1):
        return np.nan
    east, north = min(max(u - col, 0.0), 1.0), min(max(v - row, 0.0), 1.0)
    i, j = int(row), int(col)
    sw, se = np.float64(heights[i, j]), np.float64(heights[i, j + 1])
    nw, ne = np.float64(heights[i + 1, j]), np.float64(heights[i + 1, j + 1])
    if not np.isfinite(sw + se + nw + ne):
        return np.nan
    if east >= north:
        return sw + east * (se - sw) + north * (ne - se)
    return sw + north * (nw - sw) + east * (ne - nw)
