"""Margins to support polygons for many places of one foot; compiled, for support.py, where the polygon is explained."""

import numpy as np
from numba import prange

from footfall.balance.foot_pairs import MOST_FEET, NONE
from footfall.compiled import njit
from footfall.core.arrays import Array

COINCIDENT = 1e-9
"""Feet nearer to each other than this share of the stance's size count as one place."""

ON_LINE = 1e-12
"""A foot nearer to a line than this share of the stance's size lies on it."""

_AT_ONCE = 256


@njit(parallel=True)
def candidate_margins(fixed, candidates, coms, allowed, margins, pairs, lost):
    """Margin, binding pair and lost foot for each candidate as the last foot of the stance.

    fixed (k, 2), candidates (n, 2), coms (n, 2); allowed: how many feet may lie beyond an edge, 0 or 1.
    margins (n,) float64, pairs (n,) uint8, lost (n,) uint8 are filled. Where a candidate or its centre of mass is not
    finite the margin is NaN; where there is no polygon it is −inf; both with NONE.
    """
    count = candidates.shape[0]
    feet = fixed.shape[0] + 1
    if feet > MOST_FEET or coms.shape[0] != count or margins.size != count or pairs.size != count or lost.size != count:
        raise ValueError("the arrays of the candidates don't fit each other")
    for part_unsigned in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        part = np.int64(part_unsigned)
        x, y = np.empty(feet), np.empty(feet)
        for foot in range(feet - 1):
            x[foot], y[foot] = fixed[foot, 0], fixed[foot, 1]
        for i in range(part * _AT_ONCE, min(count, (part + 1) * _AT_ONCE)):
            x[feet - 1], y[feet - 1] = candidates[i, 0], candidates[i, 1]
            margins[i], pairs[i], lost[i] = _margin(x, y, coms[i, 0], coms[i, 1], allowed)


@njit()
def margin_of_feet(x: Array, y: Array, com_x: float, com_y: float, allowed: int) -> float:
    """Margin [m] of one centre of mass to the polygon of feet x, y (k,) [m], as support.py's ``margin``.

    allowed: how many feet may lie beyond an edge, 0 or 1: the conservative polygon. −inf where there is no polygon; NaN
    where a number is not finite.
    """
    # from the centre of mass, as far from the origin of the site differences of products would lose digits
    from_x, from_y = x - com_x, y - com_y
    for foot in range(x.size):
        if not (np.isfinite(from_x[foot]) and np.isfinite(from_y[foot])):
            return np.nan
    if x.size == 0:
        return -np.inf
    return _margin(from_x, from_y, 0.0, 0.0, allowed)[0]


@njit()
def _margin(x, y, com_x, com_y, allowed):
    feet = x.size
    last = feet - 1
    if not (np.isfinite(x[last]) and np.isfinite(y[last]) and np.isfinite(com_x) and np.isfinite(com_y)):
        return np.nan, np.uint8(NONE), np.uint8(NONE)
    if feet < 3 + allowed:
        return -np.inf, np.uint8(NONE), np.uint8(NONE)
    size = max(x.max() - x.min(), y.max() - y.min())
    near = ON_LINE * size
    least, spread = np.inf, 0.0
    start, end = -1, -1
    for a in range(feet):
        for b in range(a + 1, feet):
            nx, ny = y[b] - y[a], x[a] - x[b]
            length = np.sqrt(nx * nx + ny * ny)
            if length <= COINCIDENT * size:
                continue
            nx, ny = nx / length, ny / length
            offset = x[a] * nx + y[a] * ny
            right = left = 0
            for c in range(feet):
                # without branches, which would be mispredicted half of the time
                beyond = x[c] * nx + y[c] * ny - offset
                other = (c != a) & (c != b)
                spread = max(spread, abs(beyond))
                right += int(other & (beyond > near))
                left += int(other & (beyond < -near))
            beyond = com_x * nx + com_y * ny - offset
            if right <= allowed and -beyond < least:
                least, start, end = -beyond, a, b
            if left <= allowed and beyond < least:
                least, start, end = beyond, b, a
    if spread <= COINCIDENT * size:
        return -np.inf, np.uint8(NONE), np.uint8(NONE)
    return least, np.uint8(16 * start + end), np.uint8(_beyond(x, y, start, end, near))


@njit()
def _beyond(x, y, start, end, near):
    """The foot to the right of the line from start to end, or NONE."""
    nx, ny = y[end] - y[start], x[start] - x[end]
    length = np.sqrt(nx * nx + ny * ny)
    for c in range(x.size):
        if c != start and c != end and ((x[c] - x[start]) * nx + (y[c] - y[start]) * ny) / length > near:
            return c
    return NONE
