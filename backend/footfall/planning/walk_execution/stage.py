"""Where a walk to a far goal is planned to first: on the straight way or a route, where the rover can stand."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.planning.route.kept_off import kept_off, kept_off_between
from footfall.planning.route.problem import RouteResult, RouteSettings
from footfall.planning.walk.chains import APART
from footfall.planning.walk.choices import WayAhead, way_ahead
from footfall.planning.walk.problem import WalkGoal, WalkResult, WalkSettings
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

CHOICE = 2
"""Footfalls that every leg has to choose from at a place on the way: where a leg has fewer, one that a check refuses
may leave it none."""
UNKNOWN = "no ground is known on the way to the goal"
Routed = Callable[[tuple[float, float]], RouteResult]
WORTH_IT = 0.2
"""A search that came no farther than this before it ended says nothing of where to go [m]."""
_SAME = 1e-6
"""Places so near to each other are the same [m]."""


SEEDS = 3
"""Which footfalls there are to choose from goes by the seed: so many are tried where ground is lacking."""


@dataclass(frozen=True)
class Stage:
    """Where a walk is planned to, and with which settings: their seed leads farthest.

    short: why that is not the goal itself, for a person; empty where it is. left: what is left of the way that was
    looked at, no farther than is planned at once [m].
    """

    goal: WalkGoal
    settings: WalkSettings
    short: str = ""
    left: float = 0.0


def stage(
    robot: Robot, dem: Dem, state: RobotState, goal: WalkGoal, farthest: float, settings: WalkSettings | None = None
) -> Stage | str:
    """The goal, where it is near enough and every leg has a footfall there; else a place on the way to it.

    That is the farthest place near enough on the straight way over known ground where every leg has CHOICE footfalls,
    of those that a walk with these settings is planned with, or with one of the SEEDS that follow on theirs where that
    leads farther; it faces there as it does now. So that it is not reached already, it is to be met within half of
    ``farthest`` at most.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        goal: where the chassis is to be in the end.
        farthest: how near is near enough [m].
        settings: of the walk; None: as delivered.

    Returns:
        The place, or why there is none.
    """
    way = np.array([state.T_site_base[:2, 3], (goal.x, goal.y)])
    return _farthest(robot, dem, state, way, goal, farthest, settings or WalkSettings())


def next_goal(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: WalkGoal,
    farthest: float,
    settings: WalkSettings | None = None,
    routed: Routed | None = None,
    keeps: RouteSettings | None = None,
) -> Stage | str:
    """Where a walk to a far goal is planned to next.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        goal: where the chassis is to be in the end.
        farthest: how far it goes at most [m].
        settings: of the walk; None: as delivered.
        routed: the route from where the rover stands, or beside it, to a place, x and y [m]; the next goal lies on it,
            as :func:`stage` has it on the straight way. The route goes to the goal, or as far as the rover can stand on
            the straight way; where that place is cut off, as near as a route comes. None: straight on.
        keeps: settings of the route: the straight way to the next goal leads no deeper than the rover stands into what
            they keep the chassis off. None: wherever.

    Returns:
        The place, or why there is none.
    """
    if routed is None:
        return stage(robot, dem, state, goal, farthest, settings)
    ahead = stage(robot, dem, state, goal, np.inf, settings)
    if isinstance(ahead, str):
        return ahead
    result = routed((ahead.goal.x, ahead.goal.y))
    if result.plan is None and ahead.goal is not goal and len(result.cut_off) == 2:
        result = routed(result.cut_off)
    if result.plan is None:
        return f"no route leads on: {result.reason}"
    way = _rest(result.plan.points, state.T_site_base[:2, 3])
    return _farthest(robot, dem, state, way, goal, farthest, settings or WalkSettings(), keeps)


def _rest(way: Array, here: Array) -> Array:
    """What is left of a way (n, 2) from beside it: straight to the end of the part that is nearest, then along it."""
    begin, part = way[:-1], np.diff(way, axis=0)
    share = ((here - begin) * part).sum(axis=1) / np.maximum((part**2).sum(axis=1), 1e-12)
    away = np.linalg.norm(begin + np.clip(share, 0.0, 1.0)[:, None] * part - here, axis=1)
    return np.vstack([here, way[int(np.argmin(away)) + 1 :]])


def _farthest(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    way: Array,
    goal: WalkGoal,
    farthest: float,
    settings: WalkSettings,
    keeps: RouteSettings | None = None,
) -> Stage | str:
    """As :func:`stage`, on a way (n, 2) that begins where the chassis is. keeps: as of :func:`next_goal`."""
    best: Stage | str = ""
    on_way = _on_way(robot, dem, state, way, goal, farthest, settings, keeps)
    if on_way is None:
        return UNKNOWN
    # where no foot gets on along the way, the chassis may still get on beside it
    for apart in (APART, np.inf):
        for seed in range(settings.seed, settings.seed + SEEDS):
            found = on_way.farthest(seed, apart)
            if isinstance(found, str):
                best = best or found
            elif not isinstance(best, Stage) or found.left < best.left - _SAME:
                best = found
            if isinstance(best, Stage) and best.left <= _SAME:
                return best
        if isinstance(best, Stage):
            return best
    return best


@dataclass(frozen=True, eq=False)
class _OnWay:
    """A way on which the farthest place is looked for. known: (n,) whether the ground at each pose of it is.

    clear: (n,) whether the straight way to each keeps to where the chassis may be. leads_there: whether it ends at the
    goal. planned: how much of the way is planned at once [m].
    """

    ahead: WayAhead
    known: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    goal: WalkGoal
    leads_there: bool
    planned: float

    def farthest(self, seed: int, apart: float) -> Stage | str:
        """The place with footfalls of one seed; or why there is none. apart: as of :meth:`.WayAhead.choices`."""
        goal, way = self.goal, self.ahead.way
        settings = replace(self.ahead.world.settings, seed=seed)
        counts, xy = self.ahead.choices(seed, apart), way.vectors[:, :2]
        at_end = f"{self.planned:g} m are planned at once"
        if self.leads_there and self.known[-1] and self.clear[-1]:
            last = counts[-1] if goal.yaw is None else self.ahead.turned(goal.yaw).choices(seed, apart)[-1]
            if last.all():
                return Stage(goal, settings)
            at_end = f"with the heading of the goal, {_lacks(xy[-1], last, 1)}"
        within = min(goal.within, self.planned / 2.0)
        on = np.hypot(*(xy - xy[0]).T) > within + _SAME
        for choice in (CHOICE, 1):
            fit = np.flatnonzero(on & self.known & self.clear & (counts >= choice).all(axis=1))
            if len(fit):
                last = int(fit[-1])
                x, y = (float(at) for at in xy[last])
                why = at_end if last == len(xy) - 1 else self._lacks(last + 1, counts, choice)
                place = replace(goal, x=x, y=y, yaw=None, within=within)
                left = way.length - float(way.ways[last])
                return Stage(place, settings, f"it goes first to ({x:z.2f}, {y:z.2f}): {why}", left)
        if not on.any():
            return UNKNOWN
        first = int(np.flatnonzero(on)[0])
        return self._lacks(first, counts, 1)

    def _lacks(self, at: int, counts: NDArray[np.int64], choice: int) -> str:
        """What keeps the rover from stopping at a pose of the way."""
        x, y = xy = self.ahead.way.vectors[at, :2]
        if not self.clear[at]:
            return f"the straight way to ({x:z.2f}, {y:z.2f}) leads through a no-go area or out of the corridors"
        return _lacks(xy, counts[at], choice)


def _on_way(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    way: Array,
    goal: WalkGoal,
    farthest: float,
    settings: WalkSettings,
    keeps: RouteSettings | None,
) -> _OnWay | None:
    """What is looked at of a way (n, 2); None where no ground at all is known."""
    west, south, east, north = dem.geometry.bounds
    through = _first_of(way, min(farthest, float(np.hypot(east - west, north - south))))
    ahead = way_ahead(robot, dem, state, through, settings)
    if ahead is None:
        return None
    leads_there = bool(np.allclose(through[-1], (goal.x, goal.y), rtol=0.0, atol=_SAME))
    places = ahead.way.vectors[:, :2]
    known = np.isfinite(height_at(dem, *places.T))
    clear = np.ones(len(places), bool)
    if keeps is not None:
        clear = kept_off_between(places[0], places, keeps) <= kept_off(places[:1], keeps)[0] + _SAME
    return _OnWay(ahead, known, clear, goal, leads_there, farthest)


def _first_of(way: Array, metres: float) -> Array:
    """The first so many metres of a way (n, 2)."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    if along[-1] <= metres:
        return way
    end = [np.interp(metres, along, way[:, axis]) for axis in range(2)]
    return np.vstack([way[along < metres], end])


def _lacks(place: Array, counts: NDArray[np.int64], choice: int) -> str:
    """What keeps the rover from stopping at a place (2,) of the way, where legs have so many footfalls (legs,)."""
    x, y = place
    leg = int(np.argmin(counts))
    count = int(counts[leg])
    if count >= choice:
        return f"the ground at ({x:z.2f}, {y:z.2f}) is unknown"
    footfalls = f"{count or 'no'} footfall{'' if count == 1 else 's'}"
    return f"at ({x:z.2f}, {y:z.2f}) leg {leg} has {footfalls} on known ground to choose from, {choice} are asked for"


def came_nearest(result: WalkResult) -> WalkGoal | None:
    """Where the chassis was when a search ended without a walk to its goal: there is a walk that far. At any heading.

    So that it is not reached already, it is to be met within half of the way there at most. None where the search came
    no farther than WORTH_IT.
    """
    if result.plan is not None or result.partial is None:
        return None
    way = result.partial.Ts_site_base[:, :2, 3]
    away = float(np.linalg.norm(way[-1] - way[0]))
    if away <= WORTH_IT:
        return None
    x, y = (float(at) for at in way[-1])
    return replace(result.goal, x=x, y=y, yaw=None, within=min(result.goal.within, away / 2.0))
