"""Whether single postures of the moving leg, and edges between them, are surely allowed: compiled.

Sure means: inside the limits, certified clear (robot/clearance.py proves what that says), and balanced with more to
spare than rounding takes. What is not sure is left to the exact checks of situation.py.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from footfall.robot.leg_clearance_kernel import LegTables, leg_is_clear
from footfall.robot.leg_frames import PART_COUNT, leg_frames

Array = NDArray[np.float64]

ROUNDING = 1e-6
"""What the margin must have to spare to be sure [m]; above what two ways to compute it differ by in map
coordinates of millions of metres."""

SURE = -1
"""Answer of the kernels where nothing is unsure."""


class BodyTables(NamedTuple):
    """What decides besides clearance.

    lower, upper: (6,) limits [rad]. moments: (7, 4), of each part of the leg: mass × its centre in the part's frame,
    and mass, both divided by the rover's mass. rest: (2,) x, y of what all else adds to the centre of mass, site [m].
    normals (k, 2), offsets (k,): the half-planes that the centre of mass must be in. least: by how much [m].
    """

    lower: Array
    upper: Array
    moments: Array
    rest: Array
    normals: Array
    offsets: Array
    least: float


@njit(cache=True)
def margin_at(q: Array, T_site_hip: Array, lengths: Array, body: BodyTables) -> float:
    """Margin of the centre of mass to the nearest half-plane [m]; −inf where there is none."""
    if body.offsets.size == 0:
        return -np.inf
    R, at = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    leg_frames(lengths, q, R, at)
    hx = hy = hz = share = 0.0
    for part in range(PART_COUNT):
        mx, my, mz, m = body.moments[part, 0], body.moments[part, 1], body.moments[part, 2], body.moments[part, 3]
        hx += m * at[part, 0] + R[part, 0, 0] * mx + R[part, 0, 1] * my + R[part, 0, 2] * mz
        hy += m * at[part, 1] + R[part, 1, 0] * mx + R[part, 1, 1] * my + R[part, 1, 2] * mz
        hz += m * at[part, 2] + R[part, 2, 0] * mx + R[part, 2, 1] * my + R[part, 2, 2] * mz
        share += m
    x = body.rest[0] + share * T_site_hip[0, 3]
    y = body.rest[1] + share * T_site_hip[1, 3]
    x += T_site_hip[0, 0] * hx + T_site_hip[0, 1] * hy + T_site_hip[0, 2] * hz
    y += T_site_hip[1, 0] * hx + T_site_hip[1, 1] * hy + T_site_hip[1, 2] * hz
    least = np.inf
    for k in range(body.offsets.size):
        least = min(least, body.offsets[k] - body.normals[k, 0] * x - body.normals[k, 1] * y)
    return least


@njit(cache=True)
def is_sure(q: Array, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """Whether the leg is surely allowed at q (6,) [rad]; mode: see leg_clearance_kernel.py."""
    for k in range(6):
        if not body.lower[k] <= q[k] <= body.upper[k]:
            return False
    if not margin_at(q, clearance.T_site_hip, clearance.lengths, body) >= body.least + ROUNDING:
        return False
    return leg_is_clear(q, clearance, mode)


@njit(cache=True)
def first_unsure(qs: Array, clearance: LegTables, body: BodyTables, mode: int) -> int:
    """The first row of qs (n, 6) that is not sure, or SURE."""
    for i in range(qs.shape[0]):
        if not is_sure(qs[i], clearance, body, mode):
            return i
    return SURE


@njit(cache=True)
def halvings(a: Array, b: Array, epsilon: float) -> int:
    """How often the edge from a to b is halved until no piece changes a coordinate by more than ε."""
    longest = 0.0
    for k in range(a.size):
        longest = max(longest, abs(b[k] - a[k]))
    if not longest > epsilon:
        return 0
    return int(np.ceil(np.log2(longest / epsilon)))


@njit(cache=True)
def level_is_sure(a: Array, b: Array, level: int, q: Array, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """Whether the configurations that the ``level``-th halving adds between a and b are sure; q (6,): scratch."""
    pieces = 2**level
    for i in range(1, pieces, 2):
        for k in range(6):
            q[k] = a[k] + (i / pieces) * (b[k] - a[k])
        if not is_sure(q, clearance, body, mode):
            return False
    return True


@njit(cache=True)
def edge_is_sure(
    a: Array, b: Array, epsilon: float, clearance: LegTables, body: BodyTables, mode: int, q: Array
) -> bool:
    """Whether everything between a and b is sure at ε; the ends are not looked at."""
    for level in range(1, halvings(a, b, epsilon) + 1):  # noqa: SIM110 (numba has no all of a generator)
        if not level_is_sure(a, b, level, q, clearance, body, mode):
            return False
    return True


@njit(cache=True)
def clear_rows(qs: Array, clearance: LegTables, mode: int) -> NDArray[np.bool_]:
    """Which rows of qs (n, 6) are certified clear, whatever the limits and the balance; on one thread."""
    out = np.empty(qs.shape[0], np.bool_)
    for i in range(qs.shape[0]):
        out[i] = leg_is_clear(qs[i], clearance, mode)
    return out
