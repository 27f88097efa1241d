"""Whether a rover that gives way stands near enough to where a walk has it."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState

CHASSIS_MOVED = 0.03
"""The chassis' origin may be so far from where the walk has it [m]."""
FOOT_MOVED = 0.06
"""A wheel's middle may be so far from where the walk has it [m]: the weight presses it in by some 25 mm, and where
telemetry was planned from it was so already. More, and it stands elsewhere."""


def off_walk(robot: Robot, state: RobotState, posture: Array, T_site_base: Array) -> str:
    """How far the rover is from where a walk has it, for a person.

    Args:
        robot: the rover.
        state: how the rover stands.
        posture: of the walk, (legs × 6,) [rad].
        T_site_base: pose of the chassis that the walk has, (4, 4).

    Returns:
        One sentence; empty where it is there.
    """
    chassis = float(np.linalg.norm(state.T_site_base[:3, 3] - T_site_base[:3, 3]))
    leg, wheel = farthest_wheel(robot, state, posture, T_site_base)
    if not (chassis <= CHASSIS_MOVED and wheel <= FOOT_MOVED):
        return f"the chassis is {chassis:z.3f} m and the wheel of leg {leg} {wheel:z.3f} m from where it starts"
    return ""


def farthest_wheel(robot: Robot, state: RobotState, posture: Array, T_site_base: Array) -> tuple[int, float]:
    """The wheel whose middle is farthest from where a walk has it.

    Args:
        robot: the rover.
        state: how the rover stands.
        posture: of the walk, (legs × 6,) [rad].
        T_site_base: pose of the chassis that the walk has, (4, 4).

    Returns:
        Its leg, and how far that is [m].
    """
    here, there = (
        apply(T, wheel_centers(robot, q)) for q, T in ((state.posture, state.T_site_base), (posture, T_site_base))
    )
    away = np.linalg.norm(here - there, axis=1)
    leg = int(np.argmax(away))
    return leg, float(away[leg])
