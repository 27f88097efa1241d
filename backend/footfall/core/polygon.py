"""Convex polygons in the plane, as their corners counter-clockwise, (k, 2)."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array

_ROUNDING = 2.0**-53


def convex_hull(points: ArrayLike) -> Array:
    """Corners of the hull, counter-clockwise, (k, 2); Andrew's monotone chain (1979).

    Points that are collinear within rounding are dropped, so every corner turns left for certain; one or
    two distinct points come back as they are.
    """
    pts = np.unique(np.asarray(points, float).reshape(-1, 2), axis=0)
    if len(pts) <= 2:
        return pts

    def half(ordered: Array) -> list[Array]:
        chain: list[Array] = []
        for p in ordered:
            while len(chain) >= 2 and not _turns_left(chain[-2], chain[-1], p):
                chain.pop()
            chain.append(p)
        return chain

    lower, upper = half(pts), half(pts[::-1])
    return np.array(lower[:-1] + upper[:-1])


def _turns_left(a: Array, b: Array, c: Array) -> bool:
    left, right = (b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])
    # error bound of this difference: Shewchuk 1997, "Adaptive precision floating-point arithmetic", ccwerrboundA
    return bool(left - right > 4 * _ROUNDING * (abs(left) + abs(right)))


def area(corners: ArrayLike) -> float:
    """Signed area, positive counter-clockwise [m²] (shoelace formula)."""
    p = np.asarray(corners, float)
    if len(p) < 3:
        return 0.0
    x, y = p[:, 0], p[:, 1]
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def clip(corners: ArrayLike, normal: ArrayLike, offset: float) -> Array:
    """The part of a convex polygon on one side of a line (Sutherland & Hodgman, 1974).

    Args:
        corners: (n, 2) in order.
        normal: (2,) of the line.
        offset: what stays has normal · p ≤ offset.

    Returns:
        Corners (m, 2) of that part, in order.
    """
    p = np.asarray(corners, float).reshape(-1, 2)
    if len(p) == 0:
        return p
    inside = p @ np.asarray(normal, float) - offset
    kept: list[Array] = []
    for i in range(len(p)):
        j = (i + 1) % len(p)
        if inside[i] <= 0:
            kept.append(p[i])
        if (inside[i] < 0 < inside[j]) or (inside[j] < 0 < inside[i]):
            kept.append(p[i] + (p[j] - p[i]) * inside[i] / (inside[i] - inside[j]))
    return np.array(kept).reshape(-1, 2)
