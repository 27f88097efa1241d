"""The ground as a choice sees it: what is least, steepest and oldest under the rover and where it may go next."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array, Mask
from footfall.core.frames import rotation
from footfall.core.grid import GridGeometry
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import traversability
from footfall.planning.choice.actions import ASIDE, OFFSET, WALK
from footfall.planning.choice.state import Features
from footfall.planning.route.cost import reach
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

MAPS = MapSettings()
"""Window and limits of the planes that are fitted: about one wheel."""


@dataclass(frozen=True, eq=False)
class GroundLayers:
    """Layers (rows, cols) of a map that features are taken from.

    good: goodness × certainty, 0 where unknown. gradient: rise to east and north, (rows, cols, 2), NaN where unknown.
    ages: [s] before the newest cell, 0 where the map does not say. around: how far the wheels are from the middle of
    the rover [m].
    """

    geometry: GridGeometry
    good: Array
    gradient: Array
    ages: Array
    around: float


def ground_of(robot: Robot, dem: Dem) -> GroundLayers:
    """The ground of a map for a robot."""
    found = traversability(dem, MAPS)
    good = np.nan_to_num(np.asarray(found.goodness, np.float64)) * found.certainty
    ages = np.zeros(dem.geometry.shape)
    if dem.time is not None and np.isfinite(dem.time).any():
        ages = np.nan_to_num(np.nanmax(dem.time) - dem.time)
    return GroundLayers(dem.geometry, good, found.gradient, ages, reach(robot))


def features_at(
    ground: GroundLayers, T_site_base: Array, onto: Array, current: str = WALK, refused: bool = False
) -> Features:
    """Features of a rover that goes straight on.

    Those of the ground under it from here to there, as far around as its wheels are, and of what is as far aside.
    Beyond the map nothing is known.

    Args:
        ground: layers of the map.
        T_site_base: pose of the chassis, (4, 4).
        onto: where it goes, (2,) in site [m].
        current: how the iteration before was gone, one of ACTIONS.
        refused: whether a check refused that.

    Returns:
        The features.
    """
    here, lean = T_site_base[:2, 3], math.acos(min(1.0, max(-1.0, float(T_site_base[2, 2]))))
    way = np.asarray(onto, np.float64) - here
    length = float(np.hypot(*way))
    centers = ground.geometry.centers() - here
    turned = (rotation("z", sign * OFFSET)[:2, :2] @ way for sign in (1.0, -1.0))
    left, right = (_least(ground, _under(ground, centers, here, to)) for to in turned)
    aside = {"aside": max(left, right), "left": left >= right}
    under = _under(ground, centers, here, way)
    if not under.any():
        return Features(0.0, 0.0, lean, 0.0, current, refused, **aside)
    rises = ground.gradient[under] @ (way / max(length, 1e-9))
    rise = float(np.nanmean(rises)) if np.isfinite(rises).any() else 0.0
    oldest = float(ground.ages[under].max())
    return Features(_least(ground, under), math.atan(rise), lean, oldest, current, refused, **aside)


def offset_of(action: str, features: Features) -> float:
    """By how much an action turns away from the goal, to the left positive [rad]."""
    if action not in ASIDE:
        return 0.0
    return OFFSET if features.left else -OFFSET


def _least(ground: GroundLayers, under: Mask) -> float:
    """Of the goodness of some cells, 0 where there are none."""
    return float(ground.good[under].min()) if under.any() else 0.0


def _under(ground: GroundLayers, centers: Array, here: Array, way: Array) -> Mask:
    """Cells (rows, cols) that are as near to the way as wheels are; none where some of that is not on the map.

    centers: of all cells, from here, (rows, cols, 2) [m].
    """
    along = np.clip(centers @ way / max(float(way @ way), 1e-18), 0.0, 1.0)
    near = np.hypot(*np.moveaxis(centers - along[..., None] * way, -1, 0)) <= ground.around
    return near & (not _leaves(ground, here, here + way))


def _leaves(ground: GroundLayers, here: Array, there: Array) -> bool:
    """Whether the ground around the way is not all on the map."""
    west, south, east, north = ground.geometry.bounds
    low, high = np.minimum(here, there) - ground.around, np.maximum(here, there) + ground.around
    return bool(low[0] < west or low[1] < south or high[0] > east or high[1] > north)
