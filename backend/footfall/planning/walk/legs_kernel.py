"""The legs of a rover whose wheels stand still, for any pose of its chassis: compiled.

The wheel of a standing foot neither rolls nor turns, and its branch of the inverse kinematics is chosen when it is
placed. So the pose of the chassis alone gives every joint, and what a leg has to spare there is one number.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.ik_kernel import five_joints, into_limits, last_joint
from footfall.robot.leg_branches import BRANCHES, shoulder_of
from footfall.robot.leg_frames import FOOT, HIP_X, HIP_Z, SHANK, THIGH

WRIST, KNEE_ROLL = 0.12, 1.2
"""``LegsTables.wrist`` and ``knee_roll`` where a foot is moved [rad]."""
WRIST_ON_THE_WAY, KNEE_ROLL_ON_THE_WAY = 0.06, 2.2
"""The same while the chassis moves [rad]: between two poses that keep the above it may come a little nearer."""
UNREACHED = 1.0
"""What a leg that can't reach lacks more than one that is only short of its reserves [m or rad]."""


class LegsTables(NamedTuple):
    """lengths: (legs, 5), see leg_frames.py; Ts_base_hip: (legs, 3, 4); lower, upper: (legs, 6) [rad].

    reach_reserve [m], joint_reserve [rad]: see ``WalkSettings``. wrist: how far a standing leg keeps from a straight
    wrist, where its knee roll would have to jump; knee_roll: how far its knee may be rolled [rad], beyond which the
    wrist is about to pass straight on the other side.
    """

    lengths: Array
    Ts_base_hip: Array
    lower: Array
    upper: Array
    reach_reserve: float
    joint_reserve: float
    wrist: float = WRIST
    knee_roll: float = KNEE_ROLL


class Feet(NamedTuple):
    """Where wheels stand: Ts_site_wheel (legs, 3, 4); branches (legs,)."""

    Ts_site_wheel: Array
    branches: NDArray[np.int64]


@njit()
def leg_at(T_site_base: Array, T_site_wheel: Array, branch: int, leg: int, tables: LegsTables, q: Array) -> float:
    """Write the joints q (6,) [rad] that hold a wheel with the chassis there; returns what the leg has to spare.

    That is the least of its distance from straight and from folded [m] and of its joints from their limits [rad],
    beyond the reserves, of its wrist from straight beyond ``wrist``, and of its knee's roll up to ``knee_roll``.
    Negative: it lacks so much; below −UNREACHED there is no such posture, and q is NaN.
    """
    lengths, H = tables.lengths[leg], tables.Ts_base_hip[leg]
    R, at = np.empty((3, 3)), np.empty(3)
    for i in range(3):
        at[i] = T_site_base[i, 3]
        for k in range(3):
            R[i, k] = T_site_base[i, 0] * H[0, k] + T_site_base[i, 1] * H[1, k] + T_site_base[i, 2] * H[2, k]
            at[i] += T_site_base[i, k] * H[k, 3]
    x, axle, ankle = np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        x[k] = axle[k] = ankle[k] = 0.0
        for i in range(3):
            x[k] += R[i, k] * T_site_wheel[i, 0]
            axle[k] += R[i, k] * T_site_wheel[i, 1]
            ankle[k] += R[i, k] * (T_site_wheel[i, 3] - at[i])
        ankle[k] -= lengths[FOOT] * x[k]
    away = math.hypot(ankle[0], ankle[1])
    out = (away if shoulder_of(branch) == 0 else -away) - lengths[HIP_X]
    far = math.hypot(out, ankle[2] - lengths[HIP_Z])
    reach = min(lengths[THIGH] + lengths[SHANK] - far, far - abs(lengths[THIGH] - lengths[SHANK]))
    if not reach > 0.0:
        q[:] = np.nan
        return reach - UNREACHED
    angles = np.empty((BRANCHES, 5))
    five_joints(lengths, ankle, x, branch, angles)
    spare = reach - tables.reach_reserve
    for k in range(6):
        angle = angles[branch, k] if k < 5 else last_joint(angles[branch], axle)
        q[k], outside = into_limits(angle, tables.lower[leg, k], tables.upper[leg, k])
        if math.isnan(q[k]):
            return -2.0 * UNREACHED
        room = min(q[k] - tables.lower[leg, k], tables.upper[leg, k] - q[k])
        spare = min(spare, room - tables.joint_reserve)
        if outside > 0.0:
            q[:] = np.nan
            return -outside - UNREACHED
    return min(spare, abs(math.sin(q[4])) - tables.wrist, tables.knee_roll - abs(q[3]))


@njit()
def legs_at(T_site_base: Array, feet: Feet, tables: LegsTables, q: Array, spares: Array) -> float:
    """:func:`leg_at` of every leg: q (legs × 6,), spares (legs,) are written; returns the least."""
    least = np.inf
    for leg in range(len(tables.lengths)):
        T_site_wheel, branch = feet.Ts_site_wheel[leg], feet.branches[leg]
        spares[leg] = leg_at(T_site_base, T_site_wheel, branch, leg, tables, q[6 * leg : 6 * leg + 6])
        least = min(least, spares[leg])
    return least


@njit()
def pose_of(vector: Array, T: Array) -> None:
    """Write T_site_base (3, 4) of x, y, z [m] and roll, pitch, yaw [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(vector[3]), math.sin(vector[3])
    cp, sp = math.cos(vector[4]), math.sin(vector[4])
    cy, sy = math.cos(vector[5]), math.sin(vector[5])
    T[0, 0], T[0, 1], T[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    T[1, 0], T[1, 1], T[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    T[2, 0], T[2, 1], T[2, 2] = -sp, cp * sr, cp * cr
    T[0, 3], T[1, 3], T[2, 3] = vector[0], vector[1], vector[2]


@njit()
def turn_between(T_from: Array, T_to: Array) -> Array:
    """The turn from one chassis to another about one axis of the first, (3,) [rad]; less than half a turn."""
    R = np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            for m in range(3):
                R[i, k] += T_from[m, i] * T_to[m, k]
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    size = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(size, R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    share = angle / size if size > 1e-12 else 0.5
    return np.array([x * share, y * share, z * share])


@njit()
def between(T_from: Array, T_to: Array, turn: Array, share: float, T: Array) -> None:
    """Write the chassis pose (3, 4) at a share 0…1 of the way: origin on a straight line, turn about one axis.

    turn: of :func:`turn_between`. The rotation is Rodrigues' formula.
    """
    angle = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    if angle > 1e-12:
        x, y, z = turn[0] / angle, turn[1] / angle, turn[2] / angle
    else:
        x, y, z = 1.0, 0.0, 0.0
    c, s = math.cos(share * angle), math.sin(share * angle)
    v = 1.0 - c
    for i in range(3):
        a, b, d = T_from[i, 0], T_from[i, 1], T_from[i, 2]
        T[i, 0] = a * (c + x * x * v) + b * (y * x * v + z * s) + d * (z * x * v - y * s)
        T[i, 1] = a * (x * y * v - z * s) + b * (c + y * y * v) + d * (z * y * v + x * s)
        T[i, 2] = a * (x * z * v + y * s) + b * (y * z * v - x * s) + d * (c + z * z * v)
        T[i, 3] = (1.0 - share) * T_from[i, 3] + share * T_to[i, 3]
