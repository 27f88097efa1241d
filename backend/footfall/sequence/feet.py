"""Which feet stand on the ground, and where."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.value import Value, value
from footfall.robot.ik import contact_point
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

UP = np.array([0.0, 0.0, 1.0])


@value
class Feet(Value):
    """Lowest rim points of all wheels over a terrain.

    points: (legs, 3) site [m]; normals: (legs, 3) of the ground below, straight up where it is unknown;
    gaps: (legs,) height of the points over the ground [m], NaN where it is unknown.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    gaps: NDArray[np.float64]


def feet(robot: Robot, dem: Dem, posture: Array, T_site_base: Array) -> Feet:
    """Where the wheels of a posture are over a terrain.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        Lowest rim points of all wheels, the ground's normals and the gaps to it.
    """
    points = np.empty((robot.leg_count, 3))
    normals = np.tile(UP, (robot.leg_count, 1))
    for leg in robot.legs:
        lowest = contact_point(robot, posture, leg, T_site_base)
        normal = normal_at(dem, lowest[0], lowest[1], robot.wheel_radius)
        if np.isfinite(normal).all():
            normals[leg] = normal
        points[leg] = contact_point(robot, posture, leg, T_site_base, normals[leg])
    gaps = points[:, 2] - height_at(dem, points[:, 0], points[:, 1])
    return Feet(points, normals, gaps)
