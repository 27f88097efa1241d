"""Compiled: the cell centres that lie inside the triangles between neighbouring pixels, and what is there."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit

Image = NDArray[np.float64]


@njit(error_model="numpy")
def cover_cells(
    x: Image,
    y: Image,
    disparity: NDArray[np.float32],
    layers: Image,
    rows: int,
    cols: int,
    max_jump: float,
    max_edge: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Flat indices (n,) of covered cells and the interpolated layers (n, k) there; a cell may occur several times.

    x, y: (height, width) of each pixel's point [cells]; disparity: (height, width) [px], NaN = unknown; layers:
    (height, width, k). Triangles with a side over max_edge along x or y [cells], or with disparities further apart
    than max_jump [px], cover nothing.
    """
    depth = layers.shape[2]
    cell = np.empty(disparity.size, np.int64)
    value = np.empty((disparity.size, depth), np.float64)
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
                    continue
                x0, x1, x2 = x[v[0], u[0]], x[v[1], u[1]], x[v[2], u[2]]
                y0, y1, y2 = y[v[0], u[0]], y[v[1], u[1]], y[v[2], u[2]]
                west, east = min(x0, x1, x2), max(x0, x1, x2)
                south, north = min(y0, y1, y2), max(y0, y1, y2)
                if not (east - west <= max_edge and north - south <= max_edge):
                    continue
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
                        cell[count] = row * cols + col
                        for k in range(depth):
                            value[count, k] = (
                                w0 * layers[v[0], u[0], k] + w1 * layers[v[1], u[1], k] + w2 * layers[v[2], u[2], k]
                            )
                        count += 1
    return cell[:count].copy(), value[:count].copy()
