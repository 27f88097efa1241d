"""Compiled: the points that pixels see, and the cells whose centres lie among them.

That is inside the triangles between neighbouring points, with what is there, or inside a single pixel.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array


@njit(error_model="numpy", nogil=True)
def points_at(depth: Array, fx: float, fy: float, cx: float, cy: float, T: Array) -> NDArray[np.float64]:
    """What pixels of a camera see at their depths (height, width) [m].

    Points (3, height, width) of the frame that T leads to from the camera's. In this order of operations whatever the
    number of threads is.
    """
    points = np.empty((3, *depth.shape))
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[v, u]
            x, y = (u - cx) / fx * z, (v - cy) / fy * z
            for i in range(3):
                points[i, v, u] = T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3]
    return points


@njit(error_model="numpy", nogil=True)
def cover_cells(
    x: Array,
    y: Array,
    disparity: NDArray[np.float32],
    layers: tuple[Array, Array, NDArray[np.uint8]],
    rows: int,
    cols: int,
    max_jump: float,
    max_edge: float,
    sure: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
    """Flat indices (n,) of covered cells, what is there, and which pixels leave a gap.

    With each cell come the three interpolated layers (n, 3) there and whether all corners behind them are sure (n,); a
    cell may occur several times. A gap is at pixels (height, width) that lack a triangle of sure corners.

    x, y: (height, width) of each pixel's point [cells]; disparity: (height, width) [px], NaN = unknown; layers:
    (height, width) each. Triangles with a side over max_edge along x or y [cells], or with disparities further apart
    than max_jump [px], are left out. sure: (height, width).
    """
    first, second, third = layers
    cell = np.empty(disparity.size, np.int64)
    value = np.empty((disparity.size, 3), np.float64)
    is_sure = np.empty(disparity.size, np.bool_)
    left_out = np.zeros(disparity.shape, np.bool_)
    count = 0
    v, u = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in range(disparity.shape[0] - 1):
        for j in range(disparity.shape[1] - 1):
            for half in range(2):
                # upper left, lower left, upper right; upper right, lower left, lower right
                v[0], u[0] = i, j + half
                v[1], u[1] = i + 1, j
                v[2], u[2] = i + half, j + 1
                d0, d1, d2 = disparity[v[0], u[0]], disparity[v[1], u[1]], disparity[v[2], u[2]]
                # an unknown corner makes this comparison false
                if not max(d0, d1, d2) - min(d0, d1, d2) <= max_jump or np.isnan(d0 + d1 + d2):
                    _mark(left_out, v, u)
                    continue
                x0, x1, x2 = x[v[0], u[0]], x[v[1], u[1]], x[v[2], u[2]]
                y0, y1, y2 = y[v[0], u[0]], y[v[1], u[1]], y[v[2], u[2]]
                west, east = min(x0, x1, x2), max(x0, x1, x2)
                south, north = min(y0, y1, y2), max(y0, y1, y2)
                if not (east - west <= max_edge and north - south <= max_edge):
                    _mark(left_out, v, u)
                    continue
                all_sure = sure[v[0], u[0]] and sure[v[1], u[1]] and sure[v[2], u[2]]
                if not all_sure:
                    _mark(left_out, v, u)
                first_col, last_col = max(np.ceil(west), 0.0), min(np.floor(east), cols - 1.0)
                first_row, last_row = max(np.ceil(south), 0.0), min(np.floor(north), rows - 1.0)
                if first_col > last_col or first_row > last_row:
                    continue
                area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
                for row in range(int(first_row), int(last_row) + 1):
                    for col in range(int(first_col), int(last_col) + 1):
                        px, py = col - x0, row - y0
                        w1 = (px * (y2 - y0) - py * (x2 - x0)) / area
                        w2 = (py * (x1 - x0) - px * (y1 - y0)) / area
                        w0 = 1.0 - w1 - w2
                        if not (w0 >= 0 and w1 >= 0 and w2 >= 0):
                            continue
                        if count == len(cell):
                            cell = np.concatenate((cell, np.empty_like(cell)))
                            value = np.concatenate((value, np.empty_like(value)))
                            is_sure = np.concatenate((is_sure, np.empty_like(is_sure)))
                        cell[count], is_sure[count] = row * cols + col, all_sure
                        value[count, 0] = w0 * first[v[0], u[0]] + w1 * first[v[1], u[1]] + w2 * first[v[2], u[2]]
                        value[count, 1] = w0 * second[v[0], u[0]] + w1 * second[v[1], u[1]] + w2 * second[v[2], u[2]]
                        value[count, 2] = w0 * third[v[0], u[0]] + w1 * third[v[1], u[1]] + w2 * third[v[2], u[2]]
                        count += 1
    return cell[:count].copy(), value[:count].copy(), is_sure[:count].copy(), left_out


@njit(error_model="numpy", nogil=True)
def _mark(image: NDArray[np.bool_], rows: NDArray[np.int64], cols: NDArray[np.int64]) -> None:
    for k in range(len(rows)):
        image[rows[k], cols[k]] = True


@njit(error_model="numpy", nogil=True)
def cells_of_pixels(
    point: NDArray[np.float64],
    to_right: NDArray[np.float64],
    down: NDArray[np.float64],
    covered: NDArray[np.bool_],
    rows: int,
    cols: int,
    max_edge: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Flat indices (n,) of cells not ``covered`` yet whose centres lie inside of single pixels.

    With their heights (n,) and which pixel each is of; a cell may occur several times.

    point: (m, 3) in the middle of each pixel, x and y [cells], z [m]; to_right, down: (m, 3), to the middles of the
    pixels beside and below, were they on the plane of this one. Pixels that are longer than max_edge along x or y
    [cells] cover nothing.
    """
    most = 4 * len(point) + 64
    cell, height, pixel = np.empty(most, np.int64), np.empty(most), np.empty(most, np.int64)
    count = 0
    for i in range(len(point)):
        x, y, z = point[i]
        ax, ay, az = to_right[i]
        bx, by, bz = down[i]
        half_x, half_y = 0.5 * (abs(ax) + abs(bx)), 0.5 * (abs(ay) + abs(by))
        if not (2.0 * half_x <= max_edge and 2.0 * half_y <= max_edge):
            continue
        area = ax * by - ay * bx
        first_row, last_row = max(np.ceil(y - half_y), 0.0), min(np.floor(y + half_y), rows - 1.0)
        first_col, last_col = max(np.ceil(x - half_x), 0.0), min(np.floor(x + half_x), cols - 1.0)
        for row in range(int(first_row), int(last_row) + 1):
            for col in range(int(first_col), int(last_col) + 1):
                if covered[row * cols + col]:
                    continue
                px, py = col - x, row - y
                s, t = (px * by - py * bx) / area, (py * ax - px * ay) / area
                if not (abs(s) <= 0.5 and abs(t) <= 0.5):
                    continue
                if count == len(cell):
                    cell = np.concatenate((cell, np.empty_like(cell)))
                    height = np.concatenate((height, np.empty_like(height)))
                    pixel = np.concatenate((pixel, np.empty_like(pixel)))
                cell[count], height[count], pixel[count] = row * cols + col, z + s * az + t * bz, i
                count += 1
    return cell[:count].copy(), height[:count].copy(), pixel[:count].copy()
