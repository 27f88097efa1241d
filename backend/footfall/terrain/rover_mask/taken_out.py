"""The rover taken out of what its own cameras see."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.images import ImagePair
from footfall.telemetry.state import RobotState
from footfall.terrain.pairs import stereo
from footfall.terrain.rover_mask.leg_errors import LegError
from footfall.terrain.rover_mask.selfmask import beside, near_rims, robot_depths
from footfall.terrain.terrain_settings import TerrainSettings

SMEARED = 4
"""Beside its mask the robot may be found so far still, at its own depth [px]: matching smears it over."""

NEAR = 16
"""So near to its mask depths must be surer than elsewhere, and a pixel alone shows no ground [px]: what is left of it
there stands on the ground, where a wheel would step."""

APART, BESIDE, MAYBE = 0, 1, 2
"""Of pixels: apart from the robot, near to where it may be, may be it by errors of its posture or of matching."""


def without_robot(
    disparity: NDArray[np.float32],
    pair: ImagePair,
    robot: Robot | LeggedRobot,
    state: RobotState,
    settings: TerrainSettings,
    errors: Sequence[LegError] | None = None,
) -> NDArray[np.uint8]:
    """Set to NaN, in place, the pixels that show the robot in either image of the pair.

    Args:
        disparity: (height, width) [px]; what shows the robot becomes NaN.
        pair: the images.
        robot: the rover.
        state: how the rover stands.
        settings: how wide rims are.
        errors: of each leg's posture; None: what encoders and sag do.

    Returns:
        What the others are, (height, width): APART, BESIDE or MAYBE. Those are MAYBE that lie in its rims, and those
        next to its rims that lie no deeper than it may.
    """
    extra = settings.block_size // 2 + 1
    in_left, in_right = (
        robot_depths(
            robot,
            state,
            camera,
            settings.mask_margin,
            extra,
            errors=errors,
            fitted_margin=settings.fitted_margin,
        )
        for camera in (pair.camera_left, pair.camera_right)
    )
    rows, cols = np.nonzero(np.isfinite(disparity))
    found = disparity[rows, cols]
    partner = np.clip(np.rint(cols - found).astype(np.int64), 0, disparity.shape[1] - 1)
    drawn = np.isinf(in_left[rows, cols]) | np.isinf(in_right[rows, partner])
    disparity[rows[drawn], cols[drawn]] = np.nan
    maybe = (in_left[rows, cols] > 0) | (in_right[rows, partner] > 0)
    # rectified cameras see a point at one depth
    depth = stereo.depth(pair, found)
    maybe |= depth <= beside(in_left, SMEARED)[rows, cols]
    maybe |= depth <= beside(in_right, SMEARED)[rows, partner]
    near_left, near_right = (near_rims(depths, NEAR) for depths in (in_left, in_right))
    near_left[rows, cols] |= near_right[rows, partner]
    kinds = np.where(near_left, BESIDE, APART).astype(np.uint8)
    kinds[rows[maybe], cols[maybe]] = MAYBE
    return kinds
