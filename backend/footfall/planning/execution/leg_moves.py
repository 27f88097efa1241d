"""Small moves of one leg that need no inverse kinematics: hub or contact point followed by least change of joints.

The hub's place fixes three of six joints' freedom; of all postures that have it, the one nearest to a posture already
known is taken. So no branch can flip, also where the wrist is straight, and the wheel turns by little.
"""

import numpy as np

from footfall.balance.posture_statics import PostureStatics
from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.robot.kinematics import leg_wheel_pose, wheel_jacobian
from footfall.robot.model import Robot

_ROUNDS = 12
_CLOSE = 1e-7
"""How near the hub must come [m]."""


def with_hub_at(robot: Robot, leg: int, posture: Array, T_site_base: Array, hub: Array) -> Array | None:
    """Angles of a leg, near its own in a posture, that put its hub at a place.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        hub: (3,) in site [m].

    Returns:
        (6,) [rad]; None out of reach.
    """
    target = apply(inverse(T_site_base), hub)
    out = np.array(posture)
    own = slice(6 * leg, 6 * leg + 6)
    for _ in range(_ROUNDS):
        away = target - leg_wheel_pose(robot, out[own], leg)[:3, 3]
        if np.linalg.norm(away) < _CLOSE:
            return out[own]
        out[own] += np.linalg.pinv(wheel_jacobian(robot, out, leg)) @ away
    return None


def strained(robot: Robot, posture: Array, T_site_base: Array, normals: Array, strains: Array, rolled: float) -> Array:
    """The posture after each wheel's spring was strained more, the chassis unmoved.

    A rim sticks and rolls as its locked wheel turns: what moves against the ground is the point of the wheel that
    touches it. For a millimetre or so at a time.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        normals: (legs, 3) of the ground under the wheels, in site.
        strains: (legs, 3) in site [m].
        rolled: how far that point is under the hub, along the normal [m].

    Returns:
        Joint angles, (legs × 6,) [rad].
    """
    statics = PostureStatics(robot, posture)
    R = T_site_base[:3, :3]
    J = statics.contact_jacobians(list(robot.legs), statics.wheel_centers - rolled * normals @ R)
    return posture + (np.linalg.pinv(J) @ (strains @ R)[:, :, None]).ravel()
