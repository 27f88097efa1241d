"""Surface normals at many cells at once: the same plane fits as ``terrain.surface.normal_at``.

That function samples a disc of the triangulated surface about each point. About cell centres the samples
fall into the same places of the surrounding blocks for every cell, so all sums over samples are
correlations of the grid with fixed kernels, and the fast Fourier transform does them for all cells. Where nothing is
unknown, three of the nine sums are left, over whole heights instead of the four corners of each block.
"""

from dataclasses import dataclass

import numpy as np
from numpy.fft import irfft2, rfft2
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from footfall.core.arrays import Array, Complexes, Ints, Mask
from footfall.terrain.dem import Dem
from footfall.terrain.ground.normal_kernel import LEAST_KNOWN, LEAST_SPREAD

Corner = tuple[int, int]
"""Of a block: how many rows and columns it lies from the south-western one."""


@dataclass(frozen=True)
class _Disc:
    """Samples of a disc about a cell's centre, n of them.

    dx, dy: (n,) from the centre [m]. row, col: (n,) block that each falls into, counted from the one whose
    south-western corner is the cell. weights: (n,) barycentric, of the corners of that block. reach: how many cells
    from the centre the corners lie at most.
    """

    dx: Array
    dy: Array
    row: Ints
    col: Ints
    weights: dict[Corner, Array]
    reach: int


def _disc(radius: float, resolution: float) -> _Disc:
    steps = int(np.ceil(radius / min(resolution, radius / 4) - 1e-9))
    offset = np.arange(-steps, steps + 1, dtype=float) * (radius / steps)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    in_disc = np.hypot(dx, dy) <= radius * (1 + 1e-9)
    dx, dy = dx[in_disc], dy[in_disc]
    col, row = np.floor(dx / resolution).astype(int), np.floor(dy / resolution).astype(int)
    east, north = dx / resolution - col, dy / resolution - row
    # a block is cut from south-west to north-east
    lower = east >= north
    weights = {
        (0, 0): np.where(lower, 1 - east, 1 - north),
        (0, 1): np.where(lower, east - north, 0.0),
        (1, 0): np.where(lower, 0.0, north - east),
        (1, 1): np.where(lower, north, east),
    }
    reach = max(-int(col.min()), int(col.max()) + 1, -int(row.min()), int(row.max()) + 1)
    return _Disc(dx, dy, row, col, weights, reach)


class _Correlation:
    """Sums over the samples of a disc about every cell but those at the rim, by the fast Fourier transform.

    shape: of the window of cells that the disc is laid onto.
    """

    def __init__(self, disc: _Disc, shape: tuple[int, int]) -> None:
        self._disc = disc
        self._shape = _fast(shape[0]), _fast(shape[1])
        self.inner = shape[0] - 2 * disc.reach, shape[1] - 2 * disc.reach

    def transform(self, cells: Array) -> Complexes:
        """Of a layer of the window."""
        return rfft2(cells, s=self._shape)

    def kernel(self, *parts: tuple[Corner, Array]) -> Complexes:
        """Transform of the samples' weights (n,) at a corner of their blocks, mirrored for correlation."""
        disc, (rows, cols) = self._disc, self._shape
        grid = np.zeros(self._shape)
        for (i, j), values in parts:
            np.add.at(grid, (-(disc.row + i + disc.reach) % rows, -(disc.col + j + disc.reach) % cols), values)
        return rfft2(grid)

    def sums(self, spectrum: Complexes) -> Array:
        """Of each inner cell."""
        return irfft2(spectrum, s=self._shape)[: self.inner[0], : self.inner[1]]


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
    disc = _disc(radius, dem.geometry.resolution)
    heights = _window(dem.heights, rows, cols, disc.reach)
    known = np.isfinite(heights)
    level = float(heights[known].mean()) if known.any() else 0.0
    heights = np.where(known, heights - level, 0.0)
    if known.all():
        normals = _where_all_is_known(disc, heights)
        return normals, np.ones(normals.shape[:2])
    return _beside_holes(disc, heights, known, radius)


def _where_all_is_known(disc: _Disc, heights: Array) -> Array:
    """Normals (…, 3). The lattice is symmetric: its samples' x and y have mean 0 and are not correlated."""
    over = _Correlation(disc, heights.shape)
    spectrum = over.transform(heights)
    slopes = []
    for offset in (disc.dx, disc.dy):
        moment = over.kernel(*((corner, weight * offset) for corner, weight in disc.weights.items()))
        slopes.append(over.sums(spectrum * moment) / np.square(offset).sum())
    normals = np.stack([-slopes[0], -slopes[1], np.ones(over.inner)], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _beside_holes(disc: _Disc, heights: Array, known: Mask, radius: float) -> tuple[Array, Array]:
    """Normals (…, 3), NaN where too little is known, and known shares (…)."""
    over = _Correlation(disc, heights.shape)
    dx, dy, ones = disc.dx, disc.dy, np.ones(len(disc.dx))
    block = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    blocks = over.transform(block.astype(float))
    count, sx, sy, sxx, sxy, syy = (
        over.sums(blocks * over.kernel(((0, 0), w))) for w in (ones, dx, dy, dx * dx, dx * dy, dy * dy)
    )
    corners = {
        (i, j): over.transform(block * heights[i : i + block.shape[0], j : j + block.shape[1]]) for i, j in disc.weights
    }
    sz, sxz, syz = (
        over.sums(
            np.sum(
                [corners[corner] * over.kernel(((0, 0), weight * w)) for corner, weight in disc.weights.items()], axis=0
            )
        )
        for w in (ones, dx, dy)
    )
    count = np.rint(count)
    n = np.maximum(count, 1.0)
    mx, my, mz = sx / n, sy / n, sz / n
    xx, xy, yy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    xz, yz = sxz / n - mx * mz, syz / n - my * mz
    least_variance = 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy)
    good = (count >= LEAST_KNOWN * len(dx)) & (least_variance > LEAST_SPREAD * radius * radius / 4)
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
