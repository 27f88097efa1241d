"""The closed-form inverse kinematics of one leg, compiled; see :mod:`footfall.robot.ik` for branches and names.

Where the wheel is and which way its x (from the ankle to the wheel's centre) points decides the first five joints;
the last one only turns the wheel about that x. So one function finds the five, and both questions end there:
:func:`solve_poses` adds the last joint that gives the wheel its asked orientation, :func:`solve_upright` leaves
the heading free and takes any last joint inside its limits.

All poses are in the leg's hip frame. lengths: of :func:`footfall.robot.leg_frames.leg_lengths`.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numba.extending import register_jitable
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_branches import BRANCHES, bend_of, branch_number, elbow_of, shoulder_of, wrist_of
from footfall.robot.leg_frames import FOOT, HIP_X, HIP_Z, PART_COUNT, SHANK, THIGH, leg_frames, manipulability

ALL = -1
"""In place of a branch: every one."""
SINGULAR = 1e-12
"""Sine of the ankle pitch below which the wrist is straight: knee and ankle roll turn about one axis."""
STRAIGHT = 1e-9
"""The same for a wheel whose heading is free: any knee roll then leans it by no more than this [rad]."""
LIMIT_SLACK = 1e-9  # rad: a joint exactly at its limit survives the rounding of its solution
NO_JOINT = 255

for _function in (branch_number, bend_of, shoulder_of, elbow_of, wrist_of):
    register_jitable(inline="always")(_function)


@njit()
def into_limits(angle: float, lower: float, upper: float) -> tuple[float, float]:
    """The angle turned by 2π into its limits where that is possible, else in (−π, π]; and how far outside it is."""
    angle -= 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))
    least, best = np.inf, angle
    # limits such as −110…180° hold the value or its turn by 2π, whichever lies inside
    for turned in (angle, angle + 2 * math.pi, angle - 2 * math.pi):
        outside = max(lower - turned, turned - upper)
        if outside <= LIMIT_SLACK:
            return min(max(turned, lower), upper), 0.0
        if outside < least:
            least = outside
    return best, least


@njit(inline="always")
def _of_two(branch: int, one: int) -> tuple[int, int]:
    """First and last + 1 of two configurations: only ``one`` for a branch, both for ALL."""
    return (0, 2) if branch < 0 else (one, one + 1)


@njit(inline="always")
def _in_knee(c0: float, s0: float, c: float, s: float, v: Array) -> tuple[float, float, float]:
    """A direction in the frame of the bent knee, R_hip_kneeᵀ v: by the hip's yaw (c0, s0) and the pitches (c, s)."""
    forward = c0 * v[0] + s0 * v[1]
    return c * forward - s * v[2], c0 * v[1] - s0 * v[0], s * forward + c * v[2]


@njit()
def five_joints(lengths: Array, ankle: Array, x: Array, only: int, angles: Array) -> None:
    """Write the first five joints of all branches (8, 5) [rad], NaN where a branch has none, not yet inside limits.

    ankle, x: (3,) ankle centre [m] and unit direction from there to the wheel's centre. The knee roll of a straight
    wrist is 0 in wrist 0 and π in wrist 1; any other would do with another last joint. only: the branch whose joints
    are asked for, and other rows are left as they are where it has some; or ALL.
    """
    yaw = math.atan2(ankle[1], ankle[0])
    away = math.hypot(ankle[0], ankle[1])
    down = lengths[HIP_Z] - ankle[2]
    l1, l2 = lengths[THIGH], lengths[SHANK]
    shoulders, elbows = _of_two(only, shoulder_of(only)), _of_two(only, elbow_of(only))
    wrists = _of_two(only, wrist_of(only))
    for shoulder in range(shoulders[0], shoulders[1]):
        q0 = yaw + math.pi * shoulder
        out = (away if shoulder == 0 else -away) - lengths[HIP_X]
        cos_knee = (out * out + down * down - l1 * l1 - l2 * l2) / (2 * l1 * l2)
        # a pose at full stretch may overshoot by rounding; NaN is no solution either
        if not abs(cos_knee) < 1 + 1e-12:
            angles[4 * shoulder : 4 * shoulder + 4] = np.nan
            continue
        bend = math.acos(min(max(cos_knee, -1.0), 1.0))
        c0, s0 = math.cos(q0), math.sin(q0)
        for elbow in range(elbows[0], elbows[1]):
            q2 = bend if elbow == 0 else -bend
            q1 = math.atan2(down, out) - math.atan2(l2 * math.sin(q2), l1 + l2 * math.cos(q2))
            c, s = math.cos(q1 + q2), math.sin(q1 + q2)
            along, left, up = _in_knee(c0, s0, c, s, x)
            sin_pitch = math.hypot(left, up)
            pitch = math.atan2(sin_pitch, along)
            roll = 0.0
            if sin_pitch > SINGULAR:
                roll = math.atan2(left, -up)
            for wrist in range(wrists[0], wrists[1]):
                row = angles[branch_number(2 * shoulder + elbow, wrist)]
                row[0], row[1], row[2] = q0, q1, q2
                row[3] = roll + math.pi * wrist
                row[4] = -pitch if wrist else pitch
                if math.isnan(row[0] + row[1] + row[3] + row[4]):
                    row[:] = np.nan


@njit()
def last_joint(angles: Array, axle: Array) -> float:
    """Ankle roll [rad] that turns the wheel's y to ``axle`` (3,), after five joints (5,)."""
    c0, s0 = math.cos(angles[0]), math.sin(angles[0])
    c, s = math.cos(angles[1] + angles[2]), math.sin(angles[1] + angles[2])
    along, left, up = _in_knee(c0, s0, c, s, axle)
    ca, sa = math.cos(angles[3]), math.sin(angles[3])
    cb, sb = math.cos(angles[4]), math.sin(angles[4])
    # what the five joints leave over: near a straight wrist an error of the knee roll is undone here
    return math.atan2(sb * along + cb * (ca * up - sa * left), ca * left + sa * up)


@njit()
def solve_poses(
    lengths: Array, T_hip_base: Array, Ts_base_wheel: Array, lower: Array, upper: Array, q: Array, valid: NDArray
) -> None:
    """Write all branches, q (n, 8, 6) [rad] and valid (n, 8), of wheel poses (n, 4, 4)."""
    ankle, x, axle = np.empty(3), np.empty(3), np.empty(3)
    angles = np.empty((BRANCHES, 5))
    for i in range(len(Ts_base_wheel)):
        T = Ts_base_wheel[i]
        for k in range(3):
            H = T_hip_base[k]
            x[k] = H[0] * T[0, 0] + H[1] * T[1, 0] + H[2] * T[2, 0]
            axle[k] = H[0] * T[0, 1] + H[1] * T[1, 1] + H[2] * T[2, 1]
            ankle[k] = H[0] * T[0, 3] + H[1] * T[1, 3] + H[2] * T[2, 3] + H[3] - lengths[FOOT] * x[k]
        five_joints(lengths, ankle, x, ALL, angles)
        for branch in range(BRANCHES):
            found = q[i, branch]
            found[:5] = angles[branch]
            found[5] = last_joint(angles[branch], axle)
            if math.isnan(found.sum()):
                found[:] = np.nan
                valid[i, branch] = False
                continue
            inside = True
            for joint in range(6):
                found[joint], outside = into_limits(found[joint], lower[joint], upper[joint])
                inside = inside and outside == 0.0
            valid[i, branch] = inside


@njit()
def stand_upright(contacts: Array, normals: Array, forward: Array, radius: float, Ts: Array) -> bool:
    """Write poses (n, 4, 4) of wheels that stand on contacts (n, 3); see ``ik.wheel_pose_for_contact``.

    normals: (n, 3); forward: (n, 2) x and y of unit headings. False where a normal is zero or along its heading.
    """
    for i in range(contacts.shape[0]):
        T, n, fx, fy = Ts[i], normals[i], forward[i, 0], forward[i, 1]
        length = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        # the axle is normal × forward
        ax, ay, az = n[1] * 0.0 - n[2] * fy, n[2] * fx - n[0] * 0.0, n[0] * fy - n[1] * fx
        size = math.sqrt(ax * ax + ay * ay + az * az)
        if length < 1e-9 or size < 1e-9:
            return False
        ux, uy, uz = n[0] / length, n[1] / length, n[2] / length
        ax, ay, az = ax / size, ay / size, az / size
        T[0, 0], T[1, 0], T[2, 0] = -ux, -uy, -uz
        T[0, 1], T[1, 1], T[2, 1] = ax, ay, az
        # −x × y
        T[0, 2], T[1, 2], T[2, 2] = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
        T[0, 3], T[1, 3], T[2, 3] = (
            contacts[i, 0] + radius * ux,
            contacts[i, 1] + radius * uy,
            contacts[i, 2] + radius * uz,
        )
        T[3, 3] = 1.0
    return True


class UprightLegs(NamedTuple):
    """What :func:`solve_upright` writes.

    q: (n, 8, 6), valid branches inside the limits, NaN for the others. margin: (n, 8) least distance to the limits
    [rad] of the first five joints and of the last at its middle, −inf where there is none. joint, excess: (n,) where no
    branch is inside but some exist, the joint farthest outside in the branch that is least outside, and by how much
    [rad]; else NO_JOINT and NaN where nothing exists, 0 where something is inside. dexterity: (n,) manipulability [m³]
    of the branch with the largest margin, else NaN.
    """

    q: Array
    margin: Array
    joint: NDArray
    excess: Array
    dexterity: Array


@njit(parallel=True)
def solve_upright(
    lengths: Array,
    radius: float,
    T_hip_site: Array,
    contacts: Array,
    normals: Array,
    lower: Array,
    upper: Array,
    present: Array,
    out: UprightLegs,
) -> None:
    """All branches of wheels standing upright on contacts (n, 3) with normals (n, 3), site [m], heading left free.

    The last joint is the angle nearest to ``present`` (6,), as is the knee roll of a straight wrist, which is one
    solution then, of wrist 0.
    """
    q, margin, joint, excess, dexterity = out.q, out.margin, out.joint, out.excess, out.dexterity
    own_turn = 0.5 * (upper[5] - lower[5])
    for index in prange(len(contacts)):
        i = np.int64(index)
        ankle, x = np.empty(3), np.empty(3)
        angles = np.empty((BRANCHES, 5))
        rotations, origins = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
        for k in range(3):
            H = T_hip_site[k]
            x[k] = -(H[0] * normals[i, 0] + H[1] * normals[i, 1] + H[2] * normals[i, 2])
            point = H[0] * contacts[i, 0] + H[1] * contacts[i, 1] + H[2] * contacts[i, 2] + H[3]
            ankle[k] = point - (radius + lengths[FOOT]) * x[k]
        five_joints(lengths, ankle, x, ALL, angles)
        joint[i], excess[i], dexterity[i] = NO_JOINT, np.nan, np.nan
        best, chosen = -np.inf, -1
        for branch in range(BRANCHES):
            found = q[i, branch]
            margin[i, branch] = -np.inf
            found[:] = np.nan
            if math.isnan(angles[branch, 0]):
                continue
            straight = abs(math.sin(angles[branch, 4])) <= STRAIGHT
            if straight and wrist_of(branch) == 1:
                continue
            spare, most, farthest = own_turn, 0.0, NO_JOINT
            for k in range(5):
                if k == 3 and straight:
                    angle, outside = min(max(present[k], lower[k]), upper[k]), 0.0
                    room = 0.5 * (upper[k] - lower[k])
                else:
                    angle, outside = into_limits(angles[branch, k], lower[k], upper[k])
                    room = min(angle - lower[k], upper[k] - angle)
                found[k] = angle
                spare = min(spare, room)
                if outside > most:
                    most, farthest = outside, k
            if most > 0.0:
                found[:] = np.nan
                if not (excess[i] <= most):
                    excess[i], joint[i] = most, farthest
                continue
            found[5] = min(max(present[5], lower[5]), upper[5])
            margin[i, branch] = spare
            if spare > best:
                best, chosen = spare, branch
        if chosen >= 0:
            joint[i], excess[i] = NO_JOINT, 0.0
            leg_frames(lengths, q[i, chosen], rotations, origins)
            dexterity[i] = manipulability(rotations, origins, radius)


@njit()
def head_wheels(
    R_hip_site: Array, normals: Array, azimuth: float, half_turn: bool, lower: Array, upper: Array, q: Array
) -> NDArray:
    """Turn the last joint of postures q (n, 6) so that wheels on normals (n, 3), site, roll towards ``azimuth`` [rad].

    half_turn: or straight back, where only that is inside the limits. Returns where it could be done, (n,); elsewhere q
    stays. The axle is that of ``ik.wheel_pose_for_contact``.
    """
    done = np.zeros(len(q), np.bool_)
    axle = np.empty(3)
    c, s = math.cos(azimuth), math.sin(azimuth)
    for i in range(len(q)):
        x, y, z = -normals[i, 2] * s, normals[i, 2] * c, normals[i, 0] * s - normals[i, 1] * c
        for k in range(3):
            axle[k] = R_hip_site[k, 0] * x + R_hip_site[k, 1] * y + R_hip_site[k, 2] * z
        angle = last_joint(q[i], axle)
        for turn in range(2 if half_turn else 1):
            turned, outside = into_limits(angle + turn * math.pi, lower[5], upper[5])
            if outside == 0.0 and not done[i]:
                q[i, 5] = turned
                done[i] = True
    return done


@njit(parallel=True)
def solve_raised(
    lengths: Array, lift: Array, branch: NDArray, lower: Array, upper: Array, q: Array, above: Array
) -> None:
    """Write the postures ``above`` (n, 6) that hold the wheel of postures q (n, 6) raised by ``lift`` (3,) [m].

    branch: (n,) of q; shoulder and elbow stay, the wrist is the one nearer to q. NaN where none is inside the limits.
    """
    for index in prange(len(q)):
        i = np.int64(index)
        rotations, origins = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
        leg_frames(lengths, q[i], rotations, origins)
        angles = np.empty((BRANCHES, 5))
        five_joints(lengths, origins[5] + lift, rotations[6, :, 0].copy(), ALL, angles)
        axle = rotations[6, :, 1].copy()
        above[i] = np.nan
        least = np.inf
        found = np.empty(6)
        for wrist in range(2):
            five = angles[branch_number(bend_of(branch[i]), wrist)]
            if math.isnan(five[0]):
                continue
            inside, away = True, 0.0
            for k in range(6):
                angle = five[k] if k < 5 else last_joint(five, axle)
                found[k], outside = into_limits(angle, lower[k], upper[k])
                inside = inside and outside == 0.0
                away = max(away, abs(found[k] - q[i, k]))
            if inside and away < least:
                least = away
                above[i] = found
