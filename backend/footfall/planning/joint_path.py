"""Straight lines from configuration to configuration, in the space of joints.

How finely a line is sampled is said in the maximum norm: neighbouring samples differ by at most a step in *every* joint
[rad].
"""

from collections.abc import Iterator

import numpy as np

from footfall.core.arrays import Array


def largest_change(a: Array, b: Array) -> float:
    """Maximum norm of b − a [rad], (d,) each."""
    return float(np.abs(b - a).max())


def samples(a: Array, b: Array, step: float) -> Iterator[tuple[float, Array]]:
    """Evenly spaced configurations from one to another, both included.

    Args:
        a: the one, (d,) [rad].
        b: the other, (d,) [rad].
        step: no joint changes by more than this [rad].

    Yields:
        The fraction 0…1 of the way, and the configuration (d,).
    """
    count = max(1, int(np.ceil(largest_change(a, b) / step)))
    for i in range(count + 1):
        yield i / count, a + (i / count) * (b - a)


def length(path: Array) -> float:
    """Euclidean length of waypoints (n, d) in joint space [rad]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
