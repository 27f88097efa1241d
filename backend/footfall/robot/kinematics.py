"""Where links, wheels and the centre of mass are, and which torques gravity asks for.

Everything is in the base frame, with the base fixed; see model.py.
"""

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.robot.model import Robot
from footfall.robot.pin_scratch import pin_scratch


def link_poses(robot: Robot, posture: ArrayLike) -> dict[str, Array]:
    """T_base_link, (4, 4), of every link of the robot, by link name (``base`` included)."""
    with pin_scratch(robot) as data:
        pin.framesForwardKinematics(robot.model, data, robot.require_posture(posture))
        return {link: data.oMf[frame].homogeneous for link, frame in robot.link_frames.items()}


def leg_link_poses(robot: Robot, q_leg: ArrayLike, leg: int) -> dict[str, Array]:
    """Poses of the seven links of one leg.

    Args:
        robot: the rover.
        q_leg: angles of the leg, (6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        Link → T_base_link, (4, 4).
    """
    spec = robot.description.legs[leg]
    with pin_scratch(robot, leg) as data:
        pin.forwardKinematics(robot.leg_models[leg], data, np.asarray(q_leg, float))
        Ts_base_link = [data.oMi[i].homogeneous for i in range(1, 7)]
    Ts_base_link.append(_wheel(Ts_base_link[-1], spec.foot))
    return dict(zip(spec.link_names, Ts_base_link, strict=True))


def wheel_pose(robot: Robot, posture: ArrayLike, leg: int) -> Array:
    """Pose of a wheel: x from the ankle to the wheel's centre, y the axle.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        T_base_wheel, (4, 4).
    """
    q = robot.require_posture(posture)
    return leg_wheel_pose(robot, q[6 * leg : 6 * leg + 6], leg)


def leg_wheel_pose(robot: Robot, q_leg: ArrayLike, leg: int) -> Array:
    """Pose of a wheel, from the angles of its leg.

    Args:
        robot: the rover.
        q_leg: angles of the leg, (6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        T_base_wheel, (4, 4).
    """
    with pin_scratch(robot, leg) as data:
        pin.forwardKinematics(robot.leg_models[leg], data, np.asarray(q_leg, float))
        T_base_ankle = data.oMi[6].homogeneous
    return _wheel(T_base_ankle, robot.description.legs[leg].foot)


def wheel_centers(robot: Robot, posture: ArrayLike) -> Array:
    """Wheel centres in base, (legs, 3) [m]."""
    with pin_scratch(robot) as data:
        pin.forwardKinematics(robot.model, data, robot.require_posture(posture))
        ankles = [data.oMi[6 * (leg + 1)] for leg in robot.legs]
        legs = robot.description.legs
        return np.array([T.translation + spec.foot * T.rotation[:, 0] for T, spec in zip(ankles, legs, strict=True)])


def center_of_mass(robot: Robot, posture: ArrayLike) -> Array:
    """Centre of mass of the rover with its payload, in base, (3,) [m]."""
    with pin_scratch(robot) as data:
        center = np.array(pin.centerOfMass(robot.model, data, robot.require_posture(posture)))
    # pin leaves out what is fixed to the base
    chassis, payload = robot.model.inertias[0], robot.description.payload
    fixed = chassis.mass * chassis.lever
    fixed_mass = chassis.mass
    if payload is not None:
        fixed = fixed + payload.mass * payload.position
        fixed_mass += payload.mass
    return (center * (robot.mass - fixed_mass) + fixed) / robot.mass


def gravity_torques(robot: Robot, posture: ArrayLike, R_site_base: ArrayLike, gravity: float = 9.81) -> Array:
    """Torques that hold the joints against gravity with no wheel on the ground: the gradient of the potential energy.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        R_site_base: rotation of the chassis, (3, 3).
        gravity: along −z of the site [m/s²].

    Returns:
        (legs × 6,) [N·m].
    """
    q = robot.require_posture(posture)
    gravity_base = -gravity * np.asarray(R_site_base, float)[2]
    torques = np.zeros(len(q))
    with pin_scratch(robot) as data:
        for model, component in zip(robot.unit_gravity_models, gravity_base, strict=True):
            torques += component * pin.computeGeneralizedGravity(model, data, q)
    return torques


def wheel_jacobian(robot: Robot, posture: ArrayLike, leg: int) -> Array:
    """Derivative of a wheel's centre by the joint angles of its leg.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        d(wheel centre in base) / d(joint angles), (3, 6) [m/rad].
    """
    q = robot.require_posture(posture)[6 * leg : 6 * leg + 6]
    model = robot.leg_models[leg]
    with pin_scratch(robot, leg) as data:
        pin.computeJointJacobians(model, data, q)
        J = pin.getJointJacobian(model, data, 6, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        arm = data.oMi[6].rotation[:, 0] * robot.description.legs[leg].foot
        return J[:3] + np.cross(J[3:].T, arm).T


def _wheel(T_base_ankle: Array, foot: float) -> Array:
    T = np.array(T_base_ankle)
    T[:3, 3] += foot * T[:3, 0]
    return T
