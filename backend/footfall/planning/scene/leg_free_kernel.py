"""Whether single postures of the moving leg, and edges between them, are surely allowed: compiled.

Sure means: inside the limits, certified clear (proof/clearance.py proves what that says), and balanced with more to
spare than rounding takes. What is not sure is left to the exact checks of situation.py.
"""

from typing import NamedTuple

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import PART_COUNT
from footfall.robot.proof.leg_clearance_kernel import LegTables, keeps_distances, place_leg
from footfall.robot.proof.leg_span_kernel import (
    UNSURE,
    WORK,
    line_bends,
    most_bend,
    reached,
    span_of_own_parts,
    span_to_others,
)

ROUNDING = 1e-6
"""What the margin must have to spare to be sure [m]; above what two ways to compute it differ by in map
coordinates of millions of metres."""

SURE = -1
"""Answer of the kernels where nothing is unsure."""

SPAN = 0.15
"""Most of an edge that is asked for on each side of one look [rad]: more is seldom granted, and asking costs."""

OWN_SPAN = 0.5
"""The same of what is mostly far from failing: the leg's own parts, and the balance [rad]."""


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


@njit()
def margin_at(poses: Array, body: BodyTables) -> float:
    """Margin of the centre of mass to the nearest half-plane [m]; −inf where there is none.

    poses: (7, 3, 4) of the leg's parts in site.
    """
    if body.offsets.size == 0:
        return -np.inf
    x, y = body.rest[0], body.rest[1]
    for part in range(PART_COUNT):
        mx, my, mz, m = body.moments[part, 0], body.moments[part, 1], body.moments[part, 2], body.moments[part, 3]
        x += poses[part, 0, 0] * mx + poses[part, 0, 1] * my + poses[part, 0, 2] * mz + poses[part, 0, 3] * m
        y += poses[part, 1, 0] * mx + poses[part, 1, 1] * my + poses[part, 1, 2] * mz + poses[part, 1, 3] * m
    least = np.inf
    for k in range(body.offsets.size):
        least = min(least, body.offsets[k] - body.normals[k, 0] * x - body.normals[k, 1] * y)
    return least


@njit()
def is_sure(q: Array, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """Whether the leg is surely allowed at q (6,) [rad]; mode: see leg_clearance_kernel.py."""
    for k in range(6):
        if not body.lower[k] <= q[k] <= body.upper[k]:
            return False
    poses = np.empty((PART_COUNT, 3, 4))
    place_leg(q, clearance.T_site_hip, clearance.lengths, poses)
    return margin_at(poses, body) >= body.least + ROUNDING and keeps_distances(
        q, poses, np.zeros((PART_COUNT, 7)), clearance, mode
    )


@njit()
def first_unsure(qs: Array, clearance: LegTables, body: BodyTables, mode: int) -> int:
    """The first row of qs (n, 6) that is not sure, or SURE."""
    for i in range(qs.shape[0]):
        if not is_sure(qs[i], clearance, body, mode):
            return i
    return SURE


@njit()
def halvings(a: Array, b: Array, epsilon: float) -> int:
    """How often the edge from a to b is halved until no piece changes a coordinate by more than ε."""
    longest = 0.0
    for k in range(a.size):
        longest = max(longest, abs(b[k] - a[k]))
    if not longest > epsilon:
        return 0
    return int(np.ceil(np.log2(longest / epsilon)))


@njit()
def level_is_sure(a: Array, b: Array, level: int, q: Array, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """Whether the configurations that the ``level``-th halving adds between a and b are sure; q (6,): scratch."""
    pieces = 2**level
    for i in range(1, pieces, 2):
        for k in range(6):
            q[k] = a[k] + (i / pieces) * (b[k] - a[k])
        if not is_sure(q, clearance, body, mode):
            return False
    return True


@njit()
def edge_is_sure(a: Array, b: Array, epsilon: float, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """Whether everything between a and b, both sure, is sure at ε.

    First the leg's distances to all else, then those of its own parts and the balance, which seldom need many looks.
    For each, no posture between is farther than ε from the next that was looked at, or it is proven itself: each look
    tells for how much of the edge around it (proof/leg_span_kernel.py), and what is left on both sides is halved in
    turn.
    """
    levels = halvings(a, b, epsilon)
    if levels == 0:
        return True
    # what is put in is at most half as long as what it came from, and more than ε
    left = np.empty((2**levels, 2))
    d, q, longest = b - a, np.empty(6), 0.0
    poses, work = np.empty((PART_COUNT, 3, 4)), np.empty(WORK)
    for k in range(6):
        longest = max(longest, abs(d[k]))
    shortest = epsilon / longest
    bend = balance_bend(d, clearance.lengths, body)
    bends, rates = line_bends(d, clearance)
    for own in (False, True):
        most = (OWN_SPAN if own else SPAN) / longest
        left[0, 0], left[0, 1] = 0.0, 1.0
        count, at = 1, 0
        while at < count:
            low, high = left[at, 0], left[at, 1]
            middle, at = 0.5 * (low + high), at + 1
            for k in range(6):
                q[k] = a[k] + middle * d[k]
            place_leg(q, clearance.T_site_hip, clearance.lengths, poses)
            half = min(0.5 * (high - low), most)
            if own:
                half = balanced_span(poses, d, bend, half, body)
                if half >= 0.0:
                    half = span_of_own_parts(poses, d, bends, rates, half, clearance, work)
            else:
                half = span_to_others(poses, d, bends, half, clearance, mode, work)
            if half < 0.0:
                return False
            if middle - half - low > shortest:
                left[count, 0], left[count, 1] = low, middle - half
                count += 1
            if high - middle - half > shortest:
                left[count, 0], left[count, 1] = middle + half, high
                count += 1
    return True


@njit()
def edges_are_sure(path: Array, epsilon: float, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """:func:`edge_is_sure` of every edge between waypoints (n, 6)."""
    sure = True
    for i in range(path.shape[0] - 1):
        sure = sure and edge_is_sure(path[i], path[i + 1], epsilon, clearance, body, mode)
    return sure


@njit()
def balanced_span(poses: Array, d: Array, bend: float, most: float, body: BodyTables) -> float:
    """A half length h ≤ ``most`` with the rover surely balanced at q + s d for every s from −h to h, or UNSURE."""
    if body.offsets.size == 0:
        return UNSURE
    x, y, vx, vy = body.rest[0], body.rest[1], 0.0, 0.0
    hx = hy = hz = share = 0.0
    for part in range(PART_COUNT - 1, -1, -1):
        mx, my, mz, m = body.moments[part, 0], body.moments[part, 1], body.moments[part, 2], body.moments[part, 3]
        hx += poses[part, 0, 0] * mx + poses[part, 0, 1] * my + poses[part, 0, 2] * mz + poses[part, 0, 3] * m
        hy += poses[part, 1, 0] * mx + poses[part, 1, 1] * my + poses[part, 1, 2] * mz + poses[part, 1, 3] * m
        hz += poses[part, 2, 0] * mx + poses[part, 2, 1] * my + poses[part, 2, 2] * mz + poses[part, 2, 3] * m
        share += m
        if part < 6:
            # the joint turns all that hangs on it
            axis = 2 if part == 0 else (0 if part == 3 or part == 5 else 1)
            ax, ay, az = poses[part, 0, axis], poses[part, 1, axis], poses[part, 2, axis]
            rx, ry, rz = hx - share * poses[part, 0, 3], hy - share * poses[part, 1, 3], hz - share * poses[part, 2, 3]
            vx += d[part] * (ay * rz - az * ry)
            vy += d[part] * (az * rx - ax * rz)
    x, y, h = x + hx, y + hy, most
    for k in range(body.offsets.size):
        spare = body.offsets[k] - body.normals[k, 0] * x - body.normals[k, 1] * y - (body.least + ROUNDING)
        if not spare >= 0.0:
            return UNSURE
        h = reached(abs(body.normals[k, 0] * vx + body.normals[k, 1] * vy), bend, spare, h)
    return h


@njit()
def balance_bend(d: Array, lengths: Array, body: BodyTables) -> float:
    """Bound b of the centre of mass along a line; see leg_span_kernel.py."""
    bend = 0.0
    for part in range(PART_COUNT):
        mx, my, mz, m = body.moments[part, 0], body.moments[part, 1], body.moments[part, 2], body.moments[part, 3]
        if m > 0.0:
            bend += m * most_bend(d, lengths, part, 0, np.sqrt(mx * mx + my * my + mz * mz) / m)[0]
    return bend
