"""A leg's joints followed along a straight vertical move of its wheel: compiled, for lift.py, where it is explained."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.chain_kernel import chain_poses


@njit()
def followed(q_bottom: Array, solutions: Array, valid: NDArray[np.bool_], largest: float) -> Array:
    """Postures (k, 6) from ``q_bottom`` on, each the nearest to the last, until none is within ``largest`` [rad].

    solutions (n, 8, 6), valid (n, 8): of the inverse kinematics at each height; those of the first are not looked at.
    """
    out = np.empty((solutions.shape[0], 6))
    out[0] = q_bottom
    for i in range(1, solutions.shape[0]):
        nearest, least = -1, np.inf
        for branch in range(solutions.shape[1]):
            if valid[i, branch]:
                away = _largest_change(solutions[i, branch], out[i - 1])
                if away < least:
                    nearest, least = branch, away
        if nearest < 0 or least > largest:
            return out[:i].copy()
        out[i] = solutions[i, nearest]
    return out


@njit()
def nearest_branch(solutions: Array, q: Array) -> int:
    """Which of the solutions (8, 6), NaN where there is none, is nearest to q (6,); 0 if there are none."""
    nearest, least = 0, np.inf
    for branch in range(solutions.shape[0]):
        away = _largest_change(solutions[branch], q)
        if away < least:
            nearest, least = branch, away
    return nearest


@njit()
def off_line(placements: Array, axes: NDArray[np.int64], qs: Array, origin: Array, up: Array) -> float:
    """Largest distance of the last link's origin from a line, half way between postures (n, 6) [m].

    placements, axes: see chain_kernel.py. origin (3,), up (3,) unit: the line.
    """
    poses = chain_poses(placements, axes, 0.5 * (qs[:-1] + qs[1:]))
    worst = 0.0
    for i in range(poses.shape[0]):
        T = poses[i, -1]
        x, y, z = T[0, 3] - origin[0], T[1, 3] - origin[1], T[2, 3] - origin[2]
        along = x * up[0] + y * up[1] + z * up[2]
        x, y, z = x - along * up[0], y - along * up[1], z - along * up[2]
        worst = max(worst, math.sqrt(x * x + y * y + z * z))
    return worst


@njit()
def _largest_change(a: Array, b: Array) -> float:
    """Maximum norm of b − a; NaN where a has one."""
    largest = 0.0
    for k in range(a.size):
        change = abs(b[k] - a[k])
        if math.isnan(change):
            return change
        largest = max(largest, change)
    return largest
