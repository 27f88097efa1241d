"""The compiled check of one leg at one set of joint angles. What it proves, and why, is told in clearance.py."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import JOINT_AXES, PART_COUNT, leg_frames
from footfall.robot.proof.drum_kernel import MOST, RADIUS, REQUIRED, drum_above
from footfall.robot.proof.ground_tables import needed_height
from footfall.robot.proof.separation import SCRATCH, apart
from footfall.robot.proof.shells import CENTER, REACH

NO_GROUND, TRUE_GROUND, RAISED_GROUND = -1, 0, 1
"""Ground modes; the last two are rows of ``trees`` and ``lift``."""


_LONGEST = 16
"""Most samples of a path in a piece that is looked at as a whole."""

_PAUSE = 8
"""Samples looked at one by one when the shortest piece was not clear as a whole for the first time."""


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
    drums: (2, 7) the wheel by ground mode, see drum_kernel.py. ground, ground_layout: see ground_tables.py.
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
    drums: Array
    reach: Array
    radii: Array
    ground: Array
    ground_layout: Array


@njit()
def leg_is_clear(q: Array, tables: LegTables, mode: int) -> bool:
    """Whether the leg at joint angles q (6,) [rad] is proven to keep every distance that is required of it.

    mode: NO_GROUND, TRUE_GROUND or RAISED_GROUND. False means unsure; NaN and infinity are unsure.
    """
    poses = np.empty((PART_COUNT, 3, 4))
    place_leg(q, tables.T_site_hip, tables.lengths, poses)
    return keeps_distances(q, poses, np.zeros((PART_COUNT, 7)), tables, mode)


@njit()
def leg_stays_clear(q: Array, turns: Array, tables: LegTables, mode: int) -> bool:
    """Whether :func:`leg_is_clear` holds at all angles that differ from q (6,) by at most ``turns`` (6,) ≥ 0 [rad].

    Every distance is required with what the parts can move more; see clearance.py.
    """
    poses, moved = np.empty((PART_COUNT, 3, 4)), np.empty((PART_COUNT, 7))
    place_leg(q, tables.T_site_hip, tables.lengths, poses)
    _motion(turns, poses, tables.shells, tables.reach, moved)
    return keeps_distances(q, poses, moved, tables, mode)


@njit()
def path_is_clear(qs: Array, tables: LegTables, mode: int) -> NDArray[np.bool_]:
    """Which samples of a path, qs (n, 6), are proven to be clear, (n,); straight lines join them.

    After F. Schwarzer, M. Saha, J.-C. Latombe, "Adaptive dynamic collision checking for single and multiple robots in
    complex environments", IEEE Trans. Robotics 21 (2005), §III: a piece is clear as a whole where its middle keeps more
    distance than anything moves on it; what lies between its samples is proven then, too. Where it does not, a piece
    half as long is tried, and in the end single samples, the more the oftener that happens; after a success, a piece
    twice as long.
    """
    n = qs.shape[0]
    out, turns = np.zeros(n, np.bool_), np.empty(6)
    first, size, alone, pause = 0, 2, 0, _PAUSE
    while first < n:
        last = min(first + size, n - 1)
        if last - first <= 1 or alone > 0:
            out[first] = out[first] or leg_is_clear(qs[first], tables, mode)
            first, alone, size = first + 1, alone - 1, 2
            continue
        middle = (first + last) // 2
        turns[:] = 0.0
        for i in range(first, last + 1):
            for k in range(6):
                turns[k] = max(turns[k], abs(qs[i, k] - qs[middle, k]))
        if leg_stays_clear(qs[middle], turns, tables, mode):
            out[first : last + 1] = True
            first, size, pause = (last if last < n - 1 else n), min(2 * size, _LONGEST), _PAUSE
        elif size > 2:
            size //= 2
        else:
            alone, pause = pause, 2 * pause
    return out


@njit()
def _motion(turns: Array, poses: Array, shells: Array, reach: Array, moved: Array) -> None:
    """Write how far any point of each part can move by the joints from the k-th on, (7, 7) [m].

    A joint moves a point by at most its turn times the point's distance from the axis: that distance is at most what
    it is now for the part's middle, plus the part's reach, plus what the joints beyond can move the point.
    """
    for part in range(PART_COUNT):
        at, total = np.empty(3), 0.0
        for row in range(3):
            at[row] = coordinate(poses, part, shells, part, CENTER, row)
        moved[part] = 0.0
        for joint in range(min(part, 5), -1, -1):
            axis = JOINT_AXES[joint]
            ax, ay, az = poses[joint, 0, axis], poses[joint, 1, axis], poses[joint, 2, axis]
            x, y, z = at[0] - poses[joint, 0, 3], at[1] - poses[joint, 1, 3], at[2] - poses[joint, 2, 3]
            away = math.sqrt((ay * z - az * y) ** 2 + (az * x - ax * z) ** 2 + (ax * y - ay * x) ** 2)
            total += turns[joint] * (away + reach[part] + total)
            moved[part, joint] = total


@njit()
def keeps_distances(q: Array, poses: Array, moved: Array, tables: LegTables, mode: int) -> bool:
    """Whether every distance is kept with ``moved`` more: of each part by the joints from the k-th on, (7, 7) [m]."""
    for k in range(6):
        if not math.isfinite(q[k]):
            return False
    scratch = np.empty((SCRATCH, 3))
    if mode != NO_GROUND and not _above_ground(
        poses,
        moved,
        tables.balls,
        tables.trees,
        tables.lift[mode],
        tables.drums,
        tables.radii,
        tables.ground,
        tables.ground_layout,
        mode,
    ):
        return False
    return _own_parts_apart(poses, moved, tables.shells, tables.points, tables.own, scratch) and _clear_of_frozen(
        poses,
        moved,
        tables.shells,
        tables.points,
        tables.frozen_poses,
        tables.frozen,
        tables.required,
        tables.groups,
        scratch,
    )


@njit(parallel=True)
def legs_are_clear(qs: Array, tables: LegTables, mode: int) -> NDArray[np.bool_]:
    """:func:`leg_is_clear` of every row of qs (n, 6)."""
    out = np.empty(qs.shape[0], np.bool_)
    for row in prange(qs.shape[0]):
        i = np.int64(row)
        out[i] = leg_is_clear(qs[i], tables, mode)
    return out


@njit()
def place_leg(q: Array, T_site_hip: Array, lengths: Array, poses: Array) -> None:
    """Write the poses of the seven parts in site, (7, 3, 4)."""
    R, at = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    leg_frames(lengths, q, R, at)
    for part in range(PART_COUNT):
        for row in range(3):
            x, y, z = T_site_hip[row, 0], T_site_hip[row, 1], T_site_hip[row, 2]
            for k in range(3):
                poses[part, row, k] = x * R[part, 0, k] + y * R[part, 1, k] + z * R[part, 2, k]
            poses[part, row, 3] = T_site_hip[row, 3] + x * at[part, 0] + y * at[part, 1] + z * at[part, 2]


@njit()
def _above_ground(
    poses: Array,
    moved: Array,
    balls: Array,
    trees: NDArray[np.int64],
    lift: float,
    drums: Array,
    radii: Array,
    ground: Array,
    ground_layout: Array,
    mode: int,
) -> bool:
    # the wheel first: it is what the ground is nearest to
    for part in range(PART_COUNT - 1, -1, -1):
        ball, end = trees[mode, part, 0], trees[mode, part, 1]
        while ball < end:
            x = coordinate(poses, part, balls, ball, 0, 0)
            y = coordinate(poses, part, balls, ball, 0, 1)
            z = coordinate(poses, part, balls, ball, 0, 2)
            following, table = int(balls[ball, 4]), int(balls[ball, 3])
            spare = 0.0
            if moved[part, 0] > 0.0:
                # the table of the next larger balls that hold all places of this one
                needed = radii[table] + moved[part, 0]
                while table < radii.size and radii[table] < needed:
                    table += 1
                if table < radii.size:
                    # by how much such a ball is larger than need be, it may be lower: see clearance.py
                    spare = radii[table] - needed
            if table < radii.size and z - lift + spare >= needed_height(ground, ground_layout, table, x, y):
                ball = following
            elif following == ball + 1:
                least = drums[mode, REQUIRED] + moved[part, 0]
                if (
                    part < PART_COUNT - 1
                    or not drums[mode, RADIUS] > 0.0
                    or not moved[part, 0] <= drums[mode, MOST]
                    or drum_above(poses, part, drums, mode, least, least, lift, ground, ground_layout) < least
                ):
                    return False
                ball = end
            else:
                ball += 1
    return True


@njit()
def _own_parts_apart(poses: Array, moved: Array, shells: Array, points: Array, own: Array, scratch: Array) -> bool:
    for k in range(own.shape[0]):
        a, b = int(own[k, 0]), int(own[k, 1])
        # seen from the part nearer to the hip only the joints beyond it move the other
        more = moved[max(a, b), min(a, b) + 1]
        if not apart(shells, points, a, poses, a, b, poses, b, own[k, 2] + more, scratch):
            return False
    return True


@njit()
def _clear_of_frozen(
    poses: Array,
    moved: Array,
    shells: Array,
    points: Array,
    frozen_poses: Array,
    frozen: Array,
    required: Array,
    groups: Array,
    scratch: Array,
) -> bool:
    for part in range(PART_COUNT):
        x = coordinate(poses, part, shells, part, CENTER, 0)
        y = coordinate(poses, part, shells, part, CENTER, 1)
        z = coordinate(poses, part, shells, part, CENTER, 2)
        more = moved[part, 0]
        reach = shells[part, REACH] + more
        for group in range(groups.shape[0]):
            if not within(x, y, z, groups, group, 2, reach):
                continue
            for body in range(int(groups[group, 0]), int(groups[group, 1])):
                least = required[part, body] + more
                if (
                    required[part, body] >= 0.0
                    and within(x, y, z, frozen, body, 0, shells[part, REACH] + least)
                    and not apart(
                        shells, points, part, poses, part, int(frozen[body, 4]), frozen_poses, body, least, scratch
                    )
                ):
                    return False
    return True


@njit(inline="always")
def coordinate(poses: Array, part: int, table: Array, row: int, column: int, axis: int) -> float:
    """One site coordinate of the point at ``column`` of a row of a table, in the part's frame."""
    return (
        poses[part, axis, 0] * table[row, column]
        + poses[part, axis, 1] * table[row, column + 1]
        + poses[part, axis, 2] * table[row, column + 2]
        + poses[part, axis, 3]
    )


@njit(inline="always")
def within(x: float, y: float, z: float, table: Array, row: int, column: int, more: float) -> bool:
    """Whether a point is nearer than ``more`` to the ball at ``column`` of a row: middle and radius."""
    dx, dy, dz = x - table[row, column], y - table[row, column + 1], z - table[row, column + 2]
    far = table[row, column + 3] + more
    return dx * dx + dy * dy + dz * dz < far * far
