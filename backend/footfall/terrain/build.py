"""Stereo images to terrain: match every pair, take the robot out, lay the depths onto one grid, fuse."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain import stereo
from footfall.terrain.dem import Dem
from footfall.terrain.fuse import despike, fuse
from footfall.terrain.grid_depth import CellSamples, grid_depth, site_points
from footfall.terrain.selfmask import robot_mask
from footfall.terrain.settings import TerrainSettings


def build_terrain(
    robot: Robot, snapshot: Snapshot, settings: TerrainSettings | None = None, progress: Progress = no_progress
) -> Dem:
    """The ground around the rover from all stereo pairs of a snapshot, with the rover's own body taken out.

    Ground that no pair saw stays unknown. Pairs that can't be used (black, swapped, not matching) are left out and
    named in the Dem's ``name``; raises InvalidImages, with the reason of each, where none is left.
    """
    settings = settings or TerrainSettings()
    if snapshot.state.robot != robot.name:
        raise InvalidImages(
            f"the snapshot is of robot {snapshot.state.robot!r}, not of {robot.name!r}: its body could not be removed"
        )
    center = snapshot.state.T_site_base[:2, 3]
    geometry = grid_around(float(center[0]), float(center[1]), settings)
    samples: list[CellSamples] = []
    left_out: dict[str, str] = {}
    for i, pair in enumerate(snapshot.pairs):
        progress(0.95 * i / len(snapshot.pairs), f"matching {pair.name}")
        try:
            disparity = stereo.disparity(pair, settings)
        except InvalidImages as err:
            left_out[pair.name] = err.message
            continue
        progress(0.95 * (i + 0.6) / len(snapshot.pairs), f"gridding {pair.name}")
        without_robot(disparity, pair, robot, snapshot.state, settings)
        samples.append(_samples(pair, disparity, geometry, settings))
    if not samples:
        raise InvalidImages("no image pair can be used: " + "; ".join(left_out.values()), pairs=left_out)
    progress(0.95, "fusing")
    name = "images, 1 pair" if len(samples) == 1 else f"images, {len(samples)} pairs"
    if left_out:
        name += f", without {', '.join(left_out)}"
    parents = {"snapshot": snapshot.digest, "robot": robot.digest}
    dem = _dem(samples, geometry, settings, name, Provenance(parents, settings))
    progress(1.0, f"{np.isfinite(dem.heights).mean():.0%} of the cells known")
    return dem


def terrain_from_pair(
    pair: ImagePair, settings: TerrainSettings | None = None, center: tuple[float, float] | None = None
) -> Dem:
    """The ground seen by one pair that shows no robot, in the site frame of its ``T_site_base``.

    center: of the map, site [m]; by default the middle of what the pair sees. Raises InvalidImages.
    """
    settings = settings or TerrainSettings()
    disparity = stereo.disparity(pair, settings)
    if center is None:
        points, _ = _points(pair, disparity, settings)
        seen = points[:2, np.isfinite(points[2])]
        if seen.shape[1] == 0:
            raise InvalidImages(f"pair {pair.name}: nothing lies within {settings.max_range} m", pair=pair.name)
        center = float(np.median(seen[0])), float(np.median(seen[1]))
    geometry = grid_around(*center, settings)
    samples = [_samples(pair, disparity, geometry, settings)]
    return _dem(samples, geometry, settings, f"image pair {pair.name}", Provenance({"pair": pair.digest}, settings))


def grid_around(x: float, y: float, settings: TerrainSettings) -> GridGeometry:
    """Square grid about a site point; its cell centres lie on whole multiples of the resolution."""
    half = round(settings.half_size / settings.resolution)
    col, row = math.floor(x / settings.resolution + 0.5) - half, math.floor(y / settings.resolution + 0.5) - half
    return GridGeometry(
        x0=col * settings.resolution,
        y0=row * settings.resolution,
        resolution=settings.resolution,
        rows=2 * half + 1,
        cols=2 * half + 1,
    )


def without_robot(
    disparity: NDArray[np.float32], pair: ImagePair, robot: Robot, state: RobotState, settings: TerrainSettings
) -> None:
    """Set to NaN, in place, pixels that show the robot in either image of the pair."""
    extra = settings.block_size // 2 + 1
    in_left = robot_mask(robot, state, pair.camera_left, settings.mask_margin, extra)
    in_right = robot_mask(robot, state, pair.camera_right, settings.mask_margin, extra)
    rows, cols = np.nonzero(np.isfinite(disparity))
    partner = np.clip(np.rint(cols - disparity[rows, cols]).astype(np.int64), 0, disparity.shape[1] - 1)
    hidden = in_left[rows, cols] | in_right[rows, partner]
    disparity[rows[hidden], cols[hidden]] = np.nan


def _points(pair: ImagePair, disparity: NDArray[np.float32], settings: TerrainSettings) -> tuple[NDArray, NDArray]:
    """Site points (3, height, width) and depths (height, width), NaN outside the ranges of the settings."""
    depth = stereo.depth(pair, disparity)
    depth[(depth < settings.min_range) | (depth > settings.max_range)] = np.nan
    camera: Camera = pair.camera_left
    T_site_camera = pair.T_site_base @ camera.T_base_camera
    return site_points(depth, (camera.fx, camera.fy, camera.cx, camera.cy), T_site_camera), depth


def _samples(
    pair: ImagePair, disparity: NDArray[np.float32], geometry: GridGeometry, settings: TerrainSettings
) -> CellSamples:
    points, depth = _points(pair, disparity, settings)
    known = np.where(np.isfinite(depth), disparity, np.float32(np.nan))
    depth_per_pixel = depth**2 / (pair.camera_left.fx * pair.baseline)
    return grid_depth(points, known, depth_per_pixel, pair.left, geometry, settings.max_jump, settings.max_edge)


def _dem(
    samples: list[CellSamples], geometry: GridGeometry, settings: TerrainSettings, name: str, provenance: Provenance
) -> Dem:
    heights, texture = fuse(samples, geometry, settings.gate)
    heights = despike(heights, settings.despike, settings.min_neighbours)
    if not np.isfinite(heights).any():
        raise InvalidImages(
            f"{name}: none of the matched points lies on the map; choose a larger half_size, max_range or resolution"
        )
    texture = np.where(np.isfinite(heights), texture, 0).astype(np.uint8)
    return Dem(heights, geometry, name, provenance, texture)
