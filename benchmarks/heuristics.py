"""What the old rules of thumb cost: how many steps each makes unplannable that can be planned without it.

The rules are settings of a step: waypoints straight above start and goal (``lift``), a swing over raised ground
(``raise_terrain``), and a buffer around the leg (``clearance``). Every other check is the same.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.timing import SEED, Figure
from footfall.core.frames import apply
from footfall.maps.layers import COLLISION, REACHABLE_STABLE, REACHABLE_UNSTABLE, UNSURE
from footfall.planning.answers import Status
from footfall.planning.step.problem import StepSettings
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field

BARE = {"lift": 0.05, "raise_terrain": 0.0, "clearance": 0.0}
"""Hardly a lift, no raised ground, no buffer: what a step needs that only has to keep the robot's own clearances."""
RULES = {
    "waypoints_20cm": {**BARE, "lift": 0.2},
    "raised_15cm": {**BARE, "lift": 0.2, "raise_terrain": 0.15},
    "buffer_5cm": {**BARE, "lift": 0.2, "clearance": 0.05},
    "raised_and_buffer": {"lift": 0.3, "raise_terrain": 0.15, "clearance": 0.05},
}
"""A swing over raised ground begins above it, so raising asks for the waypoints too, and a buffer for higher ones."""


@cache
def scene() -> tuple[Dem, RobotState]:
    """A quarter of the ground under rocks of up to 0.8 m, and the rover on it."""
    ground = rock_field(size=8.0, resolution=0.04, abundance=0.25, largest=0.8, seed=SEED)
    return ground, footfall.stand(robot(), ground)


def problems(count: int) -> list[tuple[int, float, float]]:
    """Seeded footfalls that a leg reaches, 0.2 to 0.8 m from where its foot is: (leg, x, y).

    Not only those that the maps show as free: the maps ask for room 20 cm above a footfall, which is one of the rules.
    """
    rng = np.random.default_rng(SEED)
    dem, state = scene()
    wheels = apply(state.T_site_base, wheel_centers(robot(), state.posture))
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    reached = (REACHABLE_STABLE, REACHABLE_UNSTABLE, COLLISION, UNSURE)
    out = []
    for leg in robot().legs:
        footing = np.asarray(footfall.compute_maps(robot(), dem, state, leg=leg).layers["footing"])
        away = np.hypot(x - wheels[leg, 0], y - wheels[leg, 1])
        cells = np.flatnonzero(np.isin(footing, reached) & (away >= 0.2) & (away <= 0.8))
        chosen = rng.choice(cells, min(count // robot().leg_count, len(cells)), replace=False)
        out += [(leg, float(x.flat[cell]), float(y.flat[cell])) for cell in chosen]
    return out


def plannable(problem: tuple[int, float, float], rule: dict[str, float]) -> bool:
    """Whether a step of (leg, x, y) is found under a rule."""
    leg, x, y = problem
    settings = StepSettings(**rule, seed=1, time_limit=20.0)  # type: ignore[arg-type]
    return footfall.plan_step(robot(), *scene(), leg, (x, y), settings=settings).status is Status.FOUND


def figures(quick: bool) -> Iterator[Figure]:
    asked = problems(12 if quick else 120)
    able = [problem for problem in asked if plannable(problem, BARE)]
    yield Figure("heuristics.problems", (len(asked),), "steps")
    yield Figure("heuristics.unplannable_without_any", (len(asked) - len(able),), "steps")
    for name, rule in RULES.items():
        lost = sum(not plannable(problem, rule) for problem in able)
        yield Figure(f"heuristics.{name}_makes_unplannable", (lost,), "steps")
