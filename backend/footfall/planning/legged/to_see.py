"""Whether images would show a robot that others described the ground that it does not know, where it has cameras."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.planning.legged.problem import LeggedState
from footfall.planning.legged.stance import Ground
from footfall.planning.looking.how_to_see import ENOUGH, FROM_HERE, unknown_around
from footfall.planning.looking.in_view import in_view
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import terrain_settings_by_leg

AROUND = 2.0
"""Cells around a place whose ground a foot there asks for; of larger feet, as far as they reach."""
ELSEWHERE = "images from here would hardly show it: take them from elsewhere"


def to_see(ground: Ground, state: LeggedState, place: ArrayLike, around: float = 0.0) -> str:
    """What to do to see the unknown ground around a place.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        place: (2,) in site [m].
        around: so far around it at least [m].

    Returns:
        A clause for a refusal; empty where the robot has no cameras, nothing is unknown there, or nothing is known
        anywhere near.
    """
    robot, dem = ground.robot, ground.dem
    if not robot.description.cameras:
        return ""
    radius = max(float(robot.radii.max()), AROUND * dem.geometry.resolution, around)
    unknown = _unknown(dem, np.asarray(place, float), radius, robot.length)
    if len(unknown) == 0:
        return ""
    # cameras ask for no forces
    forces, efforts = np.zeros((len(robot.legs), 3)), np.zeros(len(robot.joint_names))
    told = RobotState(robot.name, 0.0, state.q, state.T_site_base, forces, efforts, "idle", described=robot.layout)
    shown = in_view(robot, dem, told, unknown, terrain_settings_by_leg(robot.length))
    return FROM_HERE if shown.mean() >= ENOUGH else ELSEWHERE


def _unknown(dem: Dem, place: Array, radius: float, most: float) -> Array:
    """Unknown ground around a place, (n, 3) in site; of a hole, so far that its edge is met, up to ``most`` [m]."""
    found = unknown_around(dem, place, radius)
    while len(found) == 0 and np.isnan(height_at(dem, *place)) and radius < most:
        radius *= 2.0
        found = unknown_around(dem, place, radius)
    return found
