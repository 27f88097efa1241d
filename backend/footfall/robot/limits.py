"""Angles beside the limits of their joints: how much room there is, and which joint is farthest past a limit."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from footfall.core.arrays import Array

if TYPE_CHECKING:
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.robot.model import Robot

EVERY_JOINT = slice(None)


@dataclass(frozen=True)
class PastLimit:
    """joint: of the rover's, by number, and its name. excess: how far it is past its limit [rad]; at most 0: inside."""

    joint: int
    name: str
    excess: float


def room_to_limits(robot: "Robot | LeggedRobot", angles: Array, own: slice = EVERY_JOINT) -> Array:
    """How far joints are from their nearer limits.

    Args:
        robot: the rover.
        angles: (…, n) [rad].
        own: the joints that these are.

    Returns:
        (…, n) [rad]; negative outside.
    """
    return np.minimum(angles - robot.lower[own], robot.upper[own] - angles)


def farthest_past(robot: "Robot | LeggedRobot", angles: Array, own: slice = EVERY_JOINT) -> PastLimit:
    """The joint that is farthest past a limit, or nearest to one.

    Args:
        robot: the rover.
        angles: (n,) [rad].
        own: the joints that these are.

    Returns:
        Which joint it is, and how far past which limit.
    """
    spare = room_to_limits(robot, angles, own)
    worst = int(np.argmin(spare))
    joint = range(len(robot.lower))[own][worst]
    return PastLimit(joint, robot.joint_names[joint], -float(spare[worst]))
