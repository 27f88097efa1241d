"""The ground where feet stand that bear: there the robot tells it better than its images do.

Cameras do not see it, and what they see around it is millimetres off. A foot that bears is on the ground, so the map is
moved up or down onto it, and less so farther away. Where nothing is known the ground goes on as around it.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import GRAVITY
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.planning.compliance.from_telemetry import LEAST_LOAD
from footfall.planning.legged.footing import FEET_OFF, rest
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

MOST_OFF = 0.08
"""Ground is moved by at most this share of the longest leg: beyond it images, or the pose, are wrong."""
FADES = 0.06
"""From the ground that a foot touches to where the map is left as it is, as a share of the longest leg."""
AROUND = 0.25
"""Known ground within this share of the longest leg says how the ground under a foot slopes."""
FEWEST_CELLS = 6
"""With fewer known cells around it, unknown ground under a foot is taken to be level."""
ROUNDS, LEAST = 10, 1e-3
"""Rounds of weighting the cells by how far they lie off the plane of the round before, at least LEAST [m]."""
STEEPEST = 0.45
"""Steeper than this no ground under a foot is taken to be [rad]."""
ROUGH = 0.01
"""Ground around a foot that is farther from it than this and STEEPEST have it is none: the leg was taken for it [m]."""


def ground_told(robot: LeggedRobot, dem: Dem, state: RobotState) -> Dem:
    """The ground as feet have it that bear by telemetry.

    Args:
        robot: the robot.
        dem: the ground as images or a file have it, in site.
        state: of the robot.

    Returns:
        As :func:`ground_under`.
    """
    soles = apply(state.T_site_base, placed(robot, state.posture).soles)
    loads = np.linalg.norm(state.wheel_forces, axis=1)
    return ground_under(robot, dem, soles, np.flatnonzero(loads > LEAST_LOAD * robot.mass * GRAVITY).tolist())


def from_map(provenance: Provenance, ground: Dem, dem: Dem) -> Provenance:
    """Of what was made on :func:`ground_under`, as one that was made on the map: that is what others know.

    Args:
        provenance: of a product.
        ground: what it was made on.
        dem: the map that this ground is of.

    Returns:
        The same with the map among the parents.
    """
    parents = provenance.parents.items()
    told = {name: dem.digest if digest == ground.digest else digest for name, digest in parents}
    return replace(provenance, parents=told)


def ground_under(robot: LeggedRobot, dem: Dem, soles: Array, legs: Iterable[int]) -> Dem:
    """The ground as feet have it that stand on it.

    Args:
        robot: the robot.
        dem: the ground as images or a file have it, in site.
        soles: centres of the feet, (legs, 3) in site [m].
        legs: numbers of those that bear.

    Returns:
        ``dem`` itself where it fits them; else one with other heights around those that it does not fit.
    """
    now = dem
    for leg in legs:
        x, y, z = (float(one) for one in soles[leg])
        radius = float(robot.radii[leg])
        off = z - float(rest(now, x, y, radius).center[2])
        if abs(off) <= FEET_OFF or abs(off) > MOST_OFF * robot.length:
            continue
        now = _with(dem, _moved(robot, now, soles[leg], radius))
    return now


def _with(dem: Dem, heights: NDArray[np.float32]) -> Dem:
    return Dem(heights, dem.geometry, dem.name, dem.provenance)


def _moved(robot: LeggedRobot, dem: Dem, sole: Array, radius: float) -> NDArray[np.float32]:
    """Heights with those around a foot as it has them."""
    grid, heights = dem.geometry, dem.heights
    x, y, z = (float(one) for one in sole)
    east, north = grid.xs[None, :] - x, grid.ys[:, None] - y
    away = np.hypot(east, north)
    inner = 2 * radius + 2 * grid.resolution
    moved = heights.copy()
    holes = np.isnan(moved) & (away <= inner)
    if holes.any():
        a, b = _slope(heights.astype(float) - (z - radius), away, east, north, AROUND * robot.length)
        below = z - radius * float(np.sqrt(1 + a * a + b * b))
        moved[holes] = (below + a * east + b * north)[holes]
    share = np.clip((inner + FADES * robot.length - away) / (FADES * robot.length), 0.0, 1.0)
    off = z - float(rest(_with(dem, moved), x, y, radius).center[2])
    if not abs(off) <= MOST_OFF * robot.length:
        return heights
    return (moved + off * share).astype(np.float32)


def _slope(above: Array, away: Array, east: Array, north: Array, reach: float) -> tuple[float, float]:
    """How much the ground around a foot rises to the east and to the north; 0, 0 where too little is known.

    above: known ground over the lowest point of the foot (rows, cols) [m]. The least sum of distances, not of squares:
    what else was taken for ground there counts for little.
    """
    rows, cols = np.nonzero(np.abs(above) <= ROUGH + np.tan(STEEPEST) * np.where(away <= reach, away, np.nan))
    if len(rows) < FEWEST_CELLS:
        return 0.0, 0.0
    places, rise = np.column_stack([east[0, cols], north[rows, 0]]), above[rows, cols]
    weights, found = np.ones(len(rows)), np.zeros(2)
    for _ in range(ROUNDS):
        found = np.linalg.lstsq(places * weights[:, None], rise * weights, rcond=None)[0]
        weights = 1.0 / np.sqrt(np.maximum(np.abs(rise - places @ found), LEAST))
    steep = float(np.linalg.norm(found))
    share = min(1.0, float(np.tan(STEEPEST)) / steep) if steep > 0 else 1.0
    return float(found[0]) * share, float(found[1]) * share
