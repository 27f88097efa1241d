"""A piece of the ground: all of its triangles, or only a few of them, as shapes that distances are measured to."""

from functools import cached_property

import coal
import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.robot.meshes.bvh import bvh
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate


class GroundPiece:
    """Some rows and columns of a Dem without holes."""

    def __init__(self, dem: Dem, rows: slice, cols: slice) -> None:
        self._first = np.array([rows.start, cols.start])
        grid, heights = dem.geometry, dem.heights[rows, cols]
        x0, y0 = grid.x0 + cols.start * grid.resolution, grid.y0 + rows.start * grid.resolution
        geometry = GridGeometry(x0, y0, grid.resolution, *heights.shape)
        self._dem = Dem(heights, geometry, dem.name, Provenance({}))

    @cached_property
    def shape(self) -> coal.BVHModelOBBRSS:
        """The whole piece."""
        return bvh(triangulate(self._dem))

    def few(self, triangles: NDArray[np.int64]) -> coal.BVHModelOBBRSS:
        """Triangles of the piece, (n, 3) row and column of the block in the whole Dem, and which half of it.

        They have the very corners that they have in ``shape``.
        """
        row, col = (triangles[:, :2] - self._first).T
        other = triangles[:, 2] == 0
        # as triangulate has them: south-west, south-east, north-east; south-west, north-east, north-west
        rows = np.column_stack([row, np.where(other, row, row + 1), row + 1])
        cols = np.column_stack([col, col + 1, np.where(other, col + 1, col)])
        grid = self._dem.geometry
        corners = np.stack([grid.xs[cols], grid.ys[rows], self._dem.heights[rows, cols].astype(float)], axis=2)
        return bvh(Mesh(corners.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)))
