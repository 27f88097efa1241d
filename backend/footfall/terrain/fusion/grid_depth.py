"""A depth image laid onto the terrain grid: triangles between neighbouring pixels, open where depth jumps.

Counting points in cells would leave stripes where pixels lie further apart than cells. Triangles fill those, and the
ones that would bridge from a surface to what stands behind it are left out, so that unseen ground stays unknown. Where
one is left out, each pixel still shows a piece of ground as large as itself: the parallelogram of half a pixel to all
sides on the plane that was fitted at it (a splat: Zwicker, Pfister, van Baar & Gross, *Surface splatting*, SIGGRAPH
2001). It is taken where no triangle reaches.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.core.value import Value, value
from footfall.terrain.fusion.grid_kernel import cells_of_pixels, cover_cells, points_at
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

    def some(self, which: NDArray[np.bool_]) -> "CellSamples":
        """Those of them that are asked for, (n,)."""
        return CellSamples(self.cell[which], self.height[which], self.variance[which], self.grey[which])


def site_points(depth: NDArray, intrinsics: tuple[float, float, float, float], T_site_camera: NDArray) -> NDArray:
    """What the pixels of a camera see at their depths.

    Args:
        depth: (height, width) [m].
        intrinsics: fx, fy, cx, cy [px].
        T_site_camera: pose of the camera, (4, 4).

    Returns:
        Points (3, height, width) in site [m].
    """
    return points_at(depth.astype(np.float64, copy=False), *intrinsics, np.ascontiguousarray(T_site_camera))


def pixel_sides(
    rows: NDArray[np.int64],
    cols: NDArray[np.int64],
    depth: NDArray[np.float64],
    slopes: tuple[NDArray[np.float32], NDArray[np.float32]],
    focal_baseline: float,
    intrinsics: tuple[float, float, float, float],
    T_site_camera: NDArray,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From the middles of pixels to those on their right and below them, were these on the same plane.

    Derivatives of z (x, y, 1) with z = f·B / (d + offset).

    Args:
        rows: (n,) of the pixels.
        cols: (n,) of the pixels.
        depth: (height, width) [m].
        slopes: change of the disparity to the next column and row, (height, width) each [px].
        focal_baseline: f·B, focal length × baseline [px·m].
        intrinsics: fx, fy, cx, cy [px].
        T_site_camera: pose of the camera, (4, 4).

    Returns:
        (n, 3) each, in site [m].
    """
    fx, fy, cx, cy = intrinsics
    z = depth[rows, cols]
    x, y = (cols - cx) / fx, (rows - cy) / fy
    to_right, to_below = (-np.square(z) / focal_baseline * slope[rows, cols] for slope in slopes)
    R = T_site_camera[:3, :3]
    return (
        np.stack([R[i, 0] * (x * to_right + z / fx) + (R[i, 1] * y + R[i, 2]) * to_right for i in range(3)], axis=1),
        np.stack([R[i, 1] * (y * to_below + z / fy) + (R[i, 0] * x + R[i, 2]) * to_below for i in range(3)], axis=1),
    )


def grid_depth(
    points: NDArray[np.float64],
    disparity: NDArray[np.float32],
    deviation: NDArray[np.float64],
    grey: NDArray[np.uint8],
    geometry: GridGeometry,
    max_jump: float,
    max_edge: float,
    sure: NDArray[np.bool_],
) -> tuple[CellSamples, CellSamples, NDArray[np.bool_]]:
    """Heights of the surface through neighbouring pixels at the cell centres that it covers.

    Args:
        points: (3, height, width) in site [m].
        disparity: (height, width) [px], NaN = unknown.
        deviation: (height, width) of the depth [m], proportional to z²/(f·B).
        grey: (height, width).
        geometry: the grid.
        max_jump: largest difference of disparity within a triangle [px].
        max_edge: longest side from above [m].
        sure: (height, width) pixels that show ground by themselves.

    Returns:
        What sure pixels alone say, what others say, and the pixels (height, width) beside which the sure ones leave a
        gap.
    """
    cell, found, is_sure, gaps = cover_cells(
        (points[0] - geometry.x0) / geometry.resolution,
        (points[1] - geometry.y0) / geometry.resolution,
        disparity,
        (points[2], deviation, grey),
        geometry.rows,
        geometry.cols,
        max_jump,
        max_edge / geometry.resolution,
        sure,
    )
    seen = CellSamples(cell=cell, height=found[:, 0], variance=found[:, 1] ** 2, grey=found[:, 2])
    return seen.some(is_sure), seen.some(~is_sure), gaps & np.isfinite(disparity)


def with_pixels(
    joined: CellSamples,
    rows: NDArray[np.int64],
    cols: NDArray[np.int64],
    sides: tuple[NDArray[np.float64], NDArray[np.float64]],
    points: NDArray[np.float64],
    deviation: NDArray[np.float64],
    grey: NDArray[np.uint8],
    geometry: GridGeometry,
    max_edge: float,
) -> CellSamples:
    """Samples, and in the cells that they do not have what single pixels show there.

    Args:
        joined: samples so far.
        rows: (n,) of those pixels.
        cols: (n,) of those pixels.
        sides: (n, 3) each, as :func:`pixel_sides` has them [m].
        points: (3, height, width) in site [m].
        deviation: (height, width) of the depth [m].
        grey: (height, width).
        geometry: the grid.
        max_edge: longest side of a pixel from above [m].

    Returns:
        All samples.
    """
    covered = np.zeros(geometry.rows * geometry.cols, bool)
    covered[joined.cell] = True
    in_cells = np.array([1.0 / geometry.resolution, 1.0 / geometry.resolution, 1.0])
    to_right, to_below = sides
    cell, height, pixel = cells_of_pixels(
        (points[:, rows, cols].T - (geometry.x0, geometry.y0, 0.0)) * in_cells,
        to_right * in_cells,
        to_below * in_cells,
        covered,
        geometry.rows,
        geometry.cols,
        max_edge / geometry.resolution,
    )
    rows, cols = rows[pixel], cols[pixel]
    return CellSamples(
        np.concatenate([joined.cell, cell]),
        np.concatenate([joined.height, height]),
        np.concatenate([joined.variance, deviation[rows, cols] ** 2]),
        np.concatenate([joined.grey, grey[rows, cols].astype(np.float64)]),
    )


def upper_surface(seen: CellSamples, geometry: GridGeometry, gate: float) -> CellSamples:
    """What one view sees from above: without the ground that it also sees under an overhang.

    A map has one height for a cell; a leg comes from above.

    Args:
        seen: samples of the view.
        geometry: the grid.
        gate: surfaces lie apart by more than this [m].

    Returns:
        The samples of the upper one.
    """
    open_ = ~lies_under(seen.cell, seen.height, geometry.rows, geometry.cols, gate)
    return seen.some(open_)
