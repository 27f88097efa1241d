"""The way of the feet that are moved while a plan of a robot that others described is carried out."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.problem import LeggedPlan
from footfall.robot.foot_centers import soles
from footfall.robot.legged.legged_robot import LeggedRobot


def sole_way(robot: LeggedRobot, plan: LeggedPlan) -> list[tuple[str, Array]]:
    """Where the sole of the leg in the air goes, waypoint by waypoint.

    Args:
        robot: the robot.
        plan: of a step or a walk.

    Returns:
        For each waypoint with a leg in the air its phase, and the centre of its sole before it and at it, (2, 3) in
        site [m].
    """
    way = []
    for at in np.flatnonzero(plan.legs >= 0):
        ends = [apply(plan.Ts_site_base[k], soles(robot, plan.waypoints[k])[plan.legs[at]]) for k in (at - 1, at)]
        way.append((plan.phases[at], np.array(ends)))
    return way
