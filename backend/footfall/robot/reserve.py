"""How much a posture has in reserve: how far its legs are from straight or folded, and its joints from their limits.

A leg that is stretched straight is singular: its wheel can't be followed any farther out, and near there the knee turns
fast for little motion. Both numbers are of the posture alone, whatever stands around.
"""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot

KNEE = 2
"""The joint of a leg that straightens it."""


def reach_reserves(robot: Robot, postures: ArrayLike) -> Array:
    """How much farther, or nearer, than now each ankle could be from its hip pitch joint, (…, legs) [m].

    postures: (…, legs × 6) [rad]. The less of what is left to straight and to folded; 0 where the leg is singular.
    """
    knees = np.asarray(postures, float)[..., KNEE::6]
    thigh, shank = np.array([(leg.thigh, leg.shank) for leg in robot.description.legs]).T
    away = np.sqrt(np.maximum(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(knees), 0.0))
    return np.minimum(thigh + shank - away, away - np.abs(thigh - shank))


def joint_reserves(robot: Robot, postures: ArrayLike) -> Array:
    """How far each joint is from its nearer limit, (…, legs × 6) [rad]; negative outside."""
    return room_to_limits(robot, np.asarray(postures, float))
