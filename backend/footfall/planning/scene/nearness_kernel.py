"""Which pairs of things can be the nearest: compiled lower bounds, so that exact distances are asked of few.

Branch and bound: the bounds are proven (proof/separation.py), coarse first, and finer only where a pair may be nearer
than the nearest so far. Convex links are as far apart as their bound says, so mostly one pair is left to be measured.
"""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.proof.separation import SCRATCH, least_apart
from footfall.robot.proof.shells import CENTER, REACH


@njit()
def pair_bounds(
    shells: Array,
    points: Array,
    moving: Array,
    frozen: Array,
    frozen_shells: NDArray[np.int64],
    deltas: Array,
    own: Array,
    below: float,
    nearest: bool,
) -> Array:
    """Lower bounds of how far pairs are apart beyond δ, (n, parts × bodies + own) [m]; inf where unchecked.

    moving: (n, parts, 4, 4), shells 0…parts − 1; frozen: (bodies, 4, 4), frozen_shells: (bodies,); deltas: (parts,
    bodies), NaN where unchecked; own: (k, 3) two parts and their δ. Bounds that are less than ``below`` are as good
    as the shells allow; with ``nearest`` only those that are less than every bound before.
    """
    n, parts, bodies = moving.shape[0], moving.shape[1], frozen.shape[0]
    if frozen_shells.size != bodies or deltas.shape[0] != parts or deltas.shape[1] != bodies:
        raise ValueError("the tables of the pairs don't fit each other")
    out = np.empty((n, parts * bodies + own.shape[0]))
    middles = np.empty((bodies, 3))
    for body in range(bodies):
        _middle(shells, frozen_shells[body], frozen, body, middles[body])
    scratch, at = np.empty((SCRATCH, 3)), np.empty(3)
    for i in range(n):
        poses = moving[i]
        for part in range(parts):
            _middle(shells, part, poses, part, at)
            for body in range(bodies):
                delta, bound = deltas[part, body], np.inf
                if not math.isnan(delta):
                    b = frozen_shells[body]
                    square = 0.0
                    for k in range(3):
                        square += (at[k] - middles[body, k]) ** 2
                    bound = math.sqrt(square) - shells[part, REACH] - shells[b, REACH] - delta
                    if bound < below:
                        found = least_apart(shells, points, part, poses, part, b, frozen, body, below + delta, scratch)
                        bound = max(bound, found - delta)
                        if nearest:
                            below = min(below, bound)
                out[i, part * bodies + body] = bound
        for k in range(own.shape[0]):
            a, b, delta = int(own[k, 0]), int(own[k, 1]), own[k, 2]
            bound = least_apart(shells, points, a, poses, a, b, poses, b, below + delta, scratch) - delta
            if nearest:
                below = min(below, bound)
            out[i, parts * bodies + k] = bound
    return out


@njit()
def _middle(shells: Array, shell: int, poses: Array, i: int, out: Array) -> None:
    """Write where the middle of a shell is at poses[i]."""
    for row in range(3):
        out[row] = poses[i, row, 3]
        for k in range(3):
            out[row] += poses[i, row, k] * shells[shell, CENTER + k]
