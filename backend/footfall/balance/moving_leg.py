"""What statics needs of many postures of one leg at once: the rover's centre of mass, the leg's gravity torques."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.robot.chain_kernel import chain_gravity_torques, chain_moments, chain_poses
from footfall.robot.kinematics import center_of_mass
from footfall.robot.leg_frames import JOINT_AXES
from footfall.robot.model import Robot

_KEPT = 24
"""Legs whose constants are remembered."""


def centers_of_mass(robot: Robot, posture: ArrayLike, leg: int, qs_leg: ArrayLike) -> Array:
    """Centre of mass with the angles of one leg replaced by others; the rest stays as in the posture.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        leg: number of the leg, from 0.
        qs_leg: (n, 6) angles of the leg [rad].

    Returns:
        (n, 3) in base [m]; rows with NaN give NaN.
    """
    return centers_with(robot, leg, moment_without(robot, posture, leg), qs_leg)


def moment_without(robot: Robot, posture: ArrayLike, leg: int) -> Array:
    """Sum of mass × position of all but one leg.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        (3,) in base [kg·m].
    """
    posture = robot.require_posture(posture)
    leg = robot.require_leg(leg)
    own = posture[None, 6 * leg : 6 * leg + 6]
    return robot.mass * center_of_mass(robot, posture) - _first_moments(robot, leg, own)[0]


def centers_with(robot: Robot, leg: int, rest: Array, qs_leg: ArrayLike) -> Array:
    """As :func:`centers_of_mass`, where the moment of all but the leg is known.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        rest: (3,) of :func:`moment_without` [kg·m].
        qs_leg: (n, 6) angles of the leg [rad].

    Returns:
        (n, 3) in base [m].

    Raises:
        InvalidInput: the angles have another shape.
    """
    qs = np.asarray(qs_leg, float)
    if qs.ndim != 2 or qs.shape[1] != 6:
        raise InvalidInput("the postures of a leg need n × 6 angles [rad]", shape=list(qs.shape))
    return (rest + _first_moments(robot, leg, qs)) / robot.mass


def leg_links(robot: Robot, leg: int, qs: Array) -> tuple[Array, Array]:
    """Where the links of a leg's joints are.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        qs: (n, 6) angles of the leg [rad].

    Returns:
        Origins (n, 6, 3) [m] and rotations (n, 6, 3, 3), in base.
    """
    poses = chain_poses(_placements(robot, leg), JOINT_AXES, np.ascontiguousarray(qs, float))
    return poses[..., :3, 3], poses[..., :3, :3]


@lru_cache(maxsize=_KEPT)
def _placements(robot: Robot, leg: int) -> Array:
    """Of the leg's joints on one another at angle 0, the first in base, (6, 4, 4)."""
    return np.array([placement.homogeneous for placement in list(robot.leg_models[leg].jointPlacements)[1:]])


@lru_cache(maxsize=_KEPT)
def leg_bodies(robot: Robot, leg: int) -> tuple[Array, Array]:
    """Mass (6,) [kg] and centre (6, 3) [m], in the link's frame, of each of the leg's links."""
    # the wheel is fixed to the last joint's body, which carries its mass
    bodies = [robot.model.inertias[6 * leg + i + 1] for i in range(6)]
    return np.array([body.mass for body in bodies]), np.array([body.lever for body in bodies])


def joint_axes(rotations: Array) -> Array:
    """Directions of the joints' axes in base, (n, 6, 3); rotations: see :func:`leg_links`."""
    return np.stack([rotations[:, i, :, axis] for i, axis in enumerate(JOINT_AXES)], axis=1)


def gravity_torques(robot: Robot, leg: int, qs: Array, up_base: Array, gravity: float) -> Array:
    """Torques that hold a leg's joints while its wheel is off the ground.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        qs: (n, 6) angles of the leg [rad].
        up_base: (3,) unit, against gravity, in base.
        gravity: [m/s²].

    Returns:
        (n, 6) [N·m].
    """
    placements, (masses, centers) = _placements(robot, leg), leg_bodies(robot, leg)
    up = np.ascontiguousarray(up_base)
    return chain_gravity_torques(placements, JOINT_AXES, masses, centers, up, gravity, np.ascontiguousarray(qs, float))


def _first_moments(robot: Robot, leg: int, qs: Array) -> Array:
    """Σ mass × position of the leg's bodies in base, (n, 3) [kg·m]."""
    return chain_moments(_placements(robot, leg), JOINT_AXES, *leg_bodies(robot, leg), np.ascontiguousarray(qs, float))
