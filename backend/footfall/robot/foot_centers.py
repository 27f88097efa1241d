"""Where the feet of a robot are, whoever described it."""

from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.robot.kinematics import wheel_centers
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.model import Robot


def soles(robot: Robot | LeggedRobot, posture: ArrayLike) -> Array:
    """Centres of wheels, or of soles.

    Args:
        robot: the robot.
        posture: (joints,) [rad or m].

    Returns:
        (legs, 3) in base [m].
    """
    return placed(robot, posture).soles if isinstance(robot, LeggedRobot) else wheel_centers(robot, posture)
