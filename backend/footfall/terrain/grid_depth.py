"""A depth image laid onto the terrain grid: triangles between neighbouring pixels, open where depth jumps.

Counting points in cells would leave stripes where pixels lie further apart than cells. Triangles fill those, and the
ones that would bridge from a surface to what stands behind it are left out, so that unseen ground stays unknown.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.core.value import Value, value


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
    rows, cols = disparity.shape
    gx = ((points[0] - geometry.x0) / geometry.resolution).ravel()
    gy = ((points[1] - geometry.y0) / geometry.resolution).ravel()
    pixel = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = (p.ravel() for p in (pixel[:-1, :-1], pixel[:-1, 1:], pixel[1:, :-1], pixel[1:, 1:]))
    triangles = np.concatenate([np.stack([a, c, b]), np.stack([b, c, d])], axis=1)
    # NaN comparisons are false, so that triangles with an unknown corner fall out here
    corner = disparity.ravel()[triangles]
    triangles = triangles[:, corner.max(axis=0) - corner.min(axis=0) <= max_jump]
    x, y = gx[triangles], gy[triangles]
    x_low, x_high, y_low, y_high = x.min(axis=0), x.max(axis=0), y.min(axis=0), y.max(axis=0)
    longest = max_edge / geometry.resolution
    col0, col1 = np.maximum(np.ceil(x_low), 0), np.minimum(np.floor(x_high), geometry.cols - 1)
    row0, row1 = np.maximum(np.ceil(y_low), 0), np.minimum(np.floor(y_high), geometry.rows - 1)
    keep = (col0 <= col1) & (row0 <= row1) & (x_high - x_low <= longest) & (y_high - y_low <= longest)
    triangles, x, y = triangles[:, keep], x[:, keep], y[:, keep]
    col0, row0 = col0[keep].astype(np.int64), row0[keep].astype(np.int64)
    width, height = col1[keep].astype(np.int64) - col0 + 1, row1[keep].astype(np.int64) - row0 + 1

    # one entry for each cell centre inside each triangle's bounding box
    count = width * height
    of = np.repeat(np.arange(len(count)), count)
    place = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    col = col0[of] + place % width[of]
    row = row0[of] + place // width[of]
    (x0, x1, x2), (y0, y1, y2) = x, y
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    with np.errstate(divide="ignore", invalid="ignore"):
        px, py = col - x0[of], row - y0[of]
        w1 = (px * (y2 - y0)[of] - py * (x2 - x0)[of]) / area[of]
        w2 = (py * (x1 - x0)[of] - px * (y1 - y0)[of]) / area[of]
        w0 = 1.0 - w1 - w2
        inside = (w0 >= 0) & (w1 >= 0) & (w2 >= 0)
    of, row, col = of[inside], row[inside], col[inside]
    weights = np.stack([w0[inside], w1[inside], w2[inside]])
    corners = triangles[:, of]

    def at_cell(image: NDArray) -> NDArray[np.float64]:
        values = image.ravel()[corners]
        return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]

    return CellSamples(
        cell=row * geometry.cols + col,
        height=at_cell(points[2]),
        variance=at_cell(deviation) ** 2,
        grey=at_cell(grey),
    )
