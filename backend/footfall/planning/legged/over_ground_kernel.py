"""The point of a body that is lowest over the ground: compiled."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.terrain.ground.height_kernel import height_in_cells


@njit()
def lowest_of(
    points: Array, T: Array, sole: Array, near: float, heights: NDArray[np.float32], grid: Array, highest: float
) -> tuple[float, int]:
    """How high the lowest point is over the ground [m], and which it is; NaN: over unknown ground, −1: none is left.

    points: of the body, (n, 3) [m]; T: its pose in site. sole: centre of a foot, (3,) in site [m]: points within
    ``near`` [m] are left out, none where that is below 0. heights: of the map [m]; grid: x and y of its first cell's
    middle, and the resolution [m]. highest: no ground under any of the points is higher [m].
    """
    least, at = np.inf, -1
    for i in range(len(points)):
        z = T[2, 0] * points[i, 0] + T[2, 1] * points[i, 1] + T[2, 2] * points[i, 2] + T[2, 3]
        if z - highest > least:
            continue
        x = T[0, 0] * points[i, 0] + T[0, 1] * points[i, 1] + T[0, 2] * points[i, 2] + T[0, 3]
        y = T[1, 0] * points[i, 0] + T[1, 1] * points[i, 1] + T[1, 2] * points[i, 2] + T[1, 3]
        if near > 0 and (x - sole[0]) ** 2 + (y - sole[1]) ** 2 + (z - sole[2]) ** 2 <= near**2:
            continue
        over = z - height_in_cells(heights, (x - grid[0]) / grid[2], (y - grid[1]) / grid[2])
        if np.isnan(over):
            return over, i
        if over < least:
            least, at = over, i
    return least, at
