"""One route: iterations straight to a goal, each chosen by what is seen, until it is reached or nothing goes on."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import numpy as np

import footfall
from footfall.core.errors import InvalidInput
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.ground_layers import features_at, ground_of, offset_of
from footfall.planning.choice.iteration import Plan, iterate, onto_of
from footfall.planning.choice.reward import Came
from footfall.planning.choice.state import Features
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from training.grounds import ground, part_of

ARRIVED, STUCK, TOO_LONG, NO_START = "arrived", "stuck", "too long", "no start"
MOST_REFUSED = 4
"""Refusals in a row after which a route ends."""
PATIENCE = 4.0
"""How many times the iterations that a route needs at least it may take."""
AT_GOAL = 0.15
"""Of a route [m]."""

Choose = Callable[[Features], str]


@dataclass(frozen=True)
class Decision:
    """seen: what was chosen from; came: of the action; after: what was seen then. timed_out: see Iteration."""

    seen: Features
    action: str
    came: Came
    after: Features
    timed_out: bool = False


@dataclass(frozen=True)
class Route:
    """seed: of its ground. ended: one of ARRIVED, STUCK, TOO_LONG, NO_START. planning: processor time [s]."""

    seed: int
    ended: str
    decisions: tuple[Decision, ...] = ()
    planning: float = 0.0

    @property
    def metres(self) -> float:
        """How much nearer to the goal it came."""
        return sum(one.came.distance for one in self.decisions)

    @property
    def as_json(self) -> dict[str, Any]:
        """Without the processor time, which is never the same again."""
        return {name: item for name, item in asdict(self).items() if name != "planning"}


@cache
def robot() -> Robot:
    """The default one, once a process."""
    return footfall.load_robot("athlete")


def walked(
    seed: int,
    metres: float,
    choose: Choose,
    settings: ChoiceSettings,
    of: Dem | None = None,
    went: Callable[[RobotState, Plan], None] | None = None,
) -> Route:
    """The route of so many metres over the ground of a seed, or over a part ``of`` a map.

    choose: one of ACTIONS by what is seen. went: is told each plan by which it goes, and the state from which. Raises
    InvalidInput where the map is too small.
    """
    dem = ground(seed, metres) if of is None else part_of(of, seed, metres)
    goal = np.array([0.5 * metres, 0.0])
    try:
        state = footfall.stand(robot(), dem, -0.5 * metres, 0.0)
    except InvalidInput:
        return Route(seed, NO_START)
    seen_ground = ground_of(robot(), dem)
    features = features_at(seen_ground, state.T_site_base, onto_of(state, goal, settings.ahead))
    decisions: list[Decision] = []
    planning, refused = 0.0, 0
    for number in range(int(PATIENCE * metres / settings.ahead) + 1):
        if np.hypot(*(goal - state.T_site_base[:2, 3])) <= AT_GOAL:
            return Route(seed, ARRIVED, tuple(decisions), planning)
        if refused == MOST_REFUSED:
            return Route(seed, STUCK, tuple(decisions), planning)
        action, begun = choose(features), time.process_time()
        done = iterate(robot(), dem, state, action, goal, settings, number, offset_of(action, features))
        planning += time.process_time() - begun
        if went is not None and done.plan is not None:
            went(state, done.plan)
        state, refused = done.state, refused + 1 if done.came.refused else 0
        onto = onto_of(state, goal, settings.ahead)
        after = features_at(seen_ground, state.T_site_base, onto, action, done.came.refused)
        decisions.append(Decision(features, action, done.came, after, done.timed_out))
        features = after
    return Route(seed, TOO_LONG, tuple(decisions), planning)


def route_from(read: dict[str, Any], planning: float = 0.0) -> Route:
    """The route that ``as_json`` was of. Raises KeyError or TypeError where it is none."""
    decisions = tuple(
        Decision(
            Features(**one["seen"]), one["action"], Came(**one["came"]), Features(**one["after"]), one["timed_out"]
        )
        for one in read["decisions"]
    )
    return Route(read["seed"], read["ended"], decisions, planning)
