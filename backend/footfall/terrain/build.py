"""Stereo images to terrain: match every pair, take the robot out, lay the depths onto one grid, fuse."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.align import align
from footfall.terrain.fusion.fuse import despike, fuse
from footfall.terrain.fusion.grid_depth import CellSamples, grid_depth, site_points, upper_surface
from footfall.terrain.fusion.memory import merge
from footfall.terrain.fusion.visibility import DepthView
from footfall.terrain.pairs import stereo
from footfall.terrain.pairs.epipolar import align_pair, fits
from footfall.terrain.pairs.rectify import require_simultaneous
from footfall.terrain.rover_mask.leg_errors import LegError
from footfall.terrain.rover_mask.posture_fit import fit_posture
from footfall.terrain.rover_mask.selfmask import beside, robot_depths
from footfall.terrain.settings import TerrainSettings

SMEARED = 4
"""Beside its mask the robot may be found so far still, at its own depth [px]: matching smears it over."""

UNMODELLED = 0.002
"""Standard deviation of a height beyond what its images tell [m]: planes over windows, and triangles between pixels,
leave that much of real ground. Heights that claim less were too sure of themselves, most of all where views agree."""

Exchange = Callable[[str], ImagePair]
"""From a pair's name to that pair rectified with its two images exchanged."""

_SWAPPED = "left and right seem to be swapped: exchanged, the images match"


class Matched(NamedTuple):
    """A pair, its disparities, NaN where unknown, and their standard deviations, (height, width) [px]."""

    pair: ImagePair
    disparity: NDArray[np.float32]
    deviation: NDArray[np.float32]


def build_terrain(
    robot: Robot,
    snapshot: Snapshot,
    settings: TerrainSettings | None = None,
    progress: Progress = no_progress,
    map: Dem | None = None,
    exchange: Exchange | None = None,
) -> Dem:
    """The ground around the rover from all stereo pairs of a snapshot, with the rover's own body taken out.

    map: what is remembered so far. With ``settings.keep`` the snapshot is moved onto it, within bounds, and merged
    into it; the result's ``correction`` says how it was moved. Raises InvalidImages where it does not fit.
    Ground that no pair saw stays unknown. A right camera that is turned a little is corrected first, see
    :mod:`footfall.terrain.pairs.epipolar`. That, and pairs that can't be used (black, swapped, not matching, badly
    calibrated, not of one moment) and are left out, stand in the Dem's ``name``, in full in its ``left_out``; raises
    InvalidImages, with the reason of each, where none is left.
    """
    settings = settings or TerrainSettings()
    if snapshot.state.robot != robot.name:
        raise InvalidImages(
            f"the snapshot is of robot {snapshot.state.robot!r}, not of {robot.name!r}: its body could not be removed"
        )
    matched, name, left_out = match_pairs(snapshot.pairs, settings, progress, snapshot.left_out, exchange)
    state, errors = snapshot.state, None
    if settings.fit_legs:
        fit = fit_posture(robot, state.posture, [(one.pair, one.disparity) for one in matched])
        progress(0.7, fit.text)
        state, errors = replace(state, posture=fit.posture), fit.errors
    for pair, disparity, _ in matched:
        without_robot(disparity, pair, robot, state, settings, errors)
    parents = {"snapshot": snapshot.digest, "robot": robot.digest}
    center = snapshot.state.T_site_base[:3, 3]
    if map is None or not settings.keep:
        geometry = grid_around(float(center[0]), float(center[1]), settings)
        samples = all_samples(matched, np.eye(4), geometry, settings, progress)
        dem = dem_of(samples, [one.pair for one in matched], geometry, settings, name, Provenance(parents, settings))
        dem = replace(dem, viewpoint=tuple(float(c) for c in center))
    else:
        dem = _onto(map, matched, center, settings, name, progress)
        dem = replace(dem, provenance=Provenance({**parents, "map": map.digest}, settings))
    dem = replace(dem, left_out=left_out)
    progress(1.0, f"{np.isfinite(dem.heights).mean():.0%} of the cells known")
    return dem


def match_pairs(
    pairs: Sequence[ImagePair],
    settings: TerrainSettings,
    progress: Progress = no_progress,
    left_out: Mapping[str, str] | None = None,
    exchange: Exchange | None = None,
) -> tuple[list[Matched], str, dict[str, str]]:
    """Disparities of all pairs that can be used, what to call their map, and why each other pair was left out.

    left_out: pairs that could not be used before, with the reasons. exchange: of pairs that were not taken rectified:
    tells swapped images. Raises InvalidImages where no pair is left, InvalidInput where the settings name one that is
    not there.
    """
    matched: list[Matched] = []
    reasons = dict(left_out or {})
    not_chosen = settings.not_chosen([*reasons, *(pair.name for pair in pairs)])
    reasons |= {name: f"pair {name}: not chosen" for name in not_chosen}
    pairs = [pair for pair in pairs if pair.name not in not_chosen]
    brief = [f"{name} ({_briefly(name, reason)})" for name, reason in reasons.items()]
    told: list[str] = []
    for i, pair in enumerate(pairs):
        progress(0.7 * i / len(pairs), f"matching {pair.name}")
        try:
            require_simultaneous(pair.name, pair.time, pair.time_right, settings.max_skew)
            pair, alignment = align_pair(pair)
            found = stereo.match(pair, settings)
        except InvalidImages as err:
            swapped = exchange is not None and fits(exchange(pair.name))
            reason = f"pair {pair.name}: {_SWAPPED}" if swapped else err.message
            short = None if swapped else err.details.get("brief")
            reasons[pair.name] = reason
            brief.append(f"{pair.name} ({short or _briefly(pair.name, reason)})")
            continue
        if alignment.corrected or not alignment.checked:
            told.append(alignment.text)
        matched.append(Matched(pair, found.disparity, stereo.deviations(found, pair, settings)))
    if not matched:
        raise InvalidImages("no image pair can be used: " + "; ".join(reasons.values()), pairs=reasons)
    name = "images, 1 pair" if len(matched) == 1 else f"images, {len(matched)} pairs"
    if told:
        name += f", {', '.join(told)}"
    if brief:
        name += f", without {', '.join(brief)}"
    return matched, name, reasons


def _briefly(pair: str, reason: str) -> str:
    """The first clause of why a pair was left out."""
    return re.split(r"[;:,(]", reason.removeprefix(f"pair {pair}: "))[0].strip()


def _onto(
    map: Dem,
    matched: list[Matched],
    center: NDArray[np.float64],
    settings: TerrainSettings,
    name: str,
    progress: Progress,
) -> Dem:
    """The map after all matched pairs were moved onto it and merged into it."""
    progress(0.7, "aligning with the map")
    # what was wrong with the pose at the last snapshot mostly still is: only the change is bounded
    before = np.eye(4) if map.correction is None else map.correction
    points, deviations = _sparse_points(matched, before, settings)
    found = align(map, points, deviations, frames.apply(before, center), settings)
    correction = found.correction @ before
    corrected = frames.apply(correction, center)
    geometry = grid_around(float(corrected[0]), float(corrected[1]), settings)
    samples = all_samples(matched, correction, geometry, settings, progress)
    name = f"{name}, {found.text}"
    new = dem_of(samples, [one.pair for one in matched], geometry, settings, name, Provenance({}))
    new = replace(new, viewpoint=tuple(float(c) for c in corrected), correction=correction)
    progress(0.97, found.text)
    views = tuple(depth_view(one, correction) for one in matched)
    return merge(map, new, settings, views)


def depth_view(matched: Matched, correction: NDArray[np.float64]) -> DepthView:
    """How far each pixel of the left image sees, the camera moved onto the map by p_map = correction @ p_site."""
    pair, disparity, deviation = matched
    camera = pair.camera_left
    focal_baseline = camera.fx * pair.baseline
    known = np.isfinite(disparity + deviation)
    return DepthView(
        inverse_depth=np.maximum((disparity + np.float32(stereo.offset(pair))) / np.float32(focal_baseline), 0.0),
        intrinsics=(camera.fx, camera.fy, camera.cx, camera.cy),
        T_site_camera=correction @ pair.T_site_base @ camera.T_base_camera,
        # one for all: in nineteen of twenty pixels it is smaller
        deviation=(float(np.quantile(deviation[known], 0.95)) if known.any() else 1.0) / focal_baseline,
    )


def all_samples(
    matched: list[Matched],
    correction: NDArray[np.float64],
    geometry: GridGeometry,
    settings: TerrainSettings,
    progress: Progress,
) -> list[CellSamples]:
    """What each pair says of the cells of a grid, its points moved by p_map = correction @ p_site."""
    samples = []
    for i, one in enumerate(matched):
        progress(0.72 + 0.2 * i / len(matched), f"gridding {one.pair.name}")
        samples.append(_samples(one, geometry, settings, correction))
    progress(0.93, "fusing")
    return samples


def _sparse_points(
    matched: list[Matched], correction: NDArray[np.float64], settings: TerrainSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Every few pixels a point of the site (n, 3), and its standard deviation (n,) [m]."""
    points, deviations = [], []
    for one in matched:
        found, depth, deviation = site_points_of(one, settings, correction)
        part = np.zeros(depth.shape, bool)
        part[:: _every(one.pair), :: _every(one.pair)] = True
        part &= np.isfinite(depth)
        points.append(found[:, part].T)
        deviations.append(deviation[part])
    return np.concatenate(points), np.concatenate(deviations)


def _every(pair: ImagePair) -> int:
    """So that each pair gives about as many points."""
    return max(1, round(pair.camera_left.width / 80))


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
    disparity: NDArray[np.float32],
    pair: ImagePair,
    robot: Robot,
    state: RobotState,
    settings: TerrainSettings,
    errors: Sequence[LegError] | None = None,
) -> None:
    """Set to NaN, in place, pixels that show the robot in either image of the pair; errors: of each leg's posture.

    So are those beside it that lie no deeper than it may.
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
    hidden = (in_left[rows, cols] > 0) | (in_right[rows, partner] > 0)
    # rectified cameras see a point at one depth
    depth = stereo.depth(pair, found)
    hidden |= depth <= beside(in_left, SMEARED)[rows, cols]
    hidden |= depth <= beside(in_right, SMEARED)[rows, partner]
    disparity[rows[hidden], cols[hidden]] = np.nan


def site_points_of(
    matched: Matched, settings: TerrainSettings, correction: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Site points (3, height, width), depths and their standard deviations (height, width) [m].

    Points and depths are NaN outside the ranges of the settings, and where too unsure. correction: moves the points,
    p_map = correction @ p_site.
    """
    pair, disparity, deviation = matched
    camera: Camera = pair.camera_left
    depth = stereo.depth(pair, disparity)
    depth[(depth < settings.min_range) | (depth > settings.max_range)] = np.nan
    # z = f·B / (d + offset)
    deviation_of_depth = deviation * depth**2 / (camera.fx * pair.baseline)
    depth[deviation_of_depth > settings.max_deviation] = np.nan
    T_site_camera = pair.T_site_base @ camera.T_base_camera
    if correction is not None:
        T_site_camera = correction @ T_site_camera
    return site_points(depth, (camera.fx, camera.fy, camera.cx, camera.cy), T_site_camera), depth, deviation_of_depth


def _samples(
    matched: Matched, geometry: GridGeometry, settings: TerrainSettings, correction: NDArray[np.float64]
) -> CellSamples:
    points, depth, deviation = site_points_of(matched, settings, correction)
    known = np.where(np.isfinite(depth), matched.disparity, np.float32(np.nan))
    seen = grid_depth(points, known, deviation, matched.pair.left, geometry, settings.max_jump, settings.max_edge)
    return upper_surface(seen, geometry, settings.gate)


def dem_of(
    samples: list[CellSamples],
    pairs: list[ImagePair],
    geometry: GridGeometry,
    settings: TerrainSettings,
    name: str,
    provenance: Provenance,
) -> Dem:
    """One map of the samples of all pairs. Raises InvalidImages where none of them lies on the grid."""
    fused = fuse(samples, geometry, settings.gate)
    heights = despike(fused.heights, settings.despike, settings.min_neighbours)
    known = np.isfinite(heights)
    if not known.any():
        raise InvalidImages(
            f"{name}: none of the matched points lies on the map; choose a larger half_size, max_range or resolution"
        )
    # a height that had to be replaced is less sure by as much as it was off
    variance = fused.variance + UNMODELLED**2 + np.square(fused.heights - heights)
    times = np.array([pair.time for pair in pairs], np.float64)
    return Dem(
        heights,
        geometry,
        name,
        provenance,
        texture=np.where(known, fused.texture, 0).astype(np.uint8),
        variance=np.where(known, variance, np.nan).astype(np.float32),
        count=np.where(known, fused.count, 0).astype(np.uint16),
        time=np.where(known, times[fused.view], np.nan),
        source=np.where(known, fused.view + 1, 0).astype(np.uint8),
        sources=tuple(pair.name for pair in pairs),
    )
