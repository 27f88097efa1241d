"""A surface under the holes of the ground: it shows as unknown what nobody saw, and says nothing of its height.

It lies lower than every known cell over it, so no known ground is hidden, and as low as the lowest of its rim.
"""

import cv2
import numpy as np

from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import filled

BLOCK = 0.1
"""Least side of its squares [m]."""
MOST = 40_000
"""Squares; of a larger map they are larger."""
SUNK = 0.01
"""Under the lowest known cell near by [m]: two surfaces in one place flicker."""


def under_holes(dem: Dem) -> Mesh:
    """Triangles under all unknown cells, site frame, facing up; none where all is known."""
    grid, heights = dem.geometry, dem.heights
    side = max(1, round(BLOCK / grid.resolution), int(np.ceil(np.sqrt(heights.size / MOST))))
    rows, cols = (-(-size // side) for size in heights.shape)
    margin = ((0, rows * side - grid.rows), (0, cols * side - grid.cols))
    blocks = np.pad(heights, margin, constant_values=np.nan).reshape(rows, side, cols, side)
    low = np.fmin.reduce(np.fmin.reduce(blocks, axis=3), axis=1)
    # the highest known neighbour of what is turned upside down is the lowest
    beneath = cv2.erode(-filled(-low), np.ones((3, 3), np.uint8), borderType=cv2.BORDER_REPLICATE) - SUNK
    unknown = np.pad(np.isnan(heights), margin).reshape(rows, side, cols, side)
    holed = np.logical_or.reduce(unknown, axis=(1, 3))
    square = holed[:-1, :-1] | holed[1:, :-1] | holed[:-1, 1:] | holed[1:, 1:]
    middle = (side - 1) / 2
    x = grid.x0 + grid.resolution * (side * np.arange(cols) + middle)
    y = grid.y0 + grid.resolution * (side * np.arange(rows) + middle)
    x[0], y[0], x[-1], y[-1] = grid.bounds
    vertices = np.stack([*np.meshgrid(x, y), beneath], axis=-1).reshape(-1, 3).astype(np.float64)
    south_west = np.arange(rows * cols).reshape(rows, cols)[:-1, :-1][square]
    corners = [south_west, south_west + 1, south_west + cols + 1, south_west + cols]
    triangles = np.concatenate([np.stack([corners[i] for i in half], axis=-1) for half in ((0, 1, 2), (0, 2, 3))])
    return _used(vertices, triangles)


def _used(vertices: np.ndarray, triangles: np.ndarray) -> Mesh:
    kept, index = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[kept], index.reshape(-1, 3).astype(np.int32))
