"""Whether a route leads around what ended a straight walk."""

import numpy as np

from footfall.planning.legged.problem import LeggedState
from footfall.planning.legged.route_to import plan_route
from footfall.planning.walk.problem import WalkGoal
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem

LONGER = 1.02
"""A route so many times as long as the straight way goes around something."""


def way_round(robot: LeggedRobot, dem: Dem, state: LeggedState, goal: WalkGoal) -> str:
    """What to try where a straight walk was not found.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stood at first.
        goal: of the walk.

    Returns:
        That a route leads around, and how long it is; empty where none does.
    """
    found = plan_route(robot, dem, state, (goal.x, goal.y)).plan
    straight = float(np.hypot(*(state.T_site_base[:2, 3] - (goal.x, goal.y))))
    if found is None or found.length <= LONGER * straight:
        return ""
    return f"a route of {found.length:z.2f} m leads around: plan it, then the walk along it"
