"""Geometry of regular grids: cells [m] in the site frame, row 0 south, column 0 west."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value

_FAR = 1 << 53
"""Beyond this many cells a float no longer tells neighbours apart."""


@value
class GridGeometry(Value):
    """Where the cells of a grid lie.

    x0, y0: centre of cell (0, 0), site frame [m].
    resolution: cell size [m].
    rows, cols: number of cells to the north and to the east.
    """

    x0: float
    y0: float
    resolution: float
    rows: int
    cols: int

    def check(self) -> None:
        """Raises InvalidInput without a finite origin, a resolution above zero, and at least one row and one column."""
        if not (np.isfinite([self.x0, self.y0]).all() and 0 < self.resolution < np.inf):
            raise InvalidInput("a grid needs a finite origin and a positive resolution [m]")
        if not (isinstance(self.rows, int) and isinstance(self.cols, int)):
            raise InvalidInput("a grid needs whole numbers of rows and cols", rows=self.rows, cols=self.cols)
        if self.rows < 1 or self.cols < 1:
            raise InvalidInput("a grid needs at least one cell", rows=self.rows, cols=self.cols)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, as the shape of an array with one number a cell."""
        return self.rows, self.cols

    @property
    def xs(self) -> NDArray[np.float64]:
        """Cell-centre eastings, (cols,)."""
        return self.x0 + self.resolution * np.arange(self.cols, dtype=float)

    @property
    def ys(self) -> NDArray[np.float64]:
        """Cell-centre northings, (rows,)."""
        return self.y0 + self.resolution * np.arange(self.rows, dtype=float)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north of the outermost cell centres [m]."""
        return (
            self.x0,
            self.y0,
            self.x0 + self.resolution * (self.cols - 1),
            self.y0 + self.resolution * (self.rows - 1),
        )

    def centers(self) -> NDArray[np.float64]:
        """Cell centres, (rows, cols, 2)."""
        x, y = np.meshgrid(self.xs, self.ys)
        return np.stack([x, y], axis=-1)

    def cell(self, x: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Row and column of the nearest cell centre; may lie outside the grid, as NaN always does."""
        return self._index(y, self.y0), self._index(x, self.x0)

    def _index(self, position: ArrayLike, start: float) -> NDArray[np.int64]:
        with np.errstate(over="ignore"):
            index = np.floor((np.asarray(position, float) - start) / self.resolution + 0.5)
        # what NaN or 1e300 becomes as an integer depends on the processor, and could be a cell
        return np.where(np.abs(index) < _FAR, index, -_FAR).astype(np.int64)

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether points fall into a cell."""
        row, col = self.cell(x, y)
        return (row >= 0) & (row < self.rows) & (col >= 0) & (col < self.cols)
