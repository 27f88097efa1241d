"""How far a leg may move along a straight line in joint space and stay clear: compiled. The proof is in clearance.py.

After F. Schwarzer, M. Saha, J.-C. Latombe, "Adaptive dynamic collision checking for single and multiple robots in
complex environments", IEEE Trans. Robotics 21 (2005): one look at a posture says for how much of a line through it
everything keeps more distance than it moves. A line is q + s d; on it no point of a part moves more than v s + b s²,
with v its greatest speed at q and b half of the greatest second derivative anywhere.
"""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import FOOT, HIP_X, HIP_Z, JOINT_AXES, PART_COUNT, SHANK, THIGH
from footfall.robot.proof.drum_kernel import MOST, NONE, RADIUS, REQUIRED, drum_above
from footfall.robot.proof.ground_tables import needed_height
from footfall.robot.proof.leg_clearance_kernel import LegTables, coordinate, within
from footfall.robot.proof.separation import SCRATCH, apart_by
from footfall.robot.proof.shells import CENTER, REACH

UNSURE = -1.0
"""Answer where not even the posture itself is proven to be clear."""

ENOUGH = 0.6
"""Where a ball around some others allows this share of a span, those others are not looked at for more."""

WORK = PART_COUNT + 6 * PART_COUNT + 3 * SCRATCH
"""Numbers that the spans need to work in."""


@njit()
def span_to_others(
    poses: Array, d: Array, bends: Array, most: float, tables: LegTables, mode: int, work: Array
) -> float:
    """A half length h ≤ ``most`` over which the leg is proven clear of the ground and of all that does not move.

    That is at q + s d for every s from −h to h; UNSURE where nothing is proven.

    poses: (7, 3, 4) of the parts in site at finite angles q, see place_leg. d: (6,) [rad]. bends: of
    :func:`line_bends`. mode: see leg_is_clear. work: memory to work in, WORK numbers.
    """
    speeds, twists, scratch = work[:7], work[7:49].reshape(7, 6), work[49:].reshape(SCRATCH, 3)
    shells, reach = tables.shells, tables.reach
    _twists(d, poses, twists)
    for part in range(PART_COUNT):
        speeds[part] = _speed(twists, poses, shells, reach, part, -1)
    h = most
    if mode >= 0:
        h = _span_over_ground(poses, speeds, bends, h, tables, mode, PART_COUNT)
        if h < 0.0:
            # a ball may be clear where a smaller one of its part is not, but is only asked for what it can promise
            h = _span_over_ground(poses, speeds, bends, 0.0, tables, mode, PART_COUNT)
            if tables.drums[mode, RADIUS] > 0.0:
                h = max(h, _span_of_drum(poses, speeds, bends, most, tables, mode))
    if h >= 0.0:
        h = _span_beside_frozen(poses, speeds, bends, h, tables, scratch)
    return h


@njit()
def span_of_own_parts(
    poses: Array, d: Array, bends: Array, rates: Array, most: float, tables: LegTables, work: Array
) -> float:
    """As :func:`span_to_others`, of the leg's own parts; it is mostly long, so it may be asked for less often.

    rates: of :func:`line_bends`.
    """
    twists, scratch = work[7:49].reshape(7, 6), work[49:].reshape(SCRATCH, 3)
    _twists(d, poses, twists)
    return _span_of_own_parts(poses, twists, bends, rates, most, tables, scratch)


@njit()
def line_bends(d: Array, tables: LegTables) -> tuple[Array, Array]:
    """Bounds of the module's b for each part moved by the joints from the k-th on, and its most speed, (7, 7) each."""
    bends, rates = np.zeros((PART_COUNT, 7)), np.zeros((PART_COUNT, 7))
    shells, reach, lengths = tables.shells, tables.reach, tables.lengths
    for part in range(PART_COUNT):
        far = reach[part] + math.sqrt(
            shells[part, CENTER] ** 2 + shells[part, CENTER + 1] ** 2 + shells[part, CENTER + 2] ** 2
        )
        for first in range(6):
            bends[part, first], rates[part, first] = most_bend(d, lengths, part, first, far)
    return bends, rates


@njit()
def reached(v: float, b: float, room: float, h: float) -> float:
    """The largest part of h ≥ 0 over which v s + b s² takes no more than ``room`` ≥ 0."""
    if v * h + b * h * h <= room:
        return h
    if room <= 0.0:
        return 0.0
    return 2.0 * room / (v + math.sqrt(v * v + 4.0 * b * room))


@njit()
def _twists(d: Array, poses: Array, twists: Array) -> None:
    """Write how the parts turn and how their origins move per s, (7, 6)."""
    for part in range(PART_COUNT):
        own, last = twists[part], twists[max(part - 1, 0)]
        if part == 0:
            own[:] = 0.0
        else:
            rx, ry, rz = (
                poses[part, 0, 3] - poses[part - 1, 0, 3],
                poses[part, 1, 3] - poses[part - 1, 1, 3],
                poses[part, 2, 3] - poses[part - 1, 2, 3],
            )
            own[0], own[1], own[2] = last[0], last[1], last[2]
            own[3] = last[3] + last[1] * rz - last[2] * ry
            own[4] = last[4] + last[2] * rx - last[0] * rz
            own[5] = last[5] + last[0] * ry - last[1] * rx
        if part < 6:
            axis = JOINT_AXES[part]
            for row in range(3):
                own[row] += d[part] * poses[part, row, axis]


@njit()
def _speed(twists: Array, poses: Array, shells: Array, reach: Array, part: int, seen_from: int) -> float:
    """Speed v of a part as seen from a part nearer to the hip, or from the hip (−1); see the module."""
    x = coordinate(poses, part, shells, part, CENTER, 0)
    y = coordinate(poses, part, shells, part, CENTER, 1)
    z = coordinate(poses, part, shells, part, CENTER, 2)
    wx, wy, wz = twists[part, 0], twists[part, 1], twists[part, 2]
    rx, ry, rz = x - poses[part, 0, 3], y - poses[part, 1, 3], z - poses[part, 2, 3]
    vx = twists[part, 3] + wy * rz - wz * ry
    vy = twists[part, 4] + wz * rx - wx * rz
    vz = twists[part, 5] + wx * ry - wy * rx
    if seen_from >= 0:
        ax, ay, az = twists[seen_from, 0], twists[seen_from, 1], twists[seen_from, 2]
        rx, ry, rz = x - poses[seen_from, 0, 3], y - poses[seen_from, 1, 3], z - poses[seen_from, 2, 3]
        vx -= twists[seen_from, 3] + ay * rz - az * ry
        vy -= twists[seen_from, 4] + az * rx - ax * rz
        vz -= twists[seen_from, 5] + ax * ry - ay * rx
        wx, wy, wz = wx - ax, wy - ay, wz - az
    return math.sqrt(vx * vx + vy * vy + vz * vz) + reach[part] * math.sqrt(wx * wx + wy * wy + wz * wz)


@njit()
def most_bend(d: Array, lengths: Array, part: int, first: int, far: float) -> tuple[float, float]:
    """Bound b of a point that is ``far`` from its part's origin at most, moved by the joints from ``first`` on.

    And the most speed that it ever has.

    Its second derivative is the sum of dᵢ dⱼ aₖ × (aₘ × (x − oₘ)) over all i, j, with k the smaller and m the larger of
    them, a the joints' axes and o their origins; |x − oₘ| is at most what the links from there on measure.
    """
    if part == PART_COUNT - 1:
        far += lengths[FOOT]
    outer = whole = 0.0
    for joint in range(min(part, 5), first - 1, -1):
        turn = abs(d[joint])
        whole += turn * (2.0 * outer + turn * far)
        outer += turn * far
        if joint == 4:
            far += lengths[SHANK]
        elif joint == 2:
            far += lengths[THIGH]
        elif joint == 1:
            far += math.sqrt(lengths[HIP_X] ** 2 + lengths[HIP_Z] ** 2)
    return 0.5 * whole, outer


@njit()
def _span_of_drum(poses: Array, speeds: Array, bends: Array, h: float, tables: LegTables, mode: int) -> float:
    """As :func:`_span_over_ground` with the wheel as a drum."""
    part, drums = PART_COUNT - 1, tables.drums
    v, b, required = speeds[part], bends[part, 0], drums[mode, REQUIRED]
    enough = required + min(v * h + b * h * h, drums[mode, MOST])
    bound = drum_above(
        poses, part, drums, mode, required, enough, tables.lift[mode], tables.ground, tables.ground_layout
    )
    if bound == NONE:
        return UNSURE
    h = reached(v, b, bound - required, h)
    rest = _span_over_ground(poses, speeds, bends, h, tables, mode, part)
    return rest if rest >= 0.0 else _span_over_ground(poses, speeds, bends, 0.0, tables, mode, part)


@njit()
def _span_over_ground(
    poses: Array, speeds: Array, bends: Array, h: float, tables: LegTables, mode: int, parts: int
) -> float:
    """Of so many parts from the hip outward."""
    # taken out of their tuple once: each time, a table is counted as used and unused again, which took half of the time
    balls, trees, radii, lift = tables.balls, tables.trees, tables.radii, tables.lift[mode]
    ground, ground_layout = tables.ground, tables.ground_layout
    # the wheel first: it is what the ground is nearest to
    for part in range(parts - 1, -1, -1):
        ball, end = trees[mode, part, 0], trees[mode, part, 1]
        v, b = speeds[part], bends[part, 0]
        while ball < end:
            x = coordinate(poses, part, balls, ball, 0, 0)
            y = coordinate(poses, part, balls, ball, 0, 1)
            z = coordinate(poses, part, balls, ball, 0, 2) - lift
            following, own = int(balls[ball, 4]), int(balls[ball, 3])
            # the table of the next larger balls that hold all places of this one
            needed = radii[own] + (v * h + b * h * h)
            table = own
            while table < radii.size - 1 and radii[table] < needed:
                table += 1
            room = radii[table] - radii[own]
            top = needed_height(ground, ground_layout, table, x, y)
            # a larger ball that is too low by so much is clear where its radius is less by that: see clearance.py
            room -= max(top - z, 0.0)
            if following == ball + 1:
                while table > own and radii[table - 1] - radii[own] > room:
                    table -= 1
                    top = needed_height(ground, ground_layout, table, x, y)
                    room = max(room, radii[table] - radii[own] - max(top - z, 0.0))
                if room < 0.0:
                    return UNSURE
                h = reached(v, b, room, h)
                ball = following
                continue
            shorter = reached(v, b, room, h) if room >= 0.0 else UNSURE
            if shorter >= ENOUGH * h:
                h, ball = shorter, following
            else:
                ball += 1
    return h


@njit()
def _span_of_own_parts(
    poses: Array, twists: Array, bends: Array, rates: Array, h: float, tables: LegTables, scratch: Array
) -> float:
    shells, points, own, reach = tables.shells, tables.points, tables.own, tables.reach
    for k in range(own.shape[0]):
        a, b, required = int(own[k, 0]), int(own[k, 1]), own[k, 2]
        # seen from the part nearer to the hip only the joints beyond it move the other
        near, far = min(a, b), max(a, b)
        bound = apart_by(
            shells, points, a, poses, a, b, poses, b, required, required + rates[far, near + 1] * h, scratch
        )
        if bound < required:
            return UNSURE
        if bound - required < rates[far, near + 1] * h:
            v = _speed(twists, poses, shells, reach, far, near)
            h = max(reached(v, bends[far, near + 1], bound - required, h), (bound - required) / rates[far, near + 1])
    return h


@njit()
def _span_beside_frozen(
    poses: Array, speeds: Array, bends: Array, h: float, tables: LegTables, scratch: Array
) -> float:
    shells, points, groups = tables.shells, tables.points, tables.groups
    frozen, frozen_poses, all_required = tables.frozen, tables.frozen_poses, tables.required
    for part in range(PART_COUNT - 1, -1, -1):
        x = coordinate(poses, part, shells, part, CENTER, 0)
        y = coordinate(poses, part, shells, part, CENTER, 1)
        z = coordinate(poses, part, shells, part, CENTER, 2)
        v, b = speeds[part], bends[part, 0]
        for group in range(groups.shape[0]):
            if not within(x, y, z, groups, group, 2, shells[part, REACH] + v * h + b * h * h):
                continue
            for body in range(int(groups[group, 0]), int(groups[group, 1])):
                required = all_required[part, body]
                if required < 0.0:
                    continue
                enough = required + v * h + b * h * h
                if not within(x, y, z, frozen, body, 0, shells[part, REACH] + enough):
                    continue
                bound = apart_by(
                    shells,
                    points,
                    part,
                    poses,
                    part,
                    int(frozen[body, 4]),
                    frozen_poses,
                    body,
                    required,
                    enough,
                    scratch,
                )
                if bound < required:
                    return UNSURE
                h = reached(v, b, bound - required, h)
    return h
