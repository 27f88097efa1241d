"""Planes fitted to discs of the surface of a Dem: compiled."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.terrain.ground.height_kernel import height_in_cells

LEAST_KNOWN = 0.5
"""Share of a disc that is known at least where a plane is fitted."""
LEAST_SPREAD = 0.1
"""Variance of the known places along every direction, at least, as a share of a full disc's: radius² / 4."""
AT_ONCE = 128
"""Most numbers that are added without halving them first."""


@njit()
def normals_of_discs(
    heights: NDArray[np.float32],
    corner: tuple[float, float, float],
    centers: tuple[Array, Array],
    disc: tuple[Array, Array],
    radius: float,
) -> Array:
    """Upward unit normals (n, 3) of the least-squares planes through the surface in discs.

    corner: x0, y0 and resolution of the map [m]; centers: x and y of the discs, (n,) each [m]; disc: places about a
    centre, (k,) each [m]. NaN where too little of the disc is known, or what is known lies almost on a line.
    """
    (x0, y0, resolution), (x, y), (dx, dy) = corner, centers, disc
    # known places, about their means, so that large heights cost no precision; 0 where unknown
    px, py, pz, known = np.empty(len(dx)), np.empty(len(dx)), np.empty(len(dx)), np.empty(len(dx), np.bool_)
    normals = np.full((len(x), 3), np.nan)
    for i in range(len(x)):
        count = 0
        for j in range(len(dx)):
            z = height_in_cells(heights, (x[i] + dx[j] - x0) / resolution, (y[i] + dy[j] - y0) / resolution)
            known[j] = np.isfinite(z)
            count += known[j]
            px[j], py[j], pz[j] = (dx[j], dy[j], z) if known[j] else (0.0, 0.0, 0.0)
        if count < LEAST_KNOWN * len(dx):
            continue
        mean_x, mean_y, mean_z = added(px) / count, added(py) / count, added(pz) / count
        for j in range(len(dx)):
            if known[j]:
                px[j], py[j], pz[j] = px[j] - mean_x, py[j] - mean_y, pz[j] - mean_z
        xx, xy, yy = added(px * px) / count, added(px * py) / count, added(py * py) / count
        least = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
        if not least > LEAST_SPREAD * radius * radius / 4:
            continue
        xz, yz = added(px * pz) / count, added(py * pz) / count
        det = xx * yy - xy * xy
        a, b = (xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det
        size = np.sqrt(a * a + b * b + 1.0)
        normals[i] = (-a / size, -b / size, 1.0 / size)
    return normals


@njit()
def added(values: Array) -> float:
    """Sum of contiguous numbers, in the order in which numpy adds: to the same bit, so plans replay alike."""
    n = len(values)
    if n > AT_ONCE:
        half = n // 2 - n // 2 % 8
        return added(values[:half]) + added(values[half:])
    even, total = n - n % 8, 0.0
    if even:
        a, b, c, d, e, f, g, h = values[0], values[1], values[2], values[3], values[4], values[5], values[6], values[7]
        for i in range(8, even, 8):
            a, b, c, d = a + values[i], b + values[i + 1], c + values[i + 2], d + values[i + 3]
            e, f, g, h = e + values[i + 4], f + values[i + 5], g + values[i + 6], h + values[i + 7]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(even, n):
        total += values[i]
    return total
