"""Terrain from photographed pairs of any calibrated cameras: rectified, matched, laid onto one map."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from footfall.core.errors import InvalidImages
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.telemetry.photographs import PhotographedPair, Photographs
from footfall.telemetry.state import RobotState
from footfall.terrain.build import (
    all_samples,
    build_terrain,
    dem_of,
    grid_around,
    site_points_of,
)
from footfall.terrain.dem import Dem
from footfall.terrain.matched import Exchange, Matched, match_pairs
from footfall.terrain.pairs.bundle_adjustment import refine
from footfall.terrain.pairs.rectify import rectify
from footfall.terrain.terrain_settings import TerrainSettings


def terrain_from_photographs(
    photographs: Photographs,
    settings: TerrainSettings | None = None,
    progress: Progress = no_progress,
    robot: Robot | LeggedRobot | None = None,
    state: RobotState | None = None,
    refined: bool = False,
) -> Dem:
    """The ground that all usable pairs see; the others stand in the Dem's ``name`` and ``left_out``.

    robot, state: whose cameras these are, and how it stands: its body is taken out of the images. Without them the
    images show no robot, and the map is centred on what they see.
    refined: first turn cameras and pairs as all images together say (:mod:`footfall.terrain.pairs.bundle_adjustment`);
    the name of the map tells. Raises InvalidImages where no pair can be used.
    """
    settings = settings or TerrainSettings()
    pairs, left_out = rectified(photographs, settings, part(progress, 0.0, 0.1))
    suffix = ""
    if refined:
        pairs, found = refine(pairs, part(progress, 0.1, 0.4))
        suffix = f", {found.text}"
    watched = part(progress, 0.4 if refined else 0.1, 1.0)
    parents = {"photographs": photographs.digest}
    taken = {one.name: one for one in photographs.pairs}

    def exchanged(name: str) -> ImagePair:
        one = taken[name]
        return _rectified(replace(one, left=one.right, right=one.left), settings)

    if robot is None or state is None:
        dem = terrain_from_pairs(pairs, settings, watched, left_out, exchange=exchanged)
    else:
        dem = build_terrain(robot, Snapshot(state, pairs, left_out), settings, watched, exchange=exchanged)
        parents |= {"robot": robot.digest, "state": state.digest}
    return replace(dem, name=dem.name + suffix, provenance=Provenance(parents, settings))


def rectified(
    photographs: Photographs, settings: TerrainSettings, progress: Progress = no_progress
) -> tuple[tuple[ImagePair, ...], dict[str, str]]:
    """The rectified pairs, and why each other pair was left out. Raises InvalidImages where none is left."""
    pairs, left_out = [], dict(photographs.left_out)
    for i, taken in enumerate(photographs.pairs):
        progress(i / len(photographs.pairs), f"rectifying {taken.name}")
        try:
            pairs.append(_rectified(taken, settings))
        except InvalidImages as err:
            left_out[taken.name] = err.message
    if not pairs:
        raise InvalidImages("no image pair can be used: " + "; ".join(left_out.values()), pairs=left_out)
    return tuple(pairs), left_out


def _rectified(taken: PhotographedPair, settings: TerrainSettings) -> ImagePair:
    if np.array_equal(taken.left, taken.right):
        # two lenses would rectify it to two images
        raise InvalidImages(f"pair {taken.name}: left and right are one and the same image", pair=taken.name)
    return rectify(
        replace(taken.calibration, name=taken.name),
        taken.left,
        taken.right,
        time=taken.time,
        time_right=taken.time_right,
        T_site_base=taken.T_site_base,
        max_skew=settings.max_skew,
        view=settings.view,
    )


def terrain_from_pairs(
    pairs: Sequence[ImagePair],
    settings: TerrainSettings | None = None,
    progress: Progress = no_progress,
    left_out: Mapping[str, str] | None = None,
    center: tuple[float, float] | None = None,
    exchange: Exchange | None = None,
) -> Dem:
    """The ground seen by rectified pairs that show no robot, in the site frame of their ``T_site_base``.

    Args:
        pairs: rectified.
        settings: of matching, gridding and fusion; None: as delivered.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.
        left_out: pairs that could not be used before, with the reasons; None: none.
        center: of the map, (x, y) in site [m]; None: the middle of what all pairs see.
        exchange: see :func:`footfall.terrain.matched.match_pairs`.

    Returns:
        The ground.

    Raises:
        InvalidImages: no pair can be used, or nothing lies in range.
    """
    settings = settings or TerrainSettings()
    matched, name, reasons = match_pairs(pairs, settings, progress, left_out, exchange)
    if center is None:
        seen = np.concatenate([_seen(one, settings) for one in matched], axis=1)
        if seen.shape[1] == 0:
            raise InvalidImages(f"{name}: nothing lies within {settings.max_range} m")
        center = float(np.median(seen[0])), float(np.median(seen[1]))
    geometry = grid_around(*center, settings)
    samples = all_samples(matched, len(matched), np.eye(4), geometry, settings, progress)
    used = [one.pair for one in matched]
    provenance = Provenance({pair.name: pair.digest for pair in pairs}, settings)
    dem = dem_of(samples, used, geometry, settings, name, provenance)
    progress(1.0, f"{np.isfinite(dem.heights).mean():.0%} of the cells known")
    return replace(dem, left_out=reasons)


def _seen(matched: Matched, settings: TerrainSettings) -> np.ndarray:
    """Points of the ground, x and y, (2, n)."""
    points = site_points_of(matched, settings)[0]
    return points[:2, np.isfinite(points[2])]
