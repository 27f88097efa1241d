"""Ground and rover that the benchmarks share, made anew from the seed."""

from functools import cache

import footfall
from benchmarks.timing import SEED
from footfall.core.errors import InvalidInput
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field


@cache
def robot() -> Robot:
    return footfall.load_robot("athlete")


@cache
def _scene() -> tuple[Dem, RobotState]:
    """The first of the seeded rock fields on whose middle the rover can stand."""
    for seed in range(SEED, SEED + 20):
        ground = rock_field(size=8.0, resolution=0.02, abundance=0.06, largest=0.5, seed=seed)
        try:
            return ground, footfall.stand(robot(), ground)
        except InvalidInput:
            continue
    raise RuntimeError(f"the rover stands on none of the rock fields {SEED} to {SEED + 19}")


def rocks() -> Dem:
    """8 × 8 m of rocks at 2 cm."""
    return _scene()[0]


def standing() -> RobotState:
    return _scene()[1]
