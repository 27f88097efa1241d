"""How long the motion of a plan takes, which is what ways of walking cost."""

from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.execution.pace import durations
from footfall.planning.gait.problem import GaitPlan
from footfall.planning.walk.problem import WalkPlan
from footfall.robot.model import Robot


def seconds_of(robot: Robot, plan: GaitPlan | WalkPlan, settings: ChoiceSettings) -> float:
    """How long a plan takes [s], by its joints' motion at the share of speed that settings have.

    With what is waited from one foot move to the next; how the rover sags is not in it.
    """
    moving = float(durations(robot, plan.waypoints, plan.phases, settings.speed).sum())
    return moving + settings.pause * len(plan.groups)
