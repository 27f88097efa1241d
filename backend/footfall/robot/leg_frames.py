"""Forward kinematics of one leg, compiled: for loops over very many postures.

The frames are those of :mod:`footfall.robot.kinematics`, in the leg's hip frame. ``lengths`` is what
:func:`leg_lengths` gives.
"""

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.description import JOINTS, PARTS, Leg

HIP_X, HIP_Z, THIGH, SHANK, FOOT = range(5)
PART_COUNT = len(PARTS)
JOINT_AXES = np.array(["xyz".index(axis) for _, axis in JOINTS])
"""(6,) which column of its link's rotation is a joint's axis: 0, 1, 2 for x, y, z."""


def leg_lengths(leg: Leg) -> Array:
    """(5,) [m]: x and z from hip yaw to hip pitch, thigh, shank, foot."""
    return np.array([leg.hip_offset[0], leg.hip_offset[2], leg.thigh, leg.shank, leg.foot])


@njit()
def leg_frames(lengths: Array, q: Array, rotations: Array, origins: Array) -> None:
    """Write where the seven links of a leg are.

    Args:
        lengths: of the leg.
        q: its angles, (6,) [rad].
        rotations: R_hip_link, (7, 3, 3), written to.
        origins: (7, 3) in the hip's frame [m], written to.
    """
    c0, s0 = np.cos(q[0]), np.sin(q[0])
    origins[0] = 0.0
    _columns(rotations[0], c0, s0, 0.0, -s0, c0, 0.0)
    origins[1, 0], origins[1, 1], origins[1, 2] = c0 * lengths[0], s0 * lengths[0], lengths[1]
    c1, s1 = np.cos(q[1]), np.sin(q[1])
    _columns(rotations[1], c0 * c1, s0 * c1, -s1, -s0, c0, 0.0)
    c2, s2 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
    _columns(rotations[2], c0 * c2, s0 * c2, -s2, -s0, c0, 0.0)
    _turn_x(rotations[2], q[3], rotations[3])
    _turn_y(rotations[3], q[4], rotations[4])
    _turn_x(rotations[4], q[5], rotations[5])
    rotations[6] = rotations[5]
    for k in range(3):
        origins[2, k] = origins[1, k] + lengths[2] * rotations[1, k, 0]
        origins[3, k] = origins[2, k]
        origins[4, k] = origins[3, k] + lengths[3] * rotations[2, k, 0]
        origins[5, k] = origins[4, k]
        origins[6, k] = origins[5, k] + lengths[4] * rotations[5, k, 0]


@njit()
def _columns(R: Array, xx: float, xy: float, xz: float, yx: float, yy: float, yz: float) -> None:
    """R from its first two columns."""
    R[0, 0], R[1, 0], R[2, 0] = xx, xy, xz
    R[0, 1], R[1, 1], R[2, 1] = yx, yy, yz
    R[0, 2], R[1, 2], R[2, 2] = xy * yz - xz * yy, xz * yx - xx * yz, xx * yy - xy * yx


@njit()
def _turn_x(R: Array, angle: float, out: Array) -> None:
    """Writes R Rx(angle) to ``out``."""
    c, s = np.cos(angle), np.sin(angle)
    for k in range(3):
        y, z = R[k, 1], R[k, 2]
        out[k, 0], out[k, 1], out[k, 2] = R[k, 0], c * y + s * z, c * z - s * y


@njit()
def _turn_y(R: Array, angle: float, out: Array) -> None:
    """Writes R Ry(angle) to ``out``."""
    c, s = np.cos(angle), np.sin(angle)
    for k in range(3):
        x, z = R[k, 0], R[k, 2]
        out[k, 0], out[k, 1], out[k, 2] = c * x - s * z, R[k, 1], s * x + c * z


@njit()
def manipulability(rotations: Array, origins: Array, radius: float) -> float:
    """Manipulability √det(J Jᵀ) of the 3 × 6 Jacobian of the rim point straight below the wheel's centre.

    Yoshikawa, "Manipulability of robotic mechanisms" (1985).

    Args:
        rotations: R_hip_link, (7, 3, 3).
        origins: (7, 3) in the hip's frame [m].
        radius: of the wheel [m].

    Returns:
        [m³].
    """
    x = origins[6, 0] + radius * rotations[6, 0, 0]
    y = origins[6, 1] + radius * rotations[6, 1, 0]
    z = origins[6, 2] + radius * rotations[6, 2, 0]
    xx = xy = xz = yy = yz = zz = 0.0
    for joint in range(6):
        axis = JOINT_AXES[joint]
        ax, ay, az = rotations[joint, 0, axis], rotations[joint, 1, axis], rotations[joint, 2, axis]
        px, py, pz = x - origins[joint, 0], y - origins[joint, 1], z - origins[joint, 2]
        jx, jy, jz = ay * pz - az * py, az * px - ax * pz, ax * py - ay * px
        xx += jx * jx
        xy += jx * jy
        xz += jx * jz
        yy += jy * jy
        yz += jy * jz
        zz += jz * jz
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return np.sqrt(max(det, 0.0))


@njit()
def wheel_axles(lengths: Array, qs: Array) -> Array:
    """The wheel's y in the hip frame, (n, 3), at angles (n, 6) [rad]; NaN gives NaN."""
    rotations, origins = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
    axles = np.empty((len(qs), 3))
    for i in range(len(qs)):
        leg_frames(lengths, qs[i], rotations, origins)
        axles[i] = rotations[6, :, 1]
    return axles
