"""Routes of robots that others described: the cheapest ground by its goodness, judged by the size of the robot.

Goodness is Morphin's (:mod:`footfall.planning.route.cost`).
"""

import math

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.maps.traversability import traversability
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.problem import LeggedState
from footfall.planning.legged.stance import ASIDE
from footfall.planning.route.cost import FitPlanes, goodness_costs
from footfall.planning.route.plan import RouteGround, cheapest_route, of_goodness
from footfall.planning.route.problem import RouteResult, RouteSettings, settings_by_leg
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem


def plan_route(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    goal: tuple[float, float],
    settings: RouteSettings | None = None,
    progress: Progress = no_progress,
    fit: FitPlanes = traversability,
) -> RouteResult:
    """Plan the cheapest way of the chassis from where it is to ``goal``; ``plan_walk`` takes the robot along it.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stands at first.
        goal: where the chassis is to be, (x, y) in site [m].
        settings: what the way costs and must not cross; None: as delivered, :func:`settings_by_leg`.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        fit: what fits planes to the map.

    Returns:
        The answer; where there is no way it says why.

    Raises:
        InvalidInput: goal or settings make no sense, the state is of another robot, or feasible traversability is
            asked, which is that of six legs of ATHLETE's build.
        InvalidRobot: the robot has no stance at ease.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or settings_by_leg(robot.length)
    if settings.cost != "goodness":
        raise InvalidInput(f'routes of {robot.name} cost by "goodness": the other cost is that of ATHLETE\'s six legs')
    ease = at_ease(robot)
    # all ground counts that feet may come onto: their strokes, and footfalls beside their places at ease
    feet = float(np.linalg.norm(ease.soles[:, :2], axis=1).max()) + ease.stroke + ASIDE * robot.length
    wide = 2 / math.sqrt(math.pi) * feet  # the square of this disc reaches as far to all four sides

    def ground(progress: Progress) -> RouteGround:
        return of_goodness(goodness_costs(robot.digest, wide, dem, settings, progress, fit), dem, settings)

    return cheapest_route(robot, dem, state, goal, settings, ground, progress)
