"""A depth image laid onto the terrain grid: triangles between neighbouring pixels, open where depth jumps.

Counting points in cells would leave stripes where pixels lie further apart than cells. Triangles fill those, and the
ones that would bridge from a surface to what stands behind it are left out, so that unseen ground stays unknown.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.core.value import Value, value
from footfall.terrain.fusion.grid_kernel import cover_cells
from footfall.terrain.fusion.overhang_kernel import lies_under


@value
class CellSamples(Value):
    """Heights seen in grid cells; a cell may occur any number of times.

    cell: (n,) int64, row · cols + col.
    height: (n,) float64 at the cell's centre [m].
    variance: (n,) float64 of the depth behind it [m²].
    grey: (n,) float64, 0…255.
    """

    cell: NDArray[np.int64]
    height: NDArray[np.float64]
    variance: NDArray[np.float64]
    grey: NDArray[np.float64]


def site_points(depth: NDArray, intrinsics: tuple[float, float, float, float], T_site_camera: NDArray) -> NDArray:
    """Points of the site frame, (3, height, width), for depths [m] at every pixel; fx, fy, cx, cy [px].

    Written out instead of a matrix product: the result must not depend on the number of threads.
    """
    fx, fy, cx, cy = intrinsics
    rows, cols = depth.shape
    x = (np.arange(cols) - cx)[None, :] / fx * depth
    y = (np.arange(rows) - cy)[:, None] / fy * depth
    T = T_site_camera
    return np.stack([T[i, 0] * x + T[i, 1] * y + T[i, 2] * depth + T[i, 3] for i in range(3)])


def grid_depth(
    points: NDArray[np.float64],
    disparity: NDArray[np.float32],
    deviation: NDArray[np.float64],
    grey: NDArray[np.uint8],
    geometry: GridGeometry,
    max_jump: float,
    max_edge: float,
) -> CellSamples:
    """Heights of the surface through neighbouring pixels at the cell centres that it covers.

    points: (3, height, width) site [m]; disparity: (height, width) [px], NaN = unknown; deviation: (height,
    width) of the depth [m], proportional to z²/(f·B); grey: (height, width).
    max_jump: largest difference of disparity within a triangle [px]; max_edge: longest side from above [m].
    """
    cell, found = cover_cells(
        (points[0] - geometry.x0) / geometry.resolution,
        (points[1] - geometry.y0) / geometry.resolution,
        disparity,
        np.stack([points[2], deviation, grey.astype(np.float64)], axis=-1),
        geometry.rows,
        geometry.cols,
        max_jump,
        max_edge / geometry.resolution,
    )
    return CellSamples(cell=cell, height=found[:, 0], variance=found[:, 1] ** 2, grey=found[:, 2])


def upper_surface(seen: CellSamples, geometry: GridGeometry, gate: float) -> CellSamples:
    """What one view sees from above: without the ground that it also sees under an overhang.

    gate: surfaces lie apart by more than this [m]. A map has one height for a cell; a leg comes from above.
    """
    open_ = ~lies_under(seen.cell, seen.height, geometry.rows, geometry.cols, gate)
    return CellSamples(seen.cell[open_], seen.height[open_], seen.variance[open_], seen.grey[open_])
