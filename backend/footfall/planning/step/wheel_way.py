"""The way of the wheel's centre while a plan is carried out."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.planning.step.problem import StepPlan
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot

TURN = 0.02
"""No joint turns by more between two points of the way [rad]."""


def wheel_way(robot: Robot, plan: StepPlan) -> list[tuple[str, NDArray[np.float64]]]:
    """For each stretch between two waypoints its phase, and points (n, 3) of the wheel's centre, site frame [m].

    Joints turn evenly from waypoint to waypoint, so the wheel goes along a curve; it begins and ends at the waypoints.
    """
    way = []
    for phase, start, end in zip(plan.phases[1:], plan.waypoints[:-1], plan.waypoints[1:], strict=True):
        count = max(1, int(np.ceil(np.abs(end - start).max() / TURN)))
        postures = start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)
        centers = np.array([wheel_centers(robot, posture)[plan.leg] for posture in postures])
        way.append((phase, apply(plan.T_site_base, centers)))
    return way
