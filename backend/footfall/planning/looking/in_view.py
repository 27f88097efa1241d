"""Which ground the cameras of a rover would show, by geometry alone: no image is made.

A point counts where both cameras of one pair have it in their image, neither the rover nor the ground is in the way,
and it is as far off as stereo is to be trusted there. Whether its surface can be matched is not known before.

Of robots that others described no image shows where the legs are, and maps leave out all that their outlines, widened
by what may be wrong with them, cover: so does this, and says of some ground beside them that it does not show.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.line_of_sight import in_sight
from footfall.terrain.rover_mask.selfmask import robot_depths
from footfall.terrain.terrain_settings import TerrainSettings

SCALE = 0.25
"""Pixels along each side of the image that the rover's outline is drawn in, relative to the camera's."""
WIDENED, WIDENED_OTHERS = 1, 2
"""The outline is drawn wider by so much, of robots that others described by more [px, of those]."""


def in_view(
    robot: Robot | LeggedRobot,
    dem: Dem,
    state: RobotState,
    points: ArrayLike,
    settings: TerrainSettings | None = None,
    pairs: Sequence[str] | None = None,
) -> NDArray[np.bool_]:
    """Whether images taken as the rover stands would show points.

    Args:
        robot: the rover.
        dem: the ground, in site; where it is unknown it hides nothing.
        state: how the rover stands.
        points: (n, 3) in site [m].
        settings: how a map would be made of the images; None: as delivered.
        pairs: cameras that would be asked for images; None: all.

    Returns:
        (n,).
    """
    points, settings = np.asarray(points, float), settings or TerrainSettings()
    used = settings.pairs or tuple(spec.name for spec in robot.description.cameras)
    seen = np.zeros(len(points), bool)
    for spec in robot.description.cameras:
        left = np.flatnonzero(~seen)
        if spec.name in used and (pairs is None or spec.name in pairs) and len(left):
            seen[left] = _in_pair(robot, dem, state, points[left], spec, settings)
    return seen


def _in_pair(
    robot: Robot | LeggedRobot,
    dem: Dem,
    state: RobotState,
    points: Array,
    spec: CameraPairSpec,
    settings: TerrainSettings,
) -> NDArray[np.bool_]:
    shown = np.ones(len(points), bool)
    cameras = [camera.reduced(SCALE) for camera in (spec.camera_left, spec.camera_right)]
    for look in (_in_image, _beside_rover, _over_ground):
        for camera in cameras:
            at = np.flatnonzero(shown)
            if len(at) == 0:
                return shown
            shown[at] = look(robot, dem, state, points[at], camera, settings)
    return shown


def _in_image(
    _robot: Robot | LeggedRobot, _dem: Dem, state: RobotState, points: Array, camera: Camera, settings: TerrainSettings
) -> NDArray[np.bool_]:
    u, v, depth = _pixels(state, points, camera)
    near = (settings.min_range <= depth) & (depth <= settings.max_range)
    return near & (u >= 0) & (u <= camera.width - 1) & (v >= 0) & (v <= camera.height - 1)


def _beside_rover(
    robot: Robot | LeggedRobot, _dem: Dem, state: RobotState, points: Array, camera: Camera, settings: TerrainSettings
) -> NDArray[np.bool_]:
    u, v, depth = _pixels(state, points, camera)
    described = isinstance(robot, LeggedRobot)
    robots = robot_depths(robot, state, camera, settings.mask_margin, WIDENED_OTHERS if described else WIDENED)
    there = robots[np.rint(v).astype(int), np.rint(u).astype(int)]
    return there == 0 if described else there < depth


def _over_ground(
    _robot: Robot | LeggedRobot, dem: Dem, state: RobotState, points: Array, camera: Camera, _settings: TerrainSettings
) -> NDArray[np.bool_]:
    return in_sight(dem, (state.T_site_base @ camera.T_base_camera)[:3, 3], points)


def _pixels(state: RobotState, points: Array, camera: Camera) -> tuple[Array, Array, Array]:
    """Column, row and depth [m] of points (n, 3), (n,) each."""
    x, y, depth = apply(inverse(state.T_site_base @ camera.T_base_camera), points).T
    with np.errstate(divide="ignore", invalid="ignore"):
        return camera.fx * x / depth + camera.cx, camera.fy * y / depth + camera.cy, depth
