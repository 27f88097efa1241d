"""Where vertical lines meet a mesh first from above: triangles sorted into square bins, compiled."""

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints


@njit()
def sorted_into_bins(boxes: Ints, shape: tuple[int, int]) -> tuple[Ints, Ints]:
    """Where each bin's triangles begin, (bins + 1,), and the triangles bin by bin.

    boxes: (n, 4) first and last row and column of the bins that each triangle may lie in.
    """
    begin = np.zeros(shape[0] * shape[1] + 1, np.int64)
    for k in range(len(boxes)):
        for row in range(boxes[k, 0], boxes[k, 1] + 1):
            for col in range(boxes[k, 2], boxes[k, 3] + 1):
                begin[row * shape[1] + col + 1] += 1
    begin = np.cumsum(begin)
    at, members = begin.copy(), np.empty(begin[-1], np.int64)
    for k in range(len(boxes)):
        for row in range(boxes[k, 0], boxes[k, 1] + 1):
            for col in range(boxes[k, 2], boxes[k, 3] + 1):
                members[at[row * shape[1] + col]] = k
                at[row * shape[1] + col] += 1
    return begin, members


@njit()
def highest_at(corners: Array, begin: Ints, members: Ints, bins: Ints, points: Array, slack: float) -> Array:
    """Highest point of the triangles (n, 3, 3) over each of the points (k, 2); NaN where there is none.

    bins: (k,) the bin of each point, −1 outside of all. slack: how far beside a triangle still counts as on its edge,
    as a share of its area.
    """
    out = np.full(len(points), np.nan)
    for k in range(len(points)):
        if bins[k] < 0:
            continue
        x, y = points[k]
        for m in range(begin[bins[k]], begin[bins[k] + 1]):
            a, b, c = corners[members[m]]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
            v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
            w = 1.0 - u - v
            if u >= -slack and v >= -slack and w >= -slack:
                z = u * a[2] + v * b[2] + w * c[2]
                if not out[k] >= z:
                    out[k] = z
    return out
