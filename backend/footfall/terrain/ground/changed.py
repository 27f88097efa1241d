"""Where the ground is otherwise than it was: one map against a later one, cell by cell.

What was made on the one map may be kept on the other where nothing that it looked at is otherwise. So in doubt a cell
counts as changed: where it became known or unknown, or where ground that nobody saw is taken to be higher or lower.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Mask
from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.terrain.dem import Dem
from footfall.terrain.fusion import lattice
from footfall.terrain.ground.unseen import filled

DEVIATIONS = 3.0
"""Two heights of a cell that differ by more than this many standard deviations of their difference are two."""

SAME_HEIGHT = 0.01
"""Heights that differ by less are the same, however sure they are, and where a map does not say how sure [m]."""

OTHER_HEIGHT = 0.03
"""Heights that differ by more are not the same, however unsure: a wheel may cut in so far, and no farther [m]."""

MOST_COMPARED = 1_000_000
"""Maps of more cells are not compared: they count as other ground."""

BEYOND = 1.5
"""Ground beyond the edge is taken to go on as the edge is; it is compared this far [m]."""


@dataclass(frozen=True, eq=False)
class GroundChange:
    """Two maps compared on the cells of ``geometry``, which holds both and goes on beyond their edges.

    cells: (rows, cols), the changed ones; flipped: those of them that became known or unknown. by: (rows, cols), by how
    much the heights differ, ground that nobody saw as high as it may be [m]. height: (rows, cols), the higher of the
    two [m].
    """

    geometry: GridGeometry
    cells: Mask
    by: NDArray[np.float32]
    height: NDArray[np.float32]
    flipped: Mask

    def within(self, discs: NDArray[np.float64] | None) -> Mask:
        """The changed cells in any of some discs (n, 3) of x, y, radius, site [m]; None: all of them."""
        if discs is None:
            return self.cells
        out = np.zeros_like(self.cells)
        grid = self.geometry
        for x, y, radius in discs:
            # the triangles at a cell's centre go to its neighbours' centres
            reach = radius + np.sqrt(2.0) * grid.resolution
            low_row, high_row = _span(y - reach, y + reach, grid.y0, grid.resolution, grid.rows)
            low_col, high_col = _span(x - reach, x + reach, grid.x0, grid.resolution, grid.cols)
            rows, cols = slice(low_row, high_row), slice(low_col, high_col)
            out[rows, cols] |= np.hypot(grid.xs[cols] - x, (grid.ys[rows] - y)[:, None]) <= reach
        return out & self.cells

    def within_grid(self, grid: GridGeometry) -> Mask:
        """The changed cells of a grid of the same lattice."""
        return self.cells & lattice.laid_onto(self.geometry, np.ones(grid.shape, bool), grid, False)


def ground_change(before: Dem, now: Dem) -> GroundChange | None:
    """What is otherwise ``now``; None where the maps can't be compared: other cells, or more than MOST_COMPARED.

    A height is the same within max(SAME_HEIGHT, min(OTHER_HEIGHT, DEVIATIONS · √(variance before + now))).
    """
    try:
        both = lattice.union(before.geometry, now.geometry)
    except InvalidTerrain:
        return None
    margin = int(np.ceil(BEYOND / both.resolution))
    if (both.rows + 2 * margin) * (both.cols + 2 * margin) > MOST_COMPARED:
        return None
    grid = GridGeometry(
        both.x0 - margin * both.resolution,
        both.y0 - margin * both.resolution,
        both.resolution,
        both.rows + 2 * margin,
        both.cols + 2 * margin,
    )
    old, new = (lattice.laid_onto(grid, one.heights, one.geometry, np.nan) for one in (before, now))
    was, known = np.isfinite(old), np.isfinite(new)
    old, new = filled(old), filled(new)
    by = np.abs(new - old)
    cells = (was != known) | ~(by <= np.where(was & known, _allowed(grid, before, now), SAME_HEIGHT))
    return GroundChange(grid, cells, by, np.maximum(old, new), was != known)


def _allowed(grid: GridGeometry, before: Dem, now: Dem) -> NDArray[np.float64] | float:
    if before.variance is None or now.variance is None:
        return SAME_HEIGHT
    of_both = ((before.variance, before.geometry), (now.variance, now.geometry))
    P, R = (lattice.laid_onto(grid, one, geometry, np.nan).astype(np.float64) for one, geometry in of_both)
    return np.clip(DEVIATIONS * np.sqrt(P + R), SAME_HEIGHT, OTHER_HEIGHT)


def _span(low: float, high: float, first: float, resolution: float, count: int) -> tuple[int, int]:
    """The cells from ``low`` to ``high`` along one side, as a range that lies on the grid."""
    begin, end = np.floor((low - first) / resolution), np.ceil((high - first) / resolution) + 1
    return int(np.clip(begin, 0, count)), int(np.clip(end, 0, count))
