"""Compiled: the plane, its residuals and the step in a window around every cell of a grid.

The windowed moments are separable, so a cell costs two passes along its window and not one over it. The step is not:
every residual of the window is formed, many cells at a time in the processor's vectors. Tiles are independent
and no sum crosses one, so the numbers don't depend on how many threads share the work, nor on vector width.
"""

import numpy as np
from numba import prange

from footfall.compiled import njit

TILE_ROWS, TILE_COLS = 32, 256
"""A tile and the margin of its window stay in the second-level cache."""


@njit()
def _take(heights, top, left, half, seen, filled, mask):
    """Copy a tile and its margin about their mean: NaN (seen) or 0 (filled) where unknown, and the mask.

    Returns whether any cell is known. A level of its own for each tile keeps the moments exact to rounding of the
    relief in sight, not of the whole map's.
    """
    rows, cols = heights.shape
    total, count = 0.0, 0
    for i in range(seen.shape[0]):
        row = top - half + i
        for j in range(seen.shape[1]):
            col = left - half + j
            height = np.nan
            if 0 <= row < rows and 0 <= col < cols:
                height = np.float64(heights[row, col])
            seen[i, j] = height
            if np.isfinite(height):
                total += height
                count += 1
    if count == 0:
        return False
    level = total / count
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            height = seen[i, j] - level
            known = height == height
            seen[i, j] = height
            filled[i, j] = height if known else 0.0
            mask[i, j] = 1.0 if known else 0.0
    return True


@njit()
def _sum_mask_north(mask, i, half, n, ny, nyy):
    """Sums over the rows about row ``i + half`` of the mask times 1, dy, dy²: whole numbers, exact in float32."""
    middle = mask[i + half]
    for c in range(n.size):
        n[c] = middle[c]
        ny[c] = np.float32(0.0)
        nyy[c] = np.float32(0.0)
    for k in range(1, half + 1):
        above, below, f = mask[i + half + k], mask[i + half - k], np.float32(k)
        for c in range(n.size):
            both = above[c] + below[c]
            n[c] += both
            ny[c] += f * (above[c] - below[c])
            nyy[c] += f * f * both


@njit()
def _sum_heights_north(filled, i, half, z, zy, zz):
    """Sums over the rows about row ``i + half`` of the heights, times dy, and squared."""
    middle = filled[i + half]
    for c in range(z.size):
        z[c] = middle[c]
        zy[c] = 0.0
        zz[c] = middle[c] * middle[c]
    for k in range(1, half + 1):
        above, below, f = filled[i + half + k], filled[i + half - k], np.float64(k)
        for c in range(z.size):
            z[c] += above[c] + below[c]
            zy[c] += f * (above[c] - below[c])
            zz[c] += above[c] * above[c] + below[c] * below[c]


@njit()
def _sum_east(field, half, out):
    """Sums over the columns of the window about each cell."""
    middle = field[half : half + out.size]
    for c in range(out.size):
        out[c] = middle[c]
    for k in range(1, half + 1):
        right, left = field[half + k : half + k + out.size], field[half - k : half - k + out.size]
        for c in range(out.size):
            out[c] += right[c] + left[c]


@njit()
def _first_east(field, half, out):
    """Sums over the columns of the window, times dx."""
    out[:] = 0
    for k in range(1, half + 1):
        right, left = field[half + k : half + k + out.size], field[half - k : half - k + out.size]
        f = out.dtype.type(k)
        for c in range(out.size):
            out[c] += f * (right[c] - left[c])


@njit()
def _second_east(field, half, out):
    """Sums over the columns of the window, times dx²."""
    out[:] = 0
    for k in range(1, half + 1):
        right, left = field[half + k : half + k + out.size], field[half - k : half - k + out.size]
        f = out.dtype.type(k * k)
        for c in range(out.size):
            out[c] += f * (right[c] + left[c])


@njit()
def _step(seen, i, half, a, b, center, highest, lowest):
    """Largest and least residual over every cell of the windows along row ``i`` of a tile.

    Two columns on either side are taken at once, which spares loads and stores. A comparison with NaN is false, so
    an unknown cell changes neither bound.
    """
    plane = np.empty_like(a)
    highest[:] = -np.inf
    lowest[:] = np.inf
    for dy in range(-half, half + 1):
        row = seen[i + half + dy]
        middle = row[half : half + a.size]
        for c in range(a.size):
            plane[c] = center[c] + dy * b[c]
            p = middle[c] - plane[c]
            highest[c] = p if p > highest[c] else highest[c]
            lowest[c] = p if p < lowest[c] else lowest[c]
        for near in range(1, half + 1, 2):
            far = min(near + 1, half)
            right, left = row[half + near : half + near + a.size], row[half - near : half - near + a.size]
            right_far, left_far = row[half + far : half + far + a.size], row[half - far : half - far + a.size]
            for c in range(a.size):
                rise, rise_far = near * a[c], far * a[c]
                p, q = right[c] - (plane[c] + rise), left[c] - (plane[c] - rise)
                r, s = right_far[c] - (plane[c] + rise_far), left_far[c] - (plane[c] - rise_far)
                high, low = highest[c], lowest[c]
                high = p if p > high else high
                low = p if p < low else low
                high = q if q > high else high
                low = q if q < low else low
                high = r if r > high else high
                low = r if r < low else low
                highest[c] = s if s > high else high
                lowest[c] = s if s < low else low


@njit()
def _tile(heights, top, left, half, resolution, least, limits, layers):
    """Fill the layers of the tile whose first cell is (top, left)."""
    slope, roughness, step, goodness, certainty, gradient = layers
    rows, cols = min(TILE_ROWS, heights.shape[0] - top), min(TILE_COLS, heights.shape[1] - left)
    width = cols + 2 * half
    seen = np.empty((rows + 2 * half, width))
    filled = np.empty((rows + 2 * half, width))
    mask = np.empty((rows + 2 * half, width), np.float32)
    if not _take(heights, top, left, half, seen, filled, mask):
        here = (slice(top, top + rows), slice(left, left + cols))
        slope[here], roughness[here], step[here], goodness[here] = np.nan, np.nan, np.nan, np.nan
        certainty[here] = 0.0
        gradient[here] = np.nan
        return
    north_mask, north = np.empty((3, width), np.float32), np.empty((3, width))
    # rows taken by index are contiguous to the compiler, rows unpacked are not
    counts, sums, fits = np.empty((6, cols), np.float32), np.empty((4, cols)), np.empty((6, cols))
    n, nx, nxx, ny, nxy, nyy = counts[0], counts[1], counts[2], counts[3], counts[4], counts[5]
    z, zx, zy, zz = sums[0], sums[1], sums[2], sums[3]
    a, b, center, variance, highest, lowest = fits[0], fits[1], fits[2], fits[3], fits[4], fits[5]
    usable = np.empty(cols, np.bool_)
    whole = (2 * half + 1) ** 2
    spread = half * (half + 1) / 3.0
    least_share, least_spread = least
    slope_limit, roughness_limit, step_limit = limits
    for i in range(rows):
        _sum_mask_north(mask, i, half, north_mask[0], north_mask[1], north_mask[2])
        _sum_heights_north(filled, i, half, north[0], north[1], north[2])
        _sum_east(north_mask[0], half, n)
        _first_east(north_mask[0], half, nx)
        _second_east(north_mask[0], half, nxx)
        _sum_east(north_mask[1], half, ny)
        _first_east(north_mask[1], half, nxy)
        _sum_east(north_mask[2], half, nyy)
        _sum_east(north[0], half, z)
        _first_east(north[0], half, zx)
        _sum_east(north[1], half, zy)
        _sum_east(north[2], half, zz)
        for c in range(cols):
            count = max(np.float64(n[c]), 1.0)
            mx, my, mz = nx[c] / count, ny[c] / count, z[c] / count
            cxx, cxy, cyy = nxx[c] - nx[c] * mx, nxy[c] - nx[c] * my, nyy[c] - ny[c] * my
            cxz, cyz, czz = zx[c] - nx[c] * mz, zy[c] - ny[c] * mz, zz[c] - z[c] * mz
            narrow = (cxx + cyy) / 2 - np.sqrt(((cxx - cyy) / 2) ** 2 + cxy * cxy)
            usable[c] = n[c] / whole >= least_share and narrow / count >= least_spread**2 * spread
            determinant = cxx * cyy - cxy * cxy if usable[c] else 1.0
            a[c] = (cxz * cyy - cyz * cxy) / determinant if usable[c] else 0.0
            b[c] = (cyz * cxx - cxz * cxy) / determinant if usable[c] else 0.0
            center[c] = mz - a[c] * mx - b[c] * my
            variance[c] = max((czz - a[c] * cxz - b[c] * cyz) / count, 0.0)
        _step(seen, i, half, a, b, center, highest, lowest)
        row = top + i
        for c in range(cols):
            col = left + c
            certainty[row, col] = n[c] / whole
            if usable[c] and mask[i + half, c + half] > 0.0:
                east, north_rise = a[c] / resolution, b[c] / resolution
                tilt = np.arctan(np.sqrt(east * east + north_rise * north_rise))
                rough, height = np.sqrt(variance[c]), highest[c] - lowest[c]
                worst = max(tilt / slope_limit, rough / roughness_limit, height / step_limit)
                slope[row, col], roughness[row, col], step[row, col] = tilt, rough, height
                goodness[row, col] = max(1.0 - worst, 0.0)
                gradient[row, col, 0], gradient[row, col, 1] = east, north_rise
            else:
                slope[row, col], roughness[row, col], step[row, col] = np.nan, np.nan, np.nan
                goodness[row, col] = np.nan
                gradient[row, col, 0], gradient[row, col, 1] = np.nan, np.nan


@njit(parallel=True)
def fit_tiles(heights, tiles, half, resolution, least, limits, layers):
    """Fit the planes of some tiles and write every cell of them.

    heights: (rows, cols) float32 [m], NaN = unknown; tiles: (n, 2) int64, row and column of the first cell of each;
    half: cells on each side of the window's middle; least: share of known cells, and relative spread of them, below
    which a window is unknown; limits: slope [rad], roughness [m] and step [m] where goodness reaches 0; layers: slope,
    roughness, step, goodness, certainty, (rows, cols) float32 each, and gradient, (rows, cols, 2) float64, as in
    ``Traversability``.
    """
    for tile in prange(tiles.shape[0]):
        _tile(heights, tiles[tile, 0], tiles[tile, 1], half, resolution, least, limits, layers)
