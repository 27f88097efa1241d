"""A chain of links one on the other, compiled for many postures at once.

Each link is placed on the one before and then turned about one of its own axes: nothing but products of the links'
matrices. So it stands on its own beside the closed forms of leg_frames.py, which the planner's quick checks use.
"""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array

FIXED = -1
"""Axis of a link that does not turn on the one before."""


@njit()
def chain_poses(placements: Array, axes: NDArray[np.int64], qs: Array) -> Array:
    """Poses (n, links, 4, 4) of the links at angles (n, joints) [rad], in the frame that the first is placed in.

    placements: (links, 4, 4) of each link on the one before, at angle 0; axes: (links,) 0, 1, 2 for x, y, z, or FIXED.
    """
    links = placements.shape[0]
    if axes.size != links or (axes >= 0).sum() != qs.shape[1]:
        raise ValueError("the chain needs an axis for each link and an angle for each that turns")
    out = np.zeros((qs.shape[0], links, 4, 4))
    for i in range(qs.shape[0]):
        joint = 0
        for link in range(links):
            for row in range(3):
                if link == 0:
                    for col in range(4):
                        out[i, 0, row, col] = placements[0, row, col]
                    continue
                x, y, z = out[i, link - 1, row, 0], out[i, link - 1, row, 1], out[i, link - 1, row, 2]
                for col in range(4):
                    out[i, link, row, col] = (
                        x * placements[link, 0, col] + y * placements[link, 1, col] + z * placements[link, 2, col]
                    )
                out[i, link, row, 3] += out[i, link - 1, row, 3]
            out[i, link, 3, 3] = 1.0
            if axes[link] >= 0:
                # the columns beside the axis turn: R Rₐ(angle)
                c, s = math.cos(qs[i, joint]), math.sin(qs[i, joint])
                u, v = (axes[link] + 1) % 3, (axes[link] + 2) % 3
                for row in range(3):
                    a, b = out[i, link, row, u], out[i, link, row, v]
                    out[i, link, row, u], out[i, link, row, v] = c * a + s * b, c * b - s * a
                joint += 1
    return out


@njit()
def chain_moments(placements: Array, axes: NDArray[np.int64], masses: Array, centers: Array, qs: Array) -> Array:
    """Σ mass × position of the links' bodies, (n, 3) [kg·m].

    masses: (links,) [kg]; centers: (links, 3) [m] of mass in the links' frames.
    """
    poses = chain_poses(placements, axes, qs)
    out = np.zeros((qs.shape[0], 3))
    for i in range(qs.shape[0]):
        for link in range(masses.size):
            T = poses[i, link]
            for row in range(3):
                at = (
                    T[row, 0] * centers[link, 0]
                    + T[row, 1] * centers[link, 1]
                    + T[row, 2] * centers[link, 2]
                    + T[row, 3]
                )
                out[i, row] += masses[link] * at
    return out


@njit()
def chain_gravity_torques(
    placements: Array, axes: NDArray[np.int64], masses: Array, centers: Array, up: Array, gravity: float, qs: Array
) -> Array:
    """Torques that hold a hanging chain whose links all turn, (n, links) [N·m]; up: (3,) unit; gravity [m/s²].

    Each joint carries the bodies from its own link outward: g × axis · (Σ mass × arm × up), arms from the joint.
    """
    poses = chain_poses(placements, axes, qs)
    out = np.empty((qs.shape[0], masses.size))
    carried = np.empty(3)
    for i in range(qs.shape[0]):
        carried[:] = 0.0
        mass = 0.0
        for link in range(masses.size - 1, -1, -1):
            T = poses[i, link]
            mass += masses[link]
            for row in range(3):
                at = (
                    T[row, 0] * centers[link, 0]
                    + T[row, 1] * centers[link, 1]
                    + T[row, 2] * centers[link, 2]
                    + T[row, 3]
                )
                carried[row] += masses[link] * at
            x, y, z = carried[0] - mass * T[0, 3], carried[1] - mass * T[1, 3], carried[2] - mass * T[2, 3]
            a = axes[link]
            ax, ay, az = T[0, a], T[1, a], T[2, a]
            moment = up[0] * (ay * z - az * y) + up[1] * (az * x - ax * z) + up[2] * (ax * y - ay * x)
            out[i, link] = gravity * moment
    return out
