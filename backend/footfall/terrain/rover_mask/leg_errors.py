"""How wrong the joint angles of a leg may be: what its encoders and its sag do, or what is left of that after a fit."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.robot.kinematics import leg_link_poses, wheel_jacobian
from footfall.robot.leg_frames import JOINT_AXES
from footfall.robot.model import Robot

ENCODER_SD = math.radians(0.5)
"""Standard deviation of a joint angle [rad]."""

SAG = 0.03
"""A loaded leg brings its wheel up to this much nearer to the chassis than its joint angles say [m]."""


class LegError(NamedTuple):
    """Of a leg with n joints, each in rad, or in m where it slides.

    factor: (n, n), its columns are independent errors of one standard deviation. bend: (n,), a bound.
    fitted: whether images showed where the leg is.
    """

    factor: NDArray[np.float64]
    bend: NDArray[np.float64]
    fitted: bool = False


def encoder_and_sag_errors(
    robot: Robot, posture: NDArray[np.float64], encoder_sd: float = ENCODER_SD, sag: float = SAG
) -> list[LegError]:
    """What encoders and sag may be off by, of each leg.

    A leg bends under a vertical force f at its wheel as springs in series do, in proportion to K⁻¹ Jᵀ f.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        encoder_sd: standard deviation of each encoder, independent of the others [rad].
        sag: the most that a wheel comes nearer to the chassis [m].

    Returns:
        One for each leg.
    """
    errors = []
    for leg in robot.legs:
        lift = wheel_jacobian(robot, posture, leg)[2]
        bent = lift / robot.stiffness[6 * leg : 6 * leg + 6]
        effect = float(lift @ bent)
        # straight below its hip a leg of stiff joints can't sag
        errors.append(LegError(encoder_sd * np.eye(6), bent * (sag / effect) if effect > 1e-12 else np.zeros(6)))
    return errors


def joint_axes(robot: Robot, q_leg: NDArray[np.float64], leg: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Axes and origins of a leg's joints.

    Args:
        robot: the rover.
        q_leg: angles of the leg, (6,) [rad].
        leg: number of the leg, from 0.

    Returns:
        (6, 3) each, in base [m].
    """
    poses = leg_link_poses(robot, q_leg, leg)
    Ts_base_joint = [poses[name] for name in robot.description.legs[leg].link_names[:6]]
    axes = np.array([T[:3, axis] for T, axis in zip(Ts_base_joint, JOINT_AXES, strict=True)])
    return axes, np.array([T[:3, 3] for T in Ts_base_joint])


def point_jacobians(
    axes: NDArray[np.float64],
    origins: NDArray[np.float64],
    points: NDArray[np.float64],
    place: NDArray[np.int64],
    slides: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Derivatives of points by the joints of a leg.

    Args:
        axes: (k, 3) unit, in base.
        origins: (k, 3) in base [m].
        points: (n, 3) in base [m].
        place: (n,) of which link each is, counted from the hip.
        slides: which joints slide along their axes, (k,); None: all turn.

    Returns:
        d(point) / d(joint), (n, 3, k) [m/rad; m/m where it slides].
    """
    turned = np.cross(axes[None], points[:, None] - origins[None])
    moved = turned if slides is None else np.where(slides[None, :, None], axes[None], turned)
    return np.where(np.arange(len(axes))[None, None] <= place[:, None, None], moved.transpose(0, 2, 1), 0.0)
