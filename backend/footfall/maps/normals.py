"""Surface normals at many cells at once: the same plane fits as ``terrain.surface.normal_at``.

That function samples a disc of the triangulated surface about each point. About cell centres the samples
fall into the same places of the surrounding blocks for every cell, so all sums over samples are
correlations of the grid with fixed kernels, and the fast Fourier transform does them for all cells. Where nothing is
unknown, three of the nine sums are left, over whole heights instead of the four corners of each block.
"""

from typing import Any

import numpy as np
from numpy.fft import irfft2, rfft2
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from footfall.core.arrays import Array, Complexes
from footfall.terrain.dem import Dem


def cell_normals(dem: Dem, radius: float, rows: slice, cols: slice) -> tuple[Array, Array]:
    """Upward unit normals at the cells of a window of the grid, and how much of their discs is known.

    Normals are NaN where less than half of the disc is known or what is known lies almost on a line. Agrees with
    ``normal_at`` to rounding where the disc is known; beside holes a sample that lies on the hole's rim counts as
    unknown here.

    Args:
        dem: the ground, in site.
        radius: of the disc, such as a wheel's [m].
        rows: of the window.
        cols: of the window.

    Returns:
        Normals (…, 3), and known shares (…) 0…1.
    """
    resolution = dem.geometry.resolution
    steps = int(np.ceil(radius / min(resolution, radius / 4) - 1e-9))
    offset = np.arange(-steps, steps + 1) * (radius / steps)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    in_disc = np.hypot(dx, dy) <= radius * (1 + 1e-9)
    dx, dy = dx[in_disc], dy[in_disc]
    ones = np.ones(len(dx))
    col, row = np.floor(dx / resolution).astype(int), np.floor(dy / resolution).astype(int)
    east, north = dx / resolution - col, dy / resolution - row
    reach = max(-int(col.min()), int(col.max()) + 1, -int(row.min()), int(row.max()) + 1)

    heights = _window(dem.heights, rows, cols, reach)
    known = np.isfinite(heights)
    block = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    level = float(heights[known].mean()) if known.any() else 0.0
    heights = np.where(known, heights - level, 0.0)
    # barycentric weights on the corners of a block cut from south-west to north-east
    lower = east >= north
    weights: dict[tuple[int, int], NDArray[Any]] = {
        (0, 0): np.where(lower, 1 - east, 1 - north),
        (0, 1): np.where(lower, east - north, 0.0),
        (1, 0): np.where(lower, 0.0, north - east),
        (1, 1): np.where(lower, north, east),
    }
    shape = _fast(heights.shape[0]), _fast(heights.shape[1])
    out_shape = (block.shape[0] - 2 * reach + 1, block.shape[1] - 2 * reach + 1)

    def kernel(values: NDArray[Any]) -> Complexes:
        """Transform of the samples' weights by the block they fall in, mirrored for correlation."""
        grid = np.zeros(shape)
        np.add.at(grid, (-(row + reach) % shape[0], -(col + reach) % shape[1]), values)
        return rfft2(grid)

    def sums(spectrum: Complexes) -> Array:
        return irfft2(spectrum, s=shape)[: out_shape[0], : out_shape[1]]

    if known.all():
        # the lattice is symmetric: its samples' x and y have mean 0 and are not correlated
        spectrum = rfft2(heights, s=shape)
        slopes = []
        for offset in (dx, dy):
            moment = np.zeros(shape)
            for (i, j), weight in weights.items():
                np.add.at(moment, (-(row + i + reach) % shape[0], -(col + j + reach) % shape[1]), weight * offset)
            slopes.append(sums(spectrum * rfft2(moment)) / np.square(offset).sum())
        normals = np.stack([-slopes[0], -slopes[1], np.ones(out_shape)], axis=-1)
        return normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.ones(out_shape)

    blocks = rfft2(block.astype(float), s=shape)
    count, sx, sy, sxx, sxy, syy = (sums(blocks * kernel(w)) for w in (ones, dx, dy, dx * dx, dx * dy, dy * dy))
    corners = {
        (i, j): rfft2(block * heights[i : i + block.shape[0], j : j + block.shape[1]], s=shape) for i, j in weights
    }
    sz, sxz, syz = (
        sums(np.sum([corners[corner] * kernel(weight * w) for corner, weight in weights.items()], axis=0))
        for w in (ones, dx, dy)
    )
    count = np.rint(count)
    n = np.maximum(count, 1.0)
    mx, my, mz = sx / n, sy / n, sz / n
    xx, xy, yy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    xz, yz = sxz / n - mx * mz, syz / n - my * mz
    least_variance = 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy)
    good = (2 * count >= len(dx)) & (least_variance > 0.1 * radius * radius / 4)
    determinant = np.where(good, xx * yy - xy * xy, 1.0)
    a, b = (xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant
    normals = np.stack([-a, -b, np.ones_like(a)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[~good] = np.nan
    return normals, count / len(dx)


def _fast(length: int) -> int:
    return int(next_fast_len(length, real=True) or length)


def _window(heights: NDArray[np.float32], rows: slice, cols: slice, reach: int) -> Array:
    """Heights of a window and of ``reach`` cells around it, NaN off the map."""
    total_rows, total_cols = heights.shape
    first = rows.start - reach, cols.start - reach
    last = rows.stop + reach, cols.stop + reach
    inner = heights[max(first[0], 0) : min(last[0], total_rows), max(first[1], 0) : min(last[1], total_cols)]
    return np.pad(
        inner.astype(np.float64),
        (
            (max(-first[0], 0), max(last[0] - total_rows, 0)),
            (max(-first[1], 0), max(last[1] - total_cols, 0)),
        ),
        constant_values=np.nan,
    )
