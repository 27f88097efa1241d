"""Stances, maps, steps, walks and routes of any robot: its class says which planner is asked, here alone."""

from collections.abc import Callable
from functools import update_wrapper
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from footfall.planning.legged.leg_maps import compute_maps as compute_legged_maps
from footfall.planning.legged.route_to import plan_route as plan_legged_route
from footfall.planning.legged.stand import stand as stand_legged
from footfall.planning.legged.step import plan_step as plan_legged_step
from footfall.planning.legged.walk import plan_walk as plan_legged_walk
from footfall.planning.route.plan import plan_route as plan_rover_route
from footfall.planning.step.leg_maps import compute_maps as compute_rover_maps
from footfall.planning.step.plan import plan_step as plan_rover_step
from footfall.planning.walk.plan import plan_walk as plan_rover_walk
from footfall.planning.walk.stand_to_walk import stand as stand_rover
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot

OfRover = ParamSpec("OfRover")
OfLegged = ParamSpec("OfLegged")
ForRover = TypeVar("ForRover")
ForLegged = TypeVar("ForLegged")


class ByRobot(Generic[OfRover, ForRover, OfLegged, ForLegged]):
    """One function for two kinds of robot; it presents itself as that of ATHLETE's build."""

    def __init__(
        self,
        rover: Callable[Concatenate[Robot, OfRover], ForRover],
        legged: Callable[Concatenate[LeggedRobot, OfLegged], ForLegged],
    ) -> None:
        update_wrapper(self, rover)
        self._rover, self._legged = rover, legged

    @overload
    def __call__(self, robot: Robot, *args: OfRover.args, **kwargs: OfRover.kwargs) -> ForRover: ...
    @overload
    def __call__(self, robot: LeggedRobot, *args: OfLegged.args, **kwargs: OfLegged.kwargs) -> ForLegged: ...
    def __call__(self, robot: Any, *args: Any, **kwargs: Any) -> Any:
        """Asks the function that is for the kind of ``robot``, with the arguments that follow it."""
        chosen: Any = self._legged if isinstance(robot, LeggedRobot) else self._rover
        return chosen(robot, *args, **kwargs)


stand = ByRobot(stand_rover, stand_legged)
compute_maps = ByRobot(compute_rover_maps, compute_legged_maps)
plan_step = ByRobot(plan_rover_step, plan_legged_step)
plan_walk = ByRobot(plan_rover_walk, plan_legged_walk)
plan_route = ByRobot(plan_rover_route, plan_legged_route)
