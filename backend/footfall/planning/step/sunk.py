"""By how much a link is in the ground: for reports, after a collision was found."""

import numpy as np

from footfall.core.frames import apply
from footfall.planning.step.edges import Array
from footfall.robot.ground import surface_points
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

SPACING = 0.01
"""How densely the link's surface is compared with the ground [m]."""


def sunk(robot: Robot, dem: Dem, posture: Array, T_site_base: Array, link: str, lift: float = 0.0) -> float:
    """How far the deepest place of a link's surface is straight below the ground raised by ``lift`` [m].

    0 where none is, or the ground there is unknown. posture: (legs × 6,) [rad].
    """
    surface = surface_points(robot.description.meshes[link], SPACING)
    points = apply(T_site_base @ link_poses(robot, posture)[link], surface)
    depth = height_at(dem, points[:, 0], points[:, 1]) + lift - points[:, 2]
    return max(float(np.max(np.where(np.isfinite(depth), depth, 0.0))), 0.0)
