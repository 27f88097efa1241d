"""Where a walk to a far goal is planned to first: on the straight way or a route, where ground is known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.planning.route.problem import RouteResult
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
UNKNOWN = "no ground is known on the way to the goal"
Routed = Callable[[tuple[float, float]], RouteResult]
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
    return _on_way(robot, dem, T_site_base, np.array([T_site_base[:2, 3], (goal.x, goal.y)]), goal, farthest)


def next_goal(
    robot: Robot, dem: Dem, T_site_base: Array, goal: WalkGoal, farthest: float, routed: Routed | None = None
) -> WalkGoal | str:
    """Where a walk to a far goal is planned to next, or why there is no such place.

    routed: the route from where the rover stands, or beside it, to a place, x and y [m]; the next goal lies on it, as
    :func:`stage` has it on the straight way. The route goes to the goal, or as far as the ground on the straight way is
    known; where that place is cut off, as near as a route comes. None: straight on.
    """
    if routed is None:
        return stage(robot, dem, T_site_base, goal, farthest) or UNKNOWN
    ahead = stage(robot, dem, T_site_base, goal, np.inf)
    if ahead is None:
        return UNKNOWN
    result = routed((ahead.x, ahead.y))
    if result.plan is None and ahead is not goal and len(result.cut_off) == 2:
        result = routed(result.cut_off)
    if result.plan is None:
        return f"no route leads on: {result.reason}"
    way = _rest(result.plan.points, T_site_base[:2, 3])
    return _on_way(robot, dem, T_site_base, way, goal, farthest) or UNKNOWN


def _rest(way: Array, here: Array) -> Array:
    """What is left of a way (n, 2) from beside it: straight to the end of the part that is nearest, then along it."""
    begin, part = way[:-1], np.diff(way, axis=0)
    share = ((here - begin) * part).sum(axis=1) / np.maximum((part**2).sum(axis=1), 1e-12)
    away = np.linalg.norm(begin + np.clip(share, 0.0, 1.0)[:, None] * part - here, axis=1)
    return np.vstack([here, way[int(np.argmin(away)) + 1 :]])


def _on_way(robot: Robot, dem: Dem, T_site_base: Array, way: Array, goal: WalkGoal, farthest: float) -> WalkGoal | None:
    """As :func:`stage`, on a way (n, 2) that begins where the chassis is."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    length = float(along[-1])
    facing = float(np.arctan2(T_site_base[1, 0], T_site_base[0, 0]))
    leads_there = bool(np.allclose(way[-1], (goal.x, goal.y), rtol=0.0, atol=1e-9))
    yaw = facing if goal.yaw is None else goal.yaw
    if leads_there and length <= farthest and stands_on_known(robot, dem, goal.x, goal.y, yaw):
        return goal
    within = min(goal.within, farthest / 2.0)
    for far in np.arange(min(length, farthest), within, -STRIDE):
        x, y = (float(np.interp(far, along, way[:, axis])) for axis in range(2))
        away = float(np.hypot(*(np.array([x, y]) - way[0])))
        if away > within and stands_on_known(robot, dem, x, y, facing):
            return replace(goal, x=x, y=y, yaw=None, within=within)
    return None


def came_nearest(result: WalkResult) -> WalkGoal | None:
    """Where the chassis was when a search ran out of time: there is a walk that far. At any heading.

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
