"""Where a walk to a far goal is planned to first: as far as the ground is known, or as an earlier search came."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.planning.step.problem import Status
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.problem import WalkGoal, WalkResult
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

Array = NDArray[np.float64]

STRIDE = 0.1
"""Between two places that are looked at on the way to the goal [m]."""
BESIDE = 0.6
"""A foot may be put so far from where it would be at ease [m]: farther than the shadow of a wheel reaches."""
WORTH_IT = 0.2
"""A search that came no farther than this before its time was over says nothing of where to go [m]."""
_PLACES = np.array(
    [(r * np.cos(a), r * np.sin(a)) for r in (0.0, 0.25, 0.5, 0.75, 1.0) for a in np.pi / 4 * np.arange(8)]
)


def stage(robot: Robot, dem: Dem, T_site_base: Array, goal: WalkGoal, farthest: float) -> WalkGoal | None:
    """The goal, where it is within ``farthest`` [m] and its ground is known; else a place on the straight way to it.

    That is the farthest place within where every foot of a rover at ease has known ground beside it, and the ground
    below the chassis is known; it may face any way there. So that it is not reached already, it is to be met within
    half of ``farthest`` at most. None where there is no such place.
    """
    here = T_site_base[:2, 3]
    way = np.array([goal.x, goal.y]) - here
    length = float(np.linalg.norm(way))
    facing = float(np.arctan2(T_site_base[1, 0], T_site_base[0, 0]))
    if length <= farthest and stands_on_known(robot, dem, goal.x, goal.y, facing if goal.yaw is None else goal.yaw):
        return goal
    within = min(goal.within, farthest / 2.0)
    for far in np.arange(min(length, farthest), within, -STRIDE):
        x, y = here + way * (far / length)
        if stands_on_known(robot, dem, float(x), float(y), facing):
            return replace(goal, x=float(x), y=float(y), yaw=None, within=within)
    return None


def came_nearest(result: WalkResult) -> WalkGoal | None:
    """Where the chassis was when a search ran out of time: walks that far are known to be, at any heading.

    So that it is not reached already, it is to be met within half of the way there at most. None where the time was not
    over, or the search came no farther than WORTH_IT.
    """
    if result.status is not Status.TIME_LIMIT or result.partial is None:
        return None
    way = result.partial.Ts_site_base[:, :2, 3]
    away = float(np.linalg.norm(way[-1] - way[0]))
    if away <= WORTH_IT:
        return None
    x, y = (float(at) for at in way[-1])
    return replace(result.goal, x=x, y=y, yaw=None, within=min(result.goal.within, away / 2.0))


def stands_on_known(robot: Robot, dem: Dem, x: float, y: float, yaw: float) -> bool:
    """Whether the ground below the chassis there is known, and some within BESIDE of every foot of a rover at ease."""
    if not np.isfinite(height_at(dem, x, y)):
        return False
    feet = footprint(robot).at(x, y, yaw)
    places = feet[:, None] + BESIDE * _PLACES
    return bool(np.isfinite(height_at(dem, places[..., 0], places[..., 1])).any(axis=1).all())
