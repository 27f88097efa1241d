"""The compiled check of one leg at one set of joint angles. What it proves, and why, is told in clearance.py."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from footfall.robot.ground_tables import needed_height
from footfall.robot.leg_frames import PART_COUNT, leg_frames
from footfall.robot.separation import SCRATCH, apart
from footfall.robot.shells import CENTER, REACH

Array = NDArray[np.float64]

NO_GROUND, TRUE_GROUND, RAISED_GROUND = -1, 0, 1
"""Ground modes; the last two are rows of ``trees`` and ``lift``."""


class LegTables(NamedTuple):
    """One leg of a robot in one stance over one ground; positions in site [m]. Few arrays, as each costs time to pass.

    T_site_hip: (3, 4). lengths: see leg_frames.py. shells, points: see shells.py; the first seven are the leg's parts.
    own: (p, 3) two parts of the leg that are checked against each other, and how far they must be apart.
    frozen_poses: (f, 3, 4) of what does not move; frozen: (f, 5) middle and radius of a ball around each, number of
    its shell; required: (7, f) how far each part must be from it, negative where unchecked.
    groups: (g, 6) first and last + 1 of the frozen bodies of a group, middle and radius of a ball that the middle of a
    part without extent must stay out of.
    balls: (b, 5) middle in the part's frame, number of its table of the ground, next ball when clear. trees: (2, 7, 2)
    first ball of each part and the one after its last, by ground mode. lift: (2,) by which the ground is raised.
    ground, ground_layout: see ground_tables.py.
    """

    T_site_hip: Array
    lengths: Array
    shells: Array
    points: Array
    own: Array
    frozen_poses: Array
    frozen: Array
    required: Array
    groups: Array
    balls: Array
    trees: NDArray[np.int64]
    lift: Array
    ground: Array
    ground_layout: Array


@njit(cache=True)
def leg_is_clear(q: Array, tables: LegTables, mode: int) -> bool:
    """Whether the leg at joint angles q (6,) [rad] is proven to keep every distance that is required of it.

    mode: NO_GROUND, TRUE_GROUND or RAISED_GROUND. False means unsure; NaN and infinity are unsure.
    """
    for k in range(6):
        if not math.isfinite(q[k]):
            return False
    poses = np.empty((PART_COUNT, 3, 4))
    scratch = np.empty((SCRATCH, 3))
    _place(q, tables.T_site_hip, tables.lengths, poses)
    if mode != NO_GROUND and not _above_ground(
        poses, tables.balls, tables.trees, tables.lift[mode], tables.ground, tables.ground_layout, mode
    ):
        return False
    return _own_parts_apart(poses, tables.shells, tables.points, tables.own, scratch) and _clear_of_frozen(
        poses, tables.shells, tables.points, tables.frozen_poses, tables.frozen, tables.required, tables.groups, scratch
    )


@njit(cache=True, parallel=True)
def legs_are_clear(qs: Array, tables: LegTables, mode: int) -> NDArray[np.bool_]:
    """:func:`leg_is_clear` of every row of qs (n, 6)."""
    out = np.empty(qs.shape[0], np.bool_)
    for row in prange(qs.shape[0]):
        i = np.int64(row)
        out[i] = leg_is_clear(qs[i], tables, mode)
    return out


@njit(cache=True)
def _place(q: Array, T_site_hip: Array, lengths: Array, poses: Array) -> None:
    """Write the poses of the seven parts in site, (7, 3, 4)."""
    R, at = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    leg_frames(lengths, q, R, at)
    for part in range(PART_COUNT):
        for row in range(3):
            x, y, z = T_site_hip[row, 0], T_site_hip[row, 1], T_site_hip[row, 2]
            for k in range(3):
                poses[part, row, k] = x * R[part, 0, k] + y * R[part, 1, k] + z * R[part, 2, k]
            poses[part, row, 3] = T_site_hip[row, 3] + x * at[part, 0] + y * at[part, 1] + z * at[part, 2]


@njit(cache=True)
def _above_ground(
    poses: Array,
    balls: Array,
    trees: NDArray[np.int64],
    lift: float,
    ground: Array,
    ground_layout: Array,
    mode: int,
) -> bool:
    for part in range(PART_COUNT):
        ball, end = trees[mode, part, 0], trees[mode, part, 1]
        while ball < end:
            x = _coordinate(poses, part, balls, ball, 0, 0)
            y = _coordinate(poses, part, balls, ball, 0, 1)
            z = _coordinate(poses, part, balls, ball, 0, 2)
            following = int(balls[ball, 4])
            if z - lift >= needed_height(ground, ground_layout, int(balls[ball, 3]), x, y):
                ball = following
            elif following == ball + 1:
                return False
            else:
                ball += 1
    return True


@njit(cache=True)
def _own_parts_apart(poses: Array, shells: Array, points: Array, own: Array, scratch: Array) -> bool:
    for k in range(own.shape[0]):
        a, b = int(own[k, 0]), int(own[k, 1])
        if not apart(shells, points, a, poses, a, b, poses, b, own[k, 2], scratch):
            return False
    return True


@njit(cache=True)
def _clear_of_frozen(
    poses: Array,
    shells: Array,
    points: Array,
    frozen_poses: Array,
    frozen: Array,
    required: Array,
    groups: Array,
    scratch: Array,
) -> bool:
    for part in range(PART_COUNT):
        x = _coordinate(poses, part, shells, part, CENTER, 0)
        y = _coordinate(poses, part, shells, part, CENTER, 1)
        z = _coordinate(poses, part, shells, part, CENTER, 2)
        reach = shells[part, REACH]
        for group in range(groups.shape[0]):
            if not _within(x, y, z, groups, group, 2, reach):
                continue
            for body in range(int(groups[group, 0]), int(groups[group, 1])):
                least = required[part, body]
                if (
                    least >= 0.0
                    and _within(x, y, z, frozen, body, 0, reach + least)
                    and not apart(
                        shells, points, part, poses, part, int(frozen[body, 4]), frozen_poses, body, least, scratch
                    )
                ):
                    return False
    return True


@njit(cache=True, inline="always")
def _coordinate(poses: Array, part: int, table: Array, row: int, column: int, axis: int) -> float:
    """One site coordinate of the point at ``column`` of a row of a table, in the part's frame."""
    return (
        poses[part, axis, 0] * table[row, column]
        + poses[part, axis, 1] * table[row, column + 1]
        + poses[part, axis, 2] * table[row, column + 2]
        + poses[part, axis, 3]
    )


@njit(cache=True, inline="always")
def _within(x: float, y: float, z: float, table: Array, row: int, column: int, more: float) -> bool:
    """Whether a point is nearer than ``more`` to the ball at ``column`` of a row: middle and radius."""
    dx, dy, dz = x - table[row, column], y - table[row, column + 1], z - table[row, column + 2]
    far = table[row, column + 3] + more
    return dx * dx + dy * dy + dz * dz < far * far
