"""Ground and rover that the benchmarks share, made anew from the seed."""

from functools import cache

import footfall
from benchmarks.timing import SEED
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field


@cache
def robot() -> Robot:
    return footfall.load_robot("athlete")


@cache
def rocks() -> Dem:
    """8 × 8 m of rocks at 2 cm."""
    return rock_field(size=8.0, resolution=0.02, abundance=0.06, largest=0.5, seed=SEED)


@cache
def standing() -> RobotState:
    return footfall.stand(robot(), rocks())
