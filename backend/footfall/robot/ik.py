"""Closed-form inverse kinematics of one leg, and wheel poses on the ground.

After the hip yaw, hip pitch and knee pitch are a planar 2R to the ankle centre; knee roll, ankle pitch
and ankle roll meet there as an x-y-x wrist. A wheel pose has two solutions of each, so eight
*branches*, numbered by shoulder, elbow and wrist (leg_branches.py):

- shoulder 0: the leg's plane points at the ankle; 1: it points away and the leg reaches back over the hip;
- elbow 0: knee pitch ≥ 0 (outer leg bends down); 1: knee pitch < 0;
- wrist 0: ankle pitch ≥ 0; 1: ankle pitch < 0, with knee and ankle roll turned by π.

All named postures of ATHLETE are branch 0. Decoupling after Pieper, "The kinematics of manipulators under
computer control" (1968).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import inverse
from footfall.robot import ik_kernel
from footfall.robot.kinematics import wheel_pose
from footfall.robot.leg_branches import BRANCHES
from footfall.robot.leg_frames import leg_lengths
from footfall.robot.model import Robot


@dataclass(frozen=True)
class IkSolutions:
    """q: (n, 8, 6) joint angles [rad], NaN where a branch has no solution; valid: (n, 8), exists and inside limits."""

    q: Array
    valid: NDArray[np.bool_]


def solve_leg(robot: Robot, leg: int, Ts_base_wheel: ArrayLike) -> IkSolutions:
    """All branches of a leg for wheel poses.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        Ts_base_wheel: (n, 4, 4), x from ankle to wheel centre, y axle.

    Returns:
        Angles of every branch, turned by 2π into the joint's limits where that is possible; else in (−π, π].

    Raises:
        InvalidInput: the poses have another shape.
    """
    leg = robot.require_leg(leg)
    spec = robot.description.legs[leg]
    Ts = np.ascontiguousarray(Ts_base_wheel, float)
    if Ts.ndim != 3 or Ts.shape[1:] != (4, 4):
        raise InvalidInput("wheel poses need the shape (n, 4, 4)", shape=list(Ts.shape))
    own = slice(6 * leg, 6 * leg + 6)
    q, valid = np.empty((len(Ts), BRANCHES, 6)), np.empty((len(Ts), BRANCHES), bool)
    ik_kernel.solve_poses(leg_lengths(spec), inverse(spec.T_base_hip), Ts, robot.lower[own], robot.upper[own], q, valid)
    return IkSolutions(q, valid)


def wheel_pose_for_contact(
    robot: Robot, contact: ArrayLike, normal: ArrayLike, heading: ArrayLike, T_site_base: ArrayLike
) -> Array:
    """Pose of a wheel that stands upright on the ground at a contact; inverse of :func:`contact_point`.

    The wheel's x is −normal, its axle is perpendicular to heading and normal, and its centre is one radius above the
    contact along the normal.

    Args:
        robot: the rover.
        contact: (…, 3) in site [m].
        normal: (…, 3) in site, of any length above zero.
        heading: (…) azimuth in site in which the wheel would roll [rad].
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        T_base_wheel, (…, 4, 4); NaN gives NaN.

    Raises:
        InvalidInput: a normal is zero or parallel to its heading.
    """
    contact, normal, heading = np.asarray(contact, float), np.asarray(normal, float), np.asarray(heading, float)
    shape = np.broadcast_shapes(contact.shape[:-1], normal.shape[:-1], heading.shape)
    count = math.prod(shape)
    points, up = (np.broadcast_to(one, (*shape, 3)).reshape(count, 3) for one in (contact, normal))
    forward = np.empty((count, 2))
    forward[:, 0], forward[:, 1] = (turn(np.broadcast_to(heading, shape).ravel()) for turn in (np.cos, np.sin))
    T_site_wheel = np.zeros((*shape, 4, 4))
    if not ik_kernel.stand_upright(points, up, forward, robot.wheel_radius, T_site_wheel.reshape(count, 4, 4)):
        raise InvalidInput("a wheel stands on a ground whose normal is not zero and not along its heading")
    return inverse(np.asarray(T_site_base, float)) @ T_site_wheel


def contact_point(
    robot: Robot, posture: ArrayLike, leg: int, T_site_base: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)
) -> Array:
    """Point of a wheel's rim that is lowest along a normal; the rim is a circle about the axle.

    Where the normal is along the axle (a wheel lying flat) all are as low; it is the one farthest from the ankle.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        leg: number of the leg, from 0.
        T_site_base: pose of the chassis, (4, 4).
        normal: (3,) in site, of any length above zero.

    Returns:
        (3,) in site [m].
    """
    return lowest_rim_point(robot, np.asarray(T_site_base, float) @ wheel_pose(robot, posture, leg), normal)


def lowest_rim_point(robot: Robot, T_site_wheel: Array, normal: ArrayLike) -> Array:
    """As :func:`contact_point`, of a wheel at a pose.

    Args:
        robot: the rover.
        T_site_wheel: pose of the wheel, (4, 4).
        normal: (3,) in site, of any length above zero.

    Returns:
        (3,) in site [m].

    Raises:
        InvalidInput: the normal is zero or has another shape.
    """
    up = np.asarray(normal, float)
    length = np.linalg.norm(up)
    if up.shape != (3,) or not length > 0:
        raise InvalidInput("a normal needs three numbers, not all zero")
    axle = T_site_wheel[:3, 1]
    radial = (up @ axle) * axle - up
    size = np.linalg.norm(radial)
    lowest = radial / size if size > 1e-9 * length else T_site_wheel[:3, 0]
    return T_site_wheel[:3, 3] + robot.wheel_radius * lowest


def leg_azimuth(robot: Robot, leg: int, T_site_base: ArrayLike) -> float:
    """Azimuth of a leg's radially outward direction: the default heading of its wheel.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        In site [rad].
    """
    out = np.asarray(T_site_base, float)[:3, :3] @ robot.description.legs[leg].T_base_hip[:3, 0]
    return math.atan2(out[1], out[0])
