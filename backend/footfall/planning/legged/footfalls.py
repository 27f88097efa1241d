"""Where a walk of a legged robot puts its feet."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.planning.legged.problem import LeggedPlan
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed


class Footfall(NamedTuple):
    """leg: the one that moved. point: lowest of its sole, site frame (3,) [m]. row: the waypoint at which it stands."""

    leg: int
    point: NDArray[np.float64]
    row: int


def footfalls(robot: LeggedRobot, plan: LeggedPlan) -> tuple[Footfall, ...]:
    """One for each foot move, in their order; by forward kinematics where the foot was put down."""
    following = (*plan.phases[1:], "")
    rows = [row for row, ends in enumerate(plan.phases) if ends == "lower" and following[row] != "lower"]
    return tuple(
        Footfall(leg, _lowest(robot, plan, row, leg), row) for row in rows if (leg := int(plan.legs[row])) in robot.legs
    )


def _lowest(robot: LeggedRobot, plan: LeggedPlan, row: int, leg: int) -> NDArray[np.float64]:
    sole = apply(plan.Ts_site_base[row], placed(robot, plan.waypoints[row]).soles[leg])
    return sole - [0.0, 0.0, robot.radii[leg]]
