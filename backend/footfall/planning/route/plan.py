"""Plan a route to a goal over the ground that a map knows, or say why there is none and where it is cut off."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.maps.traversability import traversability
from footfall.planning.answers import Status
from footfall.planning.route.coarse import cheapest_way
from footfall.planning.route.cost import FitPlanes, cost_grid, marked_off
from footfall.planning.route.feasible import (
    FORBIDDEN,
    FeasibleGround,
    LookForFootfalls,
    feasible_cost_grid,
    feasible_ground,
)
from footfall.planning.route.headings import Faced, faced, pieces
from footfall.planning.route.problem import CostGrid, Route, RouteResult, RouteSettings
from footfall.planning.route.turns import way_with_turns
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.extent import spans
from footfall.terrain.ground.surface import height_at


def plan_route(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: tuple[float, float],
    settings: RouteSettings | None = None,
    progress: Progress = no_progress,
    look: LookForFootfalls = feasible_ground,
    fit: FitPlanes = traversability,
) -> RouteResult:
    """Plan the cheapest way of the chassis from where it is to ``goal``.

    What it costs over a cell is that at the cheapest heading. Where turning costs, the way found so gets its cheapest
    headings; searched ``together``, it is another way where that is cheaper with its turns. Which footfalls are taken
    is not said: see ``plan_walk``.

    Args:
        robot: the rover, of ATHLETE's build.
        dem: the ground, in site.
        state: how the rover stands at first.
        goal: where the chassis is to be, (x, y) in site [m].
        settings: what the way costs and must not cross; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        look: what makes feasible traversability of the map, asked where the cost is "feasible".
        fit: what fits planes to the map, asked where it is not.

    Returns:
        The answer; where there is no way it says why.

    Raises:
        InvalidInput: goal or settings make no sense, the state is of another robot, the robot has no posture "stand",
            or feasible traversability is asked for a robot that does not have six legs evenly around.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or RouteSettings()

    def ground(progress: Progress) -> RouteGround:
        return _ground(robot, dem, settings, progress, look, fit)

    return cheapest_route(robot, dem, state, goal, settings, ground, progress)


class RouteGround(NamedTuple):
    """What routes are looked for on. why: what forbids a place x, y [m], in words. by_heading: where headings cost."""

    grid: CostGrid
    why: Callable[[tuple[float, float]], str]
    by_heading: FeasibleGround | None = None


class Standing(Protocol):
    """How a robot stands: what a route begins from."""

    @property
    def robot(self) -> str:
        """Its name."""
        ...

    @property
    def T_site_base(self) -> NDArray[np.float64]:
        """Pose of the chassis, (4, 4)."""
        ...

    @property
    def digest(self) -> str:
        """Of the state."""
        ...


def cheapest_route(
    robot: Robot | LeggedRobot,
    dem: Dem,
    state: Standing,
    goal: tuple[float, float],
    settings: RouteSettings,
    costs: Callable[[Progress], RouteGround],
    progress: Progress = no_progress,
) -> RouteResult:
    """The cheapest way over ground whose costs are asked for once start and goal are found to make sense.

    Args:
        robot: who is to go.
        dem: the ground, in site.
        state: how the robot stands at first.
        goal: where the chassis is to be, (x, y) in site [m].
        settings: what the way costs and must not cross.
        costs: makes the costs.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; where there is no way it says why.

    Raises:
        InvalidInput: goal or settings make no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    if not isinstance(settings, RouteSettings):
        raise InvalidInput("a route takes RouteSettings")
    if len(goal) != 2 or not np.isfinite(goal).all():
        raise InvalidInput("the goal of a route needs finite x and y [m]", goal=list(goal))
    if state.robot != robot.name:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    there = (float(goal[0]), float(goal[1]))
    provenance = Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest}, settings)

    def no(status: Status, reason: str, cut_off: tuple[float, ...] = ()) -> RouteResult:
        return RouteResult(status, None, reason, there, provenance, cut_off)

    here = (float(state.T_site_base[0, 3]), float(state.T_site_base[1, 3]))
    west, south, east, north = dem.geometry.bounds
    for (x, y), status, what, remedy in (
        (here, Status.START_INVALID, "the rover at", "take images where it stands, or choose another map"),
        (there, Status.OFF_MAP, "the goal", "choose one inside"),
    ):
        if not (west <= x < east and south <= y < north):
            return no(status, f"{what} ({x:g}, {y:g}) lies off the map: {spans(dem.geometry)}; {remedy}")
    if not np.isfinite(height_at(dem, *there)):
        reason = f"the ground at the goal ({there[0]:g}, {there[1]:g}) is unknown; take images that show it"
        return no(Status.UNKNOWN_GROUND, reason)
    grid, why, ground = costs(part(progress, 0.0, 0.5))
    free, off = np.isfinite(grid.costs), marked_off(grid.geometry, settings)
    if not free.any():
        if off.all():
            return no(Status.NO_PATH, f"no-go areas and corridors leave nothing of the map; {_DRAW}")
        return no(Status.NO_PATH, f"no ground of the map is good enough to walk on; {_try(settings)}")
    for place, status, what, elsewhere in (
        (here, Status.START_INVALID, "the rover is", "move the rover there"),
        (there, Status.GOAL_INVALID, "the goal lies", _OTHER),
    ):
        row, col = _cell(grid, place)
        if not free[row, col]:
            x, y = _nearest(grid, free, place)
            away = math.dist(place, (x, y))
            reason = f"{what} on {why(place)}; the nearest that is better is {away:z.2f} m away"
            nearest = (x, y) if status is Status.GOAL_INVALID else ()
            remedy = f"{_DRAW if off[row, col] else _BETTER}, or {elsewhere}"
            return no(status, f"{reason}, at ({x:z.2f}, {y:z.2f}); {remedy}", nearest)
    points, cost = cheapest_way(grid.geometry, grid.costs, here, there, part(progress, 0.5, 1.0))
    if not len(points):
        regions = np.empty(free.shape, np.int32)
        label(free, output=regions)
        x, y = _nearest(grid, regions == regions[_cell(grid, here)], there)
        reason = (
            f"no way leads to the goal: it ends at ({x:z.2f}, {y:z.2f}), {math.dist(there, (x, y)):z.2f} m before it, "
            f"where all ground around is too bad, too high, unknown or no-go; {_try(settings)}"
        )
        return no(Status.NO_PATH, reason, (x, y))
    headings = None
    if settings.turning and ground is not None:
        yaw = math.atan2(state.T_site_base[1, 0], state.T_site_base[0, 0])
        found = _with_headings(ground, points, (here, there), yaw, settings, part(progress, 0.5, 1.0))
        if isinstance(found, tuple):
            x, y = found
            otherwise = "" if settings.together else "search way and headings together, as another way may go on, "
            reason = (
                f"the cheapest way leads on at ({x:z.2f}, {y:z.2f}), {math.dist(there, (x, y)):z.2f} m before the "
                f"goal, only at headings that the rover can't turn to there; {otherwise}plan without turning to see "
                f"it, or {_try(settings)}"
            )
            return no(Status.NO_PATH, reason, found)
        points, headings, cost = found.points, found.headings, found.cost
    return RouteResult(Status.FOUND, Route(points, cost, provenance, headings), "", there, provenance)


def _with_headings(
    ground: FeasibleGround,
    points: NDArray[np.float64],
    ends: tuple[tuple[float, float], tuple[float, float]],
    yaw: float,
    settings: RouteSettings,
    progress: Progress,
) -> Faced | tuple[float, float]:
    """The cheapest headings along the way of free turns, or along a cheaper one; or where the first does not go on."""
    ways = [points]
    if settings.together:
        metre = np.array([np.maximum(ground.costs(k), 1.0) for k in range(ground.headings // 2)])
        way, _ = way_with_turns(ground.geometry, metre, *ends, yaw, settings.turning, progress)
        ways += [way] if len(way) else []
    cuts = [pieces(ground.geometry, way) for way in ways]
    found = [faced(cut, costs_along(ground, cut.cells), yaw, settings.turning) for cut in cuts]
    good = [one for one in found if isinstance(one, Faced)]
    return min(good, key=lambda one: one.cost) if good else found[0]


def costs_along(ground: FeasibleGround, cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Of a metre at each heading, (headings, n), in the cheaper of each pair of cells (n, 2, 2), as row and column."""
    rows, cols = cells[..., 0], cells[..., 1]
    half = [np.maximum(ground.costs(k)[rows, cols], 1.0).min(axis=1) for k in range(ground.headings // 2)]
    return np.array(half * 2)


_BETTER = "take images of what is not known, allow worse ground"
_DRAW = "draw the no-go areas or corridors otherwise"
_OTHER = "choose another goal"


def _try(settings: RouteSettings) -> str:
    """What may open a way, with what the operator marked where that is anything."""
    return f"{_BETTER}, {f'{_DRAW}, ' if settings.no_go or settings.corridors else ''}or {_OTHER}"


def _ground(
    robot: Robot, dem: Dem, settings: RouteSettings, progress: Progress, look: LookForFootfalls, fit: FitPlanes
) -> RouteGround:
    if settings.cost != "feasible":
        return of_goodness(cost_grid(robot, dem, settings, progress, fit), dem, settings)
    found = look(robot, dem, settings, progress)
    grid = feasible_cost_grid(found)
    return RouteGround(grid, lambda place: FORBIDDEN[int(found.forbidden[_cell(grid, place)])], found)


def of_goodness(grid: CostGrid, dem: Dem, settings: RouteSettings) -> RouteGround:
    """Ground whose costs are those of its goodness.

    Args:
        grid: the costs.
        dem: the ground, in site.
        settings: what the way costs and must not cross.

    Returns:
        The costs with what forbids a place, in words.
    """
    return RouteGround(grid, lambda place: _why(dem, settings, grid, place))


def _why(dem: Dem, settings: RouteSettings, grid: CostGrid, place: tuple[float, float]) -> str:
    cell = _cell(grid, place)
    if marked_off(grid.geometry, replace(settings, corridors=()))[cell]:
        return "ground that is marked as no-go"
    if marked_off(grid.geometry, settings)[cell]:
        return "ground beside the corridors"
    if not np.isfinite(height_at(dem, *place)):
        return "unknown ground, with too little around it that is known and good"
    return (
        f"ground that is too bad or too little known (mean goodness × certainty under the rover below "
        f"{settings.worst:g}) or rises more than {settings.highest:g} m under it"
    )


def _cell(grid: CostGrid, place: tuple[float, float]) -> tuple[int, int]:
    row, col = grid.geometry.cell(*place)
    return int(np.clip(row, 0, grid.geometry.rows - 1)), int(np.clip(col, 0, grid.geometry.cols - 1))


def _nearest(grid: CostGrid, chosen: NDArray[np.bool_], place: tuple[float, float]) -> tuple[float, float]:
    """The centre x, y [m] of the cell that is nearest to a place, of the chosen ones."""
    centers = grid.geometry.centers()[chosen]
    at = int(np.argmin(np.linalg.norm(centers - place, axis=1)))
    return float(centers[at, 0]), float(centers[at, 1])
