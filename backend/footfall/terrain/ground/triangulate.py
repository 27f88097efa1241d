"""The one surface of a Dem: display, collision and picking all use these triangles.

Each 2 × 2 block of known cells gives two triangles over its cell centres, cut along the diagonal from
south-west to north-east. A block with an unknown cell gives none, so holes stay holes.
"""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem


def triangulate(dem: Dem) -> Mesh:
    """All triangles, site frame, facing up; only vertices that a triangle uses."""
    return _triangulate_window(dem, 0, dem.geometry.rows, 0, dem.geometry.cols)


def crop(terrain: Mesh | Dem, center_xy: ArrayLike, radius: float) -> Mesh:
    """The triangles whose bounding rectangle comes near a place.

    No triangle that reaches into the disc is left out; a few just outside it may stay. A Dem gives the same triangles
    as its whole triangulation, sooner.

    Args:
        terrain: the ground as triangles, or as cells.
        center_xy: (2,) in site [m].
        radius: how near [m].

    Returns:
        Those triangles.
    """
    x, y = (float(c) for c in np.asarray(center_xy, float))
    if isinstance(terrain, Dem):
        grid = terrain.geometry
        west, south, _, _ = grid.bounds
        # one cell more on each side than the disc reaches, against rounding
        first_row, last_row = (
            int(np.clip(np.floor((y + d - south) / grid.resolution), -2, grid.rows + 2)) for d in (-radius, radius)
        )
        first_col, last_col = (
            int(np.clip(np.floor((x + d - west) / grid.resolution), -2, grid.cols + 2)) for d in (-radius, radius)
        )
        terrain = _triangulate_window(
            terrain,
            max(first_row - 1, 0),
            min(last_row + 3, grid.rows),
            max(first_col - 1, 0),
            min(last_col + 3, grid.cols),
        )
    corners = terrain.vertices[terrain.triangles][..., :2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    center = np.array([x, y])
    gap = np.maximum(np.maximum(low - center, center - high), 0.0)
    return _compact(terrain.vertices, terrain.triangles[np.hypot(gap[:, 0], gap[:, 1]) <= radius])


def _triangulate_window(dem: Dem, row0: int, row1: int, col0: int, col1: int) -> Mesh:
    grid = dem.geometry
    heights = dem.heights[row0:row1, col0:col1]
    rows, cols = heights.shape
    if rows < 2 or cols < 2:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    known = np.isfinite(heights)
    block = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    used = np.zeros(heights.shape, bool)
    for drow in (0, 1):
        for dcol in (0, 1):
            used[drow : rows - 1 + drow, dcol : cols - 1 + dcol] |= block
    index = np.cumsum(used, dtype=np.int32).reshape(heights.shape) - 1
    row, col = np.nonzero(used)
    vertices = np.column_stack([grid.xs[col0:col1][col], grid.ys[row0:row1][row], heights[used]]).astype(np.float64)
    sw, se = index[:-1, :-1][block], index[:-1, 1:][block]
    nw, ne = index[1:, :-1][block], index[1:, 1:][block]
    triangles = np.stack([np.column_stack([sw, se, ne]), np.column_stack([sw, ne, nw])], axis=1)
    return Mesh(vertices, triangles.reshape(-1, 3).astype(np.int32, copy=False))


def _compact(vertices: np.ndarray, triangles: np.ndarray) -> Mesh:
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    index = np.cumsum(used, dtype=np.int32) - 1
    return Mesh(vertices[used], index[triangles].astype(np.int32, copy=False).reshape(-1, 3))
