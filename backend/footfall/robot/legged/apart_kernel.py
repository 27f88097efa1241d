"""Lower bounds of how far bodies are apart, by balls and by capsules around them: compiled."""

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints

ROUNDING = 1e-9
"""A bound says so much less than what was computed [m]."""


@njit()
def bounds(Ts: Array, balls: Array, capsules: Array, starts: Ints, pairs: Ints) -> tuple[Array, Array]:
    """Least distances of pairs of bodies by balls around them, and by capsules around their shapes, each (n,) [m].

    Ts: poses of the bodies, (bodies, 4, 4). balls: centre and radius in the body, (bodies, 4) [m]. capsules: both ends
    and the radius in the body, (shapes, 7) [m]; starts: of each body's among them, (bodies + 1,). pairs: (n, 2) bodies.
    """
    centers, ends = np.empty((len(Ts), 3)), np.empty((len(capsules), 6))
    for body in range(len(Ts)):
        _put(Ts[body], balls[body, :3], centers[body])
        for one in range(starts[body], starts[body + 1]):
            _put(Ts[body], capsules[one, :3], ends[one, :3])
            _put(Ts[body], capsules[one, 3:6], ends[one, 3:])
    by_balls, by_capsules = np.empty(len(pairs)), np.full(len(pairs), np.inf)
    for row in range(len(pairs)):
        a, b = pairs[row]
        squared = 0.0
        for axis in range(3):
            squared += (centers[a, axis] - centers[b, axis]) ** 2
        by_balls[row] = np.sqrt(squared) - balls[a, 3] - balls[b, 3]
        for one in range(starts[a], starts[a + 1]):
            for other in range(starts[b], starts[b + 1]):
                between = segment_distance(ends[one, :3], ends[one, 3:], ends[other, :3], ends[other, 3:])
                by_capsules[row] = min(by_capsules[row], between - capsules[one, 6] - capsules[other, 6] - ROUNDING)
    return by_balls, by_capsules


@njit()
def segment_distance(p: Array, q: Array, r: Array, s: Array) -> float:
    """Least distance of the segments pq and rs [m].

    Args:
        p: an end of one, (3,) [m].
        q: its other end, (3,) [m].
        r: an end of the other, (3,) [m].
        s: its other end, (3,) [m].

    Returns:
        The distance; of segments without length that of points (Ericson, Real-Time Collision Detection, 5.1.9).
    """
    along, across, off = q - p, s - r, p - r
    a, e, f = _dot(along, along), _dot(across, across), _dot(across, off)
    b, c = _dot(along, across), _dot(along, off)
    one = other = 0.0
    if a > 0.0 and e > 0.0:
        area = a * e - b * b
        if area > 0.0:
            one = min(max((b * f - c * e) / area, 0.0), 1.0)
        other = (b * one + f) / e
        if other < 0.0:
            other, one = 0.0, min(max(-c / a, 0.0), 1.0)
        elif other > 1.0:
            other, one = 1.0, min(max((b - c) / a, 0.0), 1.0)
    elif a > 0.0:
        one = min(max(-c / a, 0.0), 1.0)
    elif e > 0.0:
        other = min(max(f / e, 0.0), 1.0)
    squared = 0.0
    for axis in range(3):
        squared += (off[axis] + one * along[axis] - other * across[axis]) ** 2
    return np.sqrt(squared)


@njit()
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit()
def _put(T: Array, point: Array, out: Array) -> None:
    for axis in range(3):
        out[axis] = T[axis, 0] * point[0] + T[axis, 1] * point[1] + T[axis, 2] * point[2] + T[axis, 3]
