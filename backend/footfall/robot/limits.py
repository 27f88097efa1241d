"""Angles beside the limits of their joints: how much room there is, and which joint is farthest past a limit."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from footfall.robot.model import Robot

Array = NDArray[np.float64]
EVERY_JOINT = slice(None)


@dataclass(frozen=True)
class PastLimit:
    """joint: of the rover's, by number, and its name. excess: how far it is past its limit [rad]; at most 0: inside."""

    joint: int
    name: str
    excess: float


def room_to_limits(robot: "Robot", angles: Array, own: slice = EVERY_JOINT) -> Array:
    """How far each joint is from its nearer limit, (…, n) [rad]; negative outside. own: the joints that these are."""
    return np.minimum(angles - robot.lower[own], robot.upper[own] - angles)


def farthest_past(robot: "Robot", angles: Array, own: slice = EVERY_JOINT) -> PastLimit:
    """The joint of some (n,) that is farthest past a limit, or nearest to one. own: the joints that these are."""
    spare = room_to_limits(robot, angles, own)
    worst = int(np.argmin(spare))
    joint = range(len(robot.lower))[own][worst]
    return PastLimit(joint, robot.joint_names[joint], -float(spare[worst]))
