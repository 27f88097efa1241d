"""Wheel forces and joint torques of a rover that stands still, in static balance."""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.forces import distribute
from footfall.balance.friction import FRICTION
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.robot.kinematics import center_of_mass, gravity_torques, leg_link_poses
from footfall.robot.leg_frames import JOINT_AXES
from footfall.robot.model import Robot
from footfall.sequence.feet import feet
from footfall.terrain.dem import Dem

CONTACT_GAP = 0.02
"""A wheel within this of the ground carries load [m]: a rover's weight compresses its wheels by about as much."""


def loads(
    robot: Robot,
    dem: Dem,
    posture: Array,
    T_site_base: Array,
    moving_leg: int | None = None,
    standing: NDArray[np.bool_] | None = None,
    friction: float = FRICTION,
    gravity: float = GRAVITY,
) -> tuple[Array, Array]:
    """Forces of the ground on the wheels, site frame, (legs, 3) [N], and joint torques, (legs × 6,) [N·m].

    The feet that carry load are those in contact and those known to be ``standing`` (legs,), without
    ``moving_leg``; the forces are the least ones in balance. The joints hold the links' weight against
    them: τ = g(q) − Jᵀ f.

    Raises InvalidInput where no forces of those feet can hold the rover.
    """
    wheels = feet(robot, dem, posture, T_site_base)
    carrying = wheels.gaps <= CONTACT_GAP
    if standing is not None:
        carrying |= standing
    if moving_leg is not None:
        carrying[moving_leg] = False
    held = None
    if carrying.any():
        com = apply(T_site_base, center_of_mass(robot, posture))
        held = distribute(wheels.points[carrying], wheels.normals[carrying], com, robot.mass, gravity, friction)
    if held is None:
        feet_down = ", ".join(str(leg) for leg in np.flatnonzero(carrying)) or "none"
        raise InvalidInput(
            f"the feet on the ground (legs: {feet_down}) can't hold the rover up: it would tip or slip",
            carrying=np.flatnonzero(carrying).tolist(),
        )
    forces = np.zeros((robot.leg_count, 3))
    forces[carrying] = held
    R_site_base = T_site_base[:3, :3]
    torques = gravity_torques(robot, posture, R_site_base, gravity)
    points_base = (wheels.points - T_site_base[:3, 3]) @ R_site_base
    for leg in np.flatnonzero(carrying):
        J = contact_jacobian(robot, posture, int(leg), points_base[leg])
        torques[6 * leg : 6 * leg + 6] -= J.T @ (forces[leg] @ R_site_base)
    return forces, torques


def contact_jacobian(robot: Robot, posture: Array, leg: int, point: Array) -> Array:
    """How a point (3,) of the locked wheel, in base [m], moves with the leg's joints: (3, 6) [m/rad].

    Column j is the axis of joint j crossed with the arm from the joint to the point.
    """
    Ts_base_link = leg_link_poses(robot, posture[6 * leg : 6 * leg + 6], leg)
    columns = []
    for name, axis in zip(robot.description.legs[leg].link_names, JOINT_AXES, strict=False):
        T = Ts_base_link[name]
        columns.append(np.cross(T[:3, axis], point - T[:3, 3]))
    return np.column_stack(columns)
