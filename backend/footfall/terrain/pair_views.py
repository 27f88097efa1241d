"""What a terrain is built from, to be looked at: the disparities of each pair, and which of its pixels show the robot.

The same matching, and the same fit of the legs, as :func:`footfall.terrain.build.build_terrain` has.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages, NotFound
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Value, value
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.matched import Matched, match_pairs
from footfall.terrain.pairs import stereo
from footfall.terrain.rover_mask.posture_fit import fit_posture
from footfall.terrain.rover_mask.selfmask import robot_depths
from footfall.terrain.rover_mask.taken_out import MAYBE, without_robot
from footfall.terrain.terrain_settings import TerrainSettings

FREE, RIM, ROBOT = 0, 1, 2
"""Classes of pixels: not the robot; may be it, by errors of its joint angles; it, as its joint angles have it."""

Rgb = tuple[int, int, int]
UNMATCHED_RGB: Rgb = (134, 150, 178)
"""The page's colour of the unknown."""
ROBOT_RGB: Rgb = (255, 0, 170)
RIM_RGB: Rgb = (255, 190, 60)

ENDS = (0.01, 0.99)
"""The colours of disparities go from one quantile to the other: what is beyond them is mostly wrong."""


@value
class PairView(Value):
    """One pair as it was matched.

    disparity: (height, width) [px] of the left image, NaN where nothing was matched; None where the pair can't be used.
    mask: (height, width), of each pixel of the left image FREE, RIM or ROBOT. used: share of the pixels that are left
    when the robot is taken out of both images. ranges: depths [m] of the ends of the colours. reason: why the pair
    can't be used; empty where it can.
    """

    name: str
    disparity: NDArray[np.float32] | None
    mask: NDArray[np.uint8]
    used: float
    ends: tuple[float, float]
    ranges: tuple[float, float]
    reason: str = ""


@value
class SnapshotViews(Value):
    """All pairs of a snapshot. legs: what the images say of where the legs are."""

    pairs: tuple[PairView, ...]
    legs: str

    def of(self, name: str) -> PairView:
        """The view of the pair of that name. Raises NotFound."""
        for one in self.pairs:
            if one.name == name:
                return one
        raise NotFound(f"there is no pair {name!r}; there are {', '.join(one.name for one in self.pairs)}", pair=name)


def snapshot_views(
    robot: Robot | LeggedRobot,
    snapshot: Snapshot,
    settings: TerrainSettings | None = None,
    progress: Progress = no_progress,
) -> SnapshotViews:
    """What a build from all pairs of a snapshot sees in each of them. Pairs that it would leave out say why."""
    settings = settings or TerrainSettings()
    try:
        matched, _, reasons = match_pairs(snapshot.pairs, settings, progress)
    except InvalidImages as err:
        matched, reasons = [], err.details["pairs"]
    state, errors, legs = snapshot.state, None, "the legs are taken to be where the encoders say"
    if settings.fit_legs and matched and isinstance(robot, Robot):
        fit = fit_posture(robot, state.posture, [(one.pair, one.disparity) for one in matched])
        state, errors, legs = replace(state, posture=fit.posture), fit.errors, fit.text
    by_name = {one.pair.name: one for one in matched}
    views = []
    for i, pair in enumerate(snapshot.pairs):
        progress(0.7 + 0.3 * i / len(snapshot.pairs), f"looking for the robot in {pair.name}")
        found = by_name.get(pair.name)
        depths = robot_depths(
            robot,
            state,
            pair.camera_left,
            settings.mask_margin,
            settings.block_size // 2 + 1,
            errors=errors,
            fitted_margin=settings.fitted_margin,
        )
        mask = np.where(np.isinf(depths), ROBOT, np.where(depths > 0, RIM, FREE)).astype(np.uint8)
        if found is None:
            views.append(PairView(pair.name, None, mask, 0.0, (0.0, 0.0), (0.0, 0.0), reasons.get(pair.name, "")))
            continue
        left = found.disparity.copy()
        kinds = without_robot(left, found.pair, robot, state, settings, errors)
        views.append(_view(found, mask, float((np.isfinite(left) & (kinds != MAYBE)).mean())))
    return SnapshotViews(tuple(views), legs)


def _view(found: Matched, mask: NDArray[np.uint8], used: float) -> PairView:
    low, high = (float(one) for one in np.nanquantile(found.disparity, ENDS))
    far, near = (float(one) for one in stereo.depth(found.pair, np.array([low, high], np.float32)))
    return PairView(found.pair.name, found.disparity, mask, used, (low, high), (far, near))


def silhouette(robot: Robot | LeggedRobot, state: RobotState, camera: Camera) -> NDArray[np.bool_]:
    """Pixels (height, width) that show the robot where its joint angles have it; nothing is added for their errors."""
    return np.isinf(robot_depths(robot, state, camera))


def ramp(size: int = 256) -> NDArray[np.uint8]:
    """The colours of disparities from the smallest to the largest, (size, 3): viridis, as the maps have it."""
    steps = np.linspace(0, 255, size).round().astype(np.uint8)[:, None]
    return np.asarray(cv2.applyColorMap(steps, cv2.COLORMAP_VIRIDIS)[:, 0, ::-1], np.uint8)


def disparity_picture(view: PairView) -> NDArray[np.uint8]:
    """Disparities in colours, (height, width, 3); UNMATCHED_RGB where there is none. Raises InvalidImages."""
    if view.disparity is None:
        raise InvalidImages(view.reason, pair=view.name)
    known = np.isfinite(view.disparity)
    low, high = view.ends
    share = np.clip((np.where(known, view.disparity, low) - low) / max(high - low, 1e-6), 0.0, 1.0)
    picture = ramp()[np.rint(255 * share).astype(np.int64)]
    picture[~known] = UNMATCHED_RGB
    return picture


def mask_picture(view: PairView, pair: ImagePair) -> NDArray[np.uint8]:
    """The left image, (height, width, 3), with the robot's pixels tinted and those that may be it striped."""
    picture = np.repeat(pair.left[:, :, None], 3, axis=2)
    rows, cols = np.indices(pair.left.shape)
    stripes = (rows + cols) % 8 < 4
    for where, color in ((view.mask == ROBOT, ROBOT_RGB), ((view.mask == RIM) & stripes, RIM_RGB)):
        picture[where] = (0.45 * picture[where] + 0.55 * np.array(color)).astype(np.uint8)
    return picture
