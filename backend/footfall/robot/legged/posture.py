"""Where the bodies, soles and the centre of mass of a legged robot are at a posture."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.frames import transform
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.pin_scratch import scratch_of


@dataclass(frozen=True)
class Placed:
    """Ts_base_body: (bodies, 4, 4), body 0 the base. soles: (legs, 3) centres of soles; com: (3,), both in base [m]."""

    Ts_base_body: Array
    soles: Array
    com: Array


def placed(robot: LeggedRobot, posture: ArrayLike) -> Placed:
    """Forward kinematics by pin. Raises InvalidInput for a posture of another robot."""
    q = robot.require_posture(posture)
    with scratch_of(robot, robot.pin_model) as frames:
        pin.framesForwardKinematics(robot.pin_model, frames, q)
        Ts = np.array([np.eye(4)] + [T.homogeneous for T in list(frames.oMi)[1:]])
        soles = np.array([frames.oMf[frame].translation for frame in robot.foot_frames])
    return Placed(Ts, soles, center_of_mass(robot, q))


def center_of_mass(robot: LeggedRobot, q: Array) -> Array:
    """Of the whole robot in base, (3,) [m]. Pin leaves out what is fixed to a model's base, so that is added."""
    model = robot.pin_model
    base = model.inertias[0]
    if not robot.mass > base.mass:
        return np.array(base.lever)  # of legs that weigh nothing pin has no centre
    with scratch_of(robot, model) as data:
        moving = np.array(pin.centerOfMass(model, data, q))
    return (base.mass * base.lever + (robot.mass - base.mass) * moving) / robot.mass


def legs_to(robot: LeggedRobot, T_site_base: Array, soles: ArrayLike, near: Array) -> Array:
    """The posture that puts the soles where they are asked for.

    Each leg goes there the way from ``near`` leads.

    Args:
        robot: the robot.
        T_site_base: pose of the chassis, (4, 4).
        soles: their centres, (legs, 3) in site [m].
        near: posture to begin from, (joints,) [rad or m].

    Returns:
        (joints,) [rad or m]; NaN for a leg whose way leads nowhere.
    """
    targets = np.asarray(soles, float)
    return np.concatenate([leg_to(robot, leg, T_site_base, targets[leg], near) for leg in robot.legs])


def leg_to(robot: LeggedRobot, leg: int, T_site_base: Array, sole: Array, near: Array) -> Array:
    """The leg's own joints in :func:`legs_to`.

    Args:
        robot: the robot.
        leg: number of the leg, from 0.
        T_site_base: pose of the chassis, (4, 4).
        sole: its centre, (3,) in site [m].
        near: posture to begin from, (joints,) [rad or m].

    Returns:
        The leg's joints [rad or m]; NaN where the way leads nowhere.
    """
    own = near[robot.slices[leg]]
    if not np.isfinite(own).all():
        return np.full_like(own, np.nan)
    point = (sole - T_site_base[:3, 3]) @ T_site_base[:3, :3]
    return robot.limbs[leg].solve_from(point[None], own[None])[0]


def chassis_pose(x: float, y: float, z: float, yaw: float, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Pose of a chassis at a place with a heading.

    Args:
        x: east, in site [m].
        y: north, in site [m].
        z: up, in site [m].
        yaw: heading in site [rad].
        up: what the chassis' z axis is along, (3,) in site.

    Returns:
        T_site_base, (4, 4).
    """
    axis = np.asarray(up, float) / np.linalg.norm(up)
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    ahead[2] = -(ahead @ axis) / axis[2]  # across the axis, and seen from above still in the heading
    ahead /= np.linalg.norm(ahead)
    return transform(np.stack([ahead, np.cross(axis, ahead), axis], axis=1), (x, y, z))
