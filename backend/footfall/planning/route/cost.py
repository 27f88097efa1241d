"""What it costs to walk over the ground: goodness × certainty (Morphin), averaged under the rover.

Source: S. Singh, R. Simmons, T. Smith, A. Stentz, V. Verma, A. Yahja, K. Schwehr, "Recent progress in local and global
traversability for planetary rovers" (ICRA 2000).
"""

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, uniform_filter1d

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import Traversability, traversability
from footfall.planning.route.kept_off import outside
from footfall.planning.route.problem import CostGrid, RouteSettings
from footfall.robot.ik import contact_point
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

STANDING = "stand"
"""Name of the posture whose feet a route keeps on known ground."""


class FitPlanes(Protocol):
    """What fits planes to a map: ``traversability``, or what knows those of an earlier one."""

    def __call__(self, dem: Dem, settings: MapSettings, progress: Progress, /) -> Traversability:
        """As ``traversability``."""
        ...


def cost_grid(
    robot: Robot,
    dem: Dem,
    settings: RouteSettings | None = None,
    progress: Progress = no_progress,
    fit: FitPlanes = traversability,
) -> CostGrid:
    """Costs of the map's ground for a robot: :func:`goodness_costs`, as wide as its feet stand.

    progress: may raise Cancelled. Raises InvalidInput as :func:`reach`.
    """
    return goodness_costs(robot.digest, reach(robot), dem, settings or RouteSettings(), progress, fit)


def goodness_costs(
    robot: str, wide: float, dem: Dem, settings: RouteSettings, progress: Progress, fit: FitPlanes = traversability
) -> CostGrid:
    """Costs of the map's ground: 1 / (mean goodness × certainty under a robot).

    A metre over ground half as good costs twice as much. Unknown ground has no certainty, and beyond the map nothing is
    known.

    Args:
        robot: its digest.
        wide: how far from the middle of the chassis its feet stand, at most [m].
        dem: the ground, in site.
        settings: what the way costs and must not cross.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        fit: what fits planes to the map.

    Returns:
        The costs.
    """
    found = fit(dem, settings.maps, progress)
    good = np.nan_to_num(np.asarray(found.goodness, np.float64)) * found.certainty
    geometry, size = coarse_geometry(dem.geometry, settings.resolution)
    side = _side(wide / geometry.resolution)
    mean = _mean_under(blocks(good, size, 0.0).mean(axis=(1, 3)), side)
    with np.errstate(divide="ignore"):
        costs = np.maximum(np.where(mean >= settings.worst, 1.0 / mean, math.inf), 1.0)
    heights = blocks(dem.heights.astype(np.float64), size, math.nan)
    costs[_rise_under(heights, side) > settings.highest] = math.inf
    costs[marked_off(geometry, settings)] = math.inf
    provenance = Provenance({"dem": dem.digest, "robot": robot}, settings)
    return CostGrid(costs, geometry, provenance)


def reach(robot: Robot) -> float:
    """How far from the middle of the chassis the wheels of a standing rover are, at most [m].

    Raises InvalidInput for a robot without a posture STANDING, naming those that it has.
    """
    if STANDING not in robot.description.postures:
        known = ", ".join(robot.description.postures) or "none"
        raise InvalidInput(
            f"a route is as wide as the feet of the posture {STANDING!r}, and {robot.name} has no such posture; "
            f"it has {known}: name one of them {STANDING!r} in its description"
        )
    posture = robot.posture(STANDING)
    feet = np.array([contact_point(robot, posture, leg, np.eye(4)) for leg in robot.legs])
    return float(np.hypot(feet[:, 0], feet[:, 1]).max())


def coarse_geometry(geometry: GridGeometry, resolution: float) -> tuple[GridGeometry, int]:
    """Blocks of cells about as large as ``resolution`` [m], and how many cells a side of one has."""
    size = max(1, round(resolution / geometry.resolution))
    rows, cols = (math.ceil(count / size) for count in geometry.shape)
    shift = 0.5 * (size - 1) * geometry.resolution
    return GridGeometry(geometry.x0 + shift, geometry.y0 + shift, size * geometry.resolution, rows, cols), size


def blocks(layer: Array, size: int, beyond: float) -> Array:
    """A layer in square blocks of cells.

    Args:
        layer: (rows, cols).
        size: side of a block [cells].
        beyond: what stands for the cells that the last blocks lack.

    Returns:
        (rows, size, cols, size) of the blocks.
    """
    rows, cols = (math.ceil(count / size) for count in layer.shape)
    padded = np.full((rows * size, cols * size), beyond)
    padded[: layer.shape[0], : layer.shape[1]] = layer
    return padded.reshape(rows, size, cols, size)


def _side(radius: float) -> int:
    """Side of a square as large as a disc of ``radius``, an odd number of cells."""
    return max(1, 2 * round((radius * math.sqrt(math.pi) - 1.0) / 2.0) + 1)


def _mean_under(layer: Array, side: int) -> Array:
    """Mean over the square around each cell; beyond the map there is 0."""
    return uniform_filter1d(uniform_filter1d(layer, side, 0, mode="constant"), side, 1, mode="constant")


def _rise_under(heights: Array, side: int) -> Array:
    """How far the ground under the rover rises over its mean plane there, at least [m]; heights: of ``blocks``.

    What is unknown rises nowhere. The plane's own rise over the square is left out, so slopes do not count.
    """
    known = np.isfinite(heights)
    count = known.sum(axis=(1, 3)).astype(np.float64)
    mean = np.where(known, heights, 0.0).sum(axis=(1, 3)) / np.maximum(count, 1.0)
    highest = np.where(known, heights, -math.inf).max(axis=(1, 3))
    some = (count > 0).astype(np.float64)
    share = np.maximum(_mean_under(some, side), 1e-9)
    tilt = sum(np.abs(_mean_under(_slope(mean, some, axis), side)) for axis in (0, 1)) / share
    return maximum_filter(highest, side, mode="nearest") - _mean_under(mean * some, side) / share - tilt * (side // 2)


def _slope(mean: Array, some: Array, axis: int) -> Array:
    """Rise from cell to cell along an axis; 0 where a neighbour is unknown."""
    if mean.shape[axis] < 2:
        return np.zeros_like(mean)
    rise = np.gradient(mean, axis=axis)
    known = some * np.minimum(np.roll(some, 1, axis), np.roll(some, -1, axis))
    return np.where(known > 0, rise, 0.0)


def marked_off(geometry: GridGeometry, settings: RouteSettings) -> NDArray[np.bool_]:
    """Cells that the operator keeps the chassis off.

    Any part of them lies in a no-go area, or, where there are corridors, their middle beside all of those.
    """
    x, y = np.meshgrid(geometry.xs, geometry.ys)
    off = np.zeros(geometry.shape, bool)
    if settings.corridors:
        middles = np.column_stack([x.ravel(), y.ravel()])
        off = (outside(middles, settings.corridors) > 0).reshape(geometry.shape)
    half = 0.5 * geometry.resolution
    for area in settings.no_go:
        beside, beyond = (np.maximum(np.abs(one) - half, 0.0) for one in (x - area.x, y - area.y))
        off |= np.hypot(beside, beyond) <= area.radius
    return off
