"""The ground's triangles in square tiles, each a hierarchy that is built when something first comes near it.

Building one hierarchy of all the ground in reach of a leg takes longer than planning a step over it, and a step comes
near a small part only. The tiles hold the very triangles of :mod:`footfall.terrain.ground.triangulate`. Raised ground
is the same tiles placed higher. A tile lies at the origin of its own frame, so equal patches of ground are one
hierarchy, for whatever stance, and large site coordinates cost no precision.
"""

from collections.abc import Iterator
from functools import lru_cache

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.frames import transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.robot.meshes.bvh import bvh
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate

BLOCKS = 24
"""Blocks of 2 × 2 cells along the side of a tile."""


class GroundTiles:
    """Tiles of a Dem without holes, site frame.

    heights: (rows, cols) [m]; corner: (2,) x, y of the first; windows: (tiles, 4) first and last row and column,
    and boxes: (tiles, 6) lowest and highest corner [m], of each tile.
    """

    def __init__(self, dem: Dem) -> None:
        grid = dem.geometry
        self.heights, self.resolution = np.ascontiguousarray(dem.heights, np.float32), grid.resolution
        self.corner = np.array([grid.x0, grid.y0])
        # tiles begin at multiples of BLOCKS of the whole map, so that crops of one map share them
        rows = list(_beginnings(grid.rows, round(grid.y0 / grid.resolution)))
        cols = list(_beginnings(grid.cols, round(grid.x0 / grid.resolution)))
        self.windows = np.array([(*row, *col) for row in rows for col in cols], np.int64).reshape(-1, 4)
        ends = self.corner + grid.resolution * self.windows[:, [2, 0, 3, 1]].reshape(-1, 2, 2)
        self._low, self._high = np.dstack([ends, _extremes(self.heights, self.windows)]).swapaxes(0, 1)
        self.boxes = np.hstack([self._low, self._high])

    def distances(self, low: Array, high: Array) -> Array:
        """Lower bounds of the distances from boxes with corners (n, 3) to the tiles' triangles, (n, tiles) [m]."""
        square = np.zeros((len(low), len(self._low)))
        for axis in range(3):
            below = self._low[:, axis] - high[:, None, axis]
            above = low[:, None, axis] - self._high[:, axis]
            square += np.maximum(np.maximum(below, above), 0.0) ** 2
        return np.sqrt(square)

    def shape(self, tile: int) -> tuple[coal.BVHModelOBBRSS, Array]:
        """A tile's hierarchy and T_site_tile (4, 4)."""
        r0, r1, c0, c1 = self.windows[tile]
        window = np.ascontiguousarray(self.heights[r0 : r1 + 1, c0 : c1 + 1], np.float32)
        corner = (*self._low[tile, :2], 0.0)
        return _hierarchy(window.tobytes(), *window.shape, self.resolution), transform(translation=corner)


def _beginnings(count: int, first: int) -> Iterator[tuple[int, int]]:
    """First and last cell of each tile along one side; neighbours share a row of cells."""
    begin = 0
    while begin < count - 1:
        end = min(begin + BLOCKS - (first + begin) % BLOCKS, count - 1)
        yield begin, end
        begin = end


@njit()
def _extremes(heights: NDArray[np.float32], windows: NDArray[np.int64]) -> Array:
    """Least and greatest height in each window, (tiles, 2)."""
    out = np.empty((len(windows), 2))
    for k in range(len(windows)):
        window = heights[windows[k, 0] : windows[k, 1] + 1, windows[k, 2] : windows[k, 3] + 1]
        out[k] = window.min(), window.max()
    return out


@lru_cache(maxsize=160)
def _hierarchy(heights: bytes, rows: int, cols: int, resolution: float) -> coal.BVHModelOBBRSS:
    window = np.frombuffer(heights, np.float32).reshape(rows, cols)
    return bvh(triangulate(Dem(window, GridGeometry(0.0, 0.0, resolution, rows, cols), "tile", Provenance({}))))
