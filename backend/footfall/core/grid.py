"""Geometry of regular grids: cells [m] in the site frame, row 0 south, column 0 west."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value


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
        if not (np.isfinite([self.x0, self.y0]).all() and 0 < self.resolution < np.inf):
            raise InvalidInput("a grid needs a finite origin and a positive resolution [m]")
        if self.rows < 1 or self.cols < 1:
            raise InvalidInput("a grid needs at least one cell", rows=self.rows, cols=self.cols)

    @property
    def shape(self) -> tuple[int, int]:
        return self.rows, self.cols

    @property
    def xs(self) -> NDArray[np.float64]:
        """Cell-centre eastings, (cols,)."""
        return self.x0 + self.resolution * np.arange(self.cols)

    @property
    def ys(self) -> NDArray[np.float64]:
        """Cell-centre northings, (rows,)."""
        return self.y0 + self.resolution * np.arange(self.rows)

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
        """Row and column of the nearest cell centre; may lie outside the grid."""
        col = np.floor((np.asarray(x, float) - self.x0) / self.resolution + 0.5).astype(np.int64)
        row = np.floor((np.asarray(y, float) - self.y0) / self.resolution + 0.5).astype(np.int64)
        return row, col

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether points fall into a cell."""
        row, col = self.cell(x, y)
        return (row >= 0) & (row < self.rows) & (col >= 0) & (col < self.cols)
