"""The rover's centre of mass for many postures of one leg at once."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from footfall.robot.description import JOINTS
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot

Array = NDArray[np.float64]


def centers_of_mass(robot: Robot, posture: ArrayLike, leg: int, qs_leg: ArrayLike) -> Array:
    """Centre of mass in base, (n, 3) [m], with the angles of one leg replaced by each of (n, 6) [rad].

    Rows with NaN give NaN. The other legs, the chassis and the payload stay as in ``posture``.
    """
    posture = robot.require_posture(posture)
    leg = robot.require_leg(leg)
    qs = np.asarray(qs_leg, float)
    if qs.ndim != 2 or qs.shape[1] != 6:
        raise InvalidInput("the postures of a leg need n × 6 angles [rad]", shape=list(qs.shape))
    own = posture[None, 6 * leg : 6 * leg + 6]
    rest = robot.mass * center_of_mass(robot, posture) - _first_moments(robot, leg, own)[0]
    return (rest + _first_moments(robot, leg, qs)) / robot.mass


def leg_links(robot: Robot, leg: int, qs: Array) -> tuple[Array, Array]:
    """Origins (n, 6, 3) [m] and rotations (n, 6, 3, 3), in base, of the links of a leg's joints at qs (n, 6) [rad]."""
    placements = robot.leg_models[leg].jointPlacements
    R = np.broadcast_to(np.eye(3), (len(qs), 3, 3))
    origin = np.zeros((len(qs), 3))
    origins, rotations = np.empty((len(qs), 6, 3)), np.empty((len(qs), 6, 3, 3))
    for i, (_, axis) in enumerate(JOINTS):
        placement = placements[i + 1]
        origin = origin + R @ placement.translation
        R = R @ (placement.rotation @ rotation(axis, qs[:, i]))
        origins[:, i], rotations[:, i] = origin, R
    return origins, rotations


def body_moments(robot: Robot, leg: int, origins: Array, rotations: Array) -> tuple[Array, Array]:
    """Mass (6,) [kg] of each of the leg's links and mass × position in base (n, 6, 3) [kg·m]; see :func:`leg_links`."""
    # the wheel is fixed to the last joint's body, which carries its mass
    bodies = [robot.model.inertias[6 * leg + i + 1] for i in range(6)]
    mass, levers = np.array([body.mass for body in bodies]), np.array([body.lever for body in bodies])
    return mass, mass[:, None] * (origins + (rotations @ levers[:, :, None])[..., 0])


def _first_moments(robot: Robot, leg: int, qs: Array) -> Array:
    """Σ mass × position of the leg's bodies in base, (n, 3) [kg·m]."""
    return body_moments(robot, leg, *leg_links(robot, leg, qs))[1].sum(axis=1)
