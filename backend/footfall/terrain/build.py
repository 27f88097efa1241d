"""Stereo images to terrain: match every pair, take the robot out, lay the depths onto one grid, fuse."""

import math
from collections.abc import Iterable
from contextlib import closing
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.core.grid import GridGeometry
from footfall.core.pipelined import pipelined
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.robot.foot_centers import soles
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.align import align
from footfall.terrain.fusion.continued_ground import continued_ground
from footfall.terrain.fusion.fuse import Fused, despike, fuse
from footfall.terrain.fusion.grid_depth import (
    CellSamples,
    grid_depth,
    pixel_sides,
    site_points,
    upper_surface,
    with_pixels,
)
from footfall.terrain.fusion.memory import merge
from footfall.terrain.fusion.visibility import DepthView
from footfall.terrain.matched import Exchange, Matched, match_pairs
from footfall.terrain.pairs import stereo
from footfall.terrain.pairs.refine import off_plane
from footfall.terrain.rover_mask.posture_fit import fit_posture
from footfall.terrain.rover_mask.taken_out import APART, BESIDE, MAYBE, without_robot
from footfall.terrain.terrain_settings import TerrainSettings

UNMODELLED = 0.002
"""Standard deviation of a height beyond what its images tell [m]: planes over windows, and triangles between pixels,
leave that much of real ground. Heights that claim less were too sure of themselves, most of all where views agree."""

AT_WHEEL = 0.2
"""So near to the middle of a wheel doubtful pixels show no ground [m]: where it stands the wheel itself tells more, and
a centimetre too much there would be taken for ground that it leans against."""


def build_terrain(
    robot: Robot | LeggedRobot,
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
    if settings.fit_legs and isinstance(robot, Robot):
        fit = fit_posture(robot, state.posture, [(one.pair, one.disparity) for one in matched])
        progress(0.7, fit.text)
        state, errors = replace(state, posture=fit.posture), fit.errors
    parents = {"snapshot": snapshot.digest, "robot": robot.digest}
    center = snapshot.state.T_site_base[:3, 3]
    wheels = frames.apply(snapshot.state.T_site_base, soles(robot, state.posture))

    def take_out(one: Matched) -> Matched:
        return one._replace(kinds=without_robot(one.disparity, one.pair, robot, state, settings, errors))

    with closing(pipelined(take_out, matched)) as following:
        bare = (one.result() for _, one in following)
        if map is None or not settings.keep:
            geometry = grid_around(float(center[0]), float(center[1]), settings)
            samples = all_samples(bare, len(matched), np.eye(4), geometry, settings, progress)
            pairs = [one.pair for one in matched]
            dem = dem_of(samples, pairs, geometry, settings, name, Provenance(parents, settings), wheels)
            dem = replace(dem, viewpoint=tuple(float(c) for c in center))
        else:
            dem = _onto(map, list(bare), center, wheels, settings, name, progress)
            dem = replace(dem, provenance=Provenance({**parents, "map": map.digest}, settings))
    dem = replace(dem, left_out=left_out)
    progress(1.0, f"{np.isfinite(dem.heights).mean():.0%} of the cells known")
    return dem


def _onto(
    map: Dem,
    matched: list[Matched],
    center: NDArray[np.float64],
    wheels: NDArray[np.float64],
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
    samples = all_samples(matched, len(matched), correction, geometry, settings, progress)
    name = f"{name}, {found.text}"
    wheels = frames.apply(correction, wheels)
    new = dem_of(samples, [one.pair for one in matched], geometry, settings, name, Provenance({}), wheels)
    new = replace(new, viewpoint=tuple(float(c) for c in corrected), correction=correction)
    progress(0.97, found.text)
    views = tuple(depth_view(one, correction) for one in matched)
    return merge(map, new, settings, views)


def depth_view(matched: Matched, correction: NDArray[np.float64]) -> DepthView:
    """How far each pixel of the left image sees, the camera moved onto the map by p_map = correction @ p_site."""
    pair, disparity, deviation = matched[:3]
    camera = pair.camera_left
    focal_baseline = camera.fx * pair.baseline
    inverse_depth = np.maximum((disparity + np.float32(stereo.offset(pair))) / np.float32(focal_baseline), 0.0)
    return DepthView(
        inverse_depth=np.where(matched.kinds == MAYBE, np.float32(np.nan), inverse_depth),
        intrinsics=(camera.fx, camera.fy, camera.cx, camera.cy),
        T_site_camera=correction @ pair.T_site_base @ camera.T_base_camera,
        deviation=deviation / np.float32(focal_baseline),
    )


def all_samples(
    matched: Iterable[Matched],
    count: int,
    correction: NDArray[np.float64],
    geometry: GridGeometry,
    settings: TerrainSettings,
    progress: Progress,
) -> list[tuple[CellSamples, CellSamples]]:
    """What each pair says of the cells of a grid, surely and doubtfully.

    Args:
        matched: pairs with their disparities.
        count: how many those are.
        correction: moves their points, p_map = correction @ p_site, (4, 4).
        geometry: the grid.
        settings: how pixels become cells.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.

    Returns:
        For each pair what sure pixels say, and what others say.
    """
    samples = []
    for i, one in enumerate(matched):
        progress(0.72 + 0.2 * i / count, f"gridding {one.pair.name}")
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
        part &= is_sure(one, deviation, settings) & np.isfinite(depth)
        points.append(found[:, part].T)
        deviations.append(deviation[part])
    return np.concatenate(points), np.concatenate(deviations)


def _every(pair: ImagePair) -> int:
    """So that each pair gives about as many points."""
    return max(1, round(pair.camera_left.width / 80))


def grid_around(x: float, y: float, settings: TerrainSettings) -> GridGeometry:
    """Square grid about a site point; its cell centres lie on whole multiples of the resolution.

    Args:
        x: east, in site [m].
        y: north, in site [m].
        settings: resolution and half side of the grid [m].

    Returns:
        The grid.
    """
    half = round(settings.half_size / settings.resolution)
    col, row = math.floor(x / settings.resolution + 0.5) - half, math.floor(y / settings.resolution + 0.5) - half
    return GridGeometry(
        x0=col * settings.resolution,
        y0=row * settings.resolution,
        resolution=settings.resolution,
        rows=2 * half + 1,
        cols=2 * half + 1,
    )


def site_points_of(
    matched: Matched, settings: TerrainSettings, correction: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """What the pixels of a pair see, in site.

    Args:
        matched: a pair with its disparities.
        settings: between which ranges points count.
        correction: moves the points, p_map = correction @ p_site, (4, 4); None: they stay.

    Returns:
        Points (3, height, width), depths and their standard deviations (height, width) [m]; points and depths are NaN
        out of range, and where they are neither sure nor merely doubtful.
    """
    pair, disparity, deviation = matched[:3]
    camera: Camera = pair.camera_left
    depth = stereo.depth(pair, disparity)
    depth[(depth < settings.min_range) | (depth > settings.max_range)] = np.nan
    # z = f·B / (d + offset)
    deviation_of_depth = deviation * depth**2 / (camera.fx * pair.baseline)
    used = is_sure(matched, deviation_of_depth, settings) | (deviation_of_depth <= settings.doubtful_deviation)
    depth[~used] = np.nan
    return site_points(depth, *_seen_from(pair, correction)), depth, deviation_of_depth


def is_sure(matched: Matched, deviation_of_depth: NDArray[np.float64], settings: TerrainSettings) -> NDArray[np.bool_]:
    """Which pixels show ground by themselves.

    Args:
        matched: a pair with its disparities.
        deviation_of_depth: standard deviation, (height, width) [m].
        settings: how uncertain what is sure may be.

    Returns:
        (height, width).
    """
    most = np.where(matched.kinds == BESIDE, settings.max_deviation_beside, settings.max_deviation)
    return (deviation_of_depth <= most) & (matched.kinds != MAYBE)


def _seen_from(
    pair: ImagePair, correction: NDArray[np.float64] | None
) -> tuple[tuple[float, float, float, float], NDArray[np.float64]]:
    """fx, fy, cx, cy [px] and T_site_camera of the left camera, moved by the correction."""
    camera = pair.camera_left
    T_site_camera = pair.T_site_base @ camera.T_base_camera
    if correction is not None:
        T_site_camera = correction @ T_site_camera
    return (camera.fx, camera.fy, camera.cx, camera.cy), T_site_camera


def _samples(
    matched: Matched, geometry: GridGeometry, settings: TerrainSettings, correction: NDArray[np.float64]
) -> tuple[CellSamples, CellSamples]:
    pair = matched.pair
    points, depth, deviation = site_points_of(matched, settings, correction)
    known = np.where(np.isfinite(depth), matched.disparity, np.float32(np.nan))
    sure = is_sure(matched, deviation, settings)
    focal_baseline = pair.camera_left.fx * pair.baseline
    deviation = np.hypot(deviation, off_plane(matched.disparity, *matched.slopes) * depth**2 / focal_baseline)
    *seen, gaps = grid_depth(points, known, deviation, pair.left, geometry, settings.max_jump, settings.max_edge, sure)
    alone = gaps & sure & (matched.kinds == APART)

    def whole(joined: CellSamples, pixels: NDArray[np.bool_]) -> CellSamples:
        rows, cols = np.nonzero(pixels)
        sides = pixel_sides(rows, cols, depth, matched.slopes, focal_baseline, *_seen_from(pair, correction))
        joined = with_pixels(joined, rows, cols, sides, points, deviation, pair.left, geometry, settings.max_edge)
        return upper_surface(joined, geometry, settings.gate)

    return whole(seen[0], alone), whole(seen[1], gaps & ~alone)


def dem_of(
    samples: list[tuple[CellSamples, CellSamples]],
    pairs: list[ImagePair],
    geometry: GridGeometry,
    settings: TerrainSettings,
    name: str,
    provenance: Provenance,
    wheels: NDArray[np.float64] | None = None,
) -> Dem:
    """One map of the samples of all pairs.

    Args:
        samples: for each pair what sure pixels say, and what others say.
        pairs: the same pairs.
        geometry: the grid.
        settings: how samples are fused.
        name: what the map is called.
        provenance: digests of what it is made of.
        wheels: (k, 3) middles of the wheels that the images may show, in site [m]; None: none.

    Returns:
        The ground, with variance, count, time and source of each cell.

    Raises:
        InvalidImages: no sample lies on the grid.
    """
    fused = fuse([sure for sure, _ in samples], geometry, settings.gate)
    heights = despike(fused.heights, settings.despike, settings.min_neighbours)
    fused, heights = _gone_on_with(fused, heights, samples, geometry, settings, wheels)
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


def _gone_on_with(
    fused: Fused,
    heights: NDArray[np.float32],
    samples: list[tuple[CellSamples, CellSamples]],
    geometry: GridGeometry,
    settings: TerrainSettings,
    wheels: NDArray[np.float64] | None,
) -> tuple[Fused, NDArray[np.float32]]:
    """``fused`` and its despiked heights, in unknown cells with what all samples say where they only go on with it."""
    known = np.isfinite(heights)
    all_of_them = [sure for sure, _ in samples] + [doubtful for _, doubtful in samples]
    more = fuse([one.some(~known.ravel()[one.cell]) for one in all_of_them], geometry, settings.gate)
    tried = np.where(known, heights, more.heights)
    tried = despike(tried, settings.despike, settings.min_neighbours, ~known)
    added = continued_ground(heights, tried, geometry.resolution)
    for x, y, _ in () if wheels is None else wheels:
        added &= np.hypot(geometry.xs - x, (geometry.ys - y)[:, None]) > AT_WHEEL
    view = np.where(more.view < 0, more.view, more.view % len(samples))
    layers = zip(fused, more._replace(view=view), strict=True)
    return Fused(*(np.where(added, new, old) for old, new in layers)), np.where(added, tried, heights)
