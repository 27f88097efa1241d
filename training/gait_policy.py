"""Learn which gait goes on from here: ``python -m training.gait_policy --seeds 200 --processes 2 --out gaits.npz``.

Routes over generated ground, each action drawn at random, give transitions; their process is solved by value iteration.
The same seeds give the same table to the last bit, whatever the number of processes.
"""

import argparse
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from footfall.core.value import SOFTWARE_VERSION
from footfall.io.policies import write_policy
from footfall.planning.choice.actions import ACTIONS
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.policy import GaitPolicy, learned
from footfall.planning.choice.reward import reward
from footfall.planning.choice.state import StateSpace
from training.command import add_who_makes, as_many_as, exit_code, length
from training.finished import Finished, Item, completed
from training.grounds import LEARNED
from training.intervals import in_words, ratio, share
from training.route import NO_START, Choose, Route, robot, route_from, walked

METRES = 6.0
"""Of a route that is learned from."""
SETTINGS = ChoiceSettings(space=StateSpace(traversability=(0.05, 0.25), slope_ahead=(0.05,), lean=(0.05,)))
"""Few classes, so that each is seen often: of a hundred routes of 6 m come about a thousand iterations."""
ASIDE = replace(SETTINGS, space=replace(SETTINGS.space, sides=True), actions=ACTIONS)
"""Where it may also choose to go aside."""


def what_rollouts_are_of(metres: float, settings: ChoiceSettings) -> Item:
    """All that they depend on: states, weights and discount are only made of them."""
    of = {"robot": robot().digest, "metres": metres, "version": SOFTWARE_VERSION}
    of |= {"gaits": settings.gaits.digest, "walks": settings.walks.digest}
    return {"routes": of | {name: getattr(settings, name) for name in ("ahead", "speed", "pause")}}


def transitions(routes: Iterable[Route], settings: ChoiceSettings) -> list[SeenTransition]:
    """What was seen on routes, in their order."""
    space, weights = settings.space, settings.weights
    return [
        SeenTransition(
            space.index(one.seen), ACTIONS.index(one.action), reward(one.came, weights), space.index(one.after)
        )
        for route in routes
        for one in route.decisions
    ]


def rolled_out(task: tuple[str, tuple[int, float, ChoiceSettings]]) -> tuple[str, Item]:
    """One route with actions at random."""
    key, (seed, metres, settings) = task
    return key, walked(seed, metres, _at_random(seed), settings).as_json


def _at_random(seed: int) -> Choose:
    rng = np.random.default_rng((seed, *b"actions"))
    return lambda _: ACTIONS[int(rng.integers(len(ACTIONS)))]


def learn(
    path: Path,
    seeds: Sequence[int],
    metres: float,
    settings: ChoiceSettings,
    processes: int = 1,
    scheduler: str | None = None,
) -> GaitPolicy:
    """The policy of routes over these seeds; path: of the file of finished ones; the rest as for ``completed``."""
    finished = Finished(path, what_rollouts_are_of(metres, settings))
    tasks = [(str(seed), (seed, metres, settings)) for seed in seeds]
    routes = [route_from(item) for item in completed(finished, tasks, rolled_out, _tell, processes, scheduler)]
    timed_out = sum(one.timed_out for route in routes for one in route.decisions)
    if timed_out:
        _tell(f"{timed_out} searches were ended by the clock: on another machine the table may differ")
    no_start = sum(route.ended == NO_START for route in routes)
    _tell(f"{len(routes)} routes, {no_start} without a stance to begin from")
    _tell("\n".join(tried(routes)))
    return learned(transitions(routes, settings), settings, robot().digest, len(seeds))


def tried(routes: Iterable[Route]) -> list[str]:
    """In words, what came of each action: how often it was refused, its mishaps, and how fast it goes."""
    decisions = [one for route in routes for one in route.decisions]
    told = []
    for action in ACTIONS:
        came = [one.came for one in decisions if one.action == action]
        refused = in_words(share(sum(one.refused for one in came), len(came)))
        mishaps = in_words(share(sum(bool(one.mishap) for one in came), len(came)))
        pace = in_words(ratio([one.time for one in came], [one.distance for one in came]))
        told.append(f"{action}: {len(came)} iterations; refused {refused}, mishaps {mishaps}; {pace} s/m")
    return told


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=as_many_as(LEARNED), default=200, help="how many routes")
    parser.add_argument("--metres", type=length, default=METRES, help="of each")
    parser.add_argument("--aside", action="store_true", help="let it choose to go aside too; of the same routes")
    add_who_makes(parser)
    parser.add_argument("--out", type=Path, required=True, help="file of the table")
    parser.add_argument("--finished", type=Path, help="file of finished routes; default: beside --out")
    asked = parser.parse_args()
    path = asked.finished or asked.out.with_suffix(".routes.jsonl")
    settings = ASIDE if asked.aside else SETTINGS
    policy = learn(path, LEARNED[: asked.seeds], asked.metres, settings, asked.processes, asked.scheduler)
    write_policy(asked.out, policy)
    space = policy.settings.space
    for state in np.flatnonzero(policy.visits.any(axis=1)):
        worth = ", ".join(
            f"{action} {policy.action_values[state, number]:.2f} ({policy.visits[state, number]})"
            for number, action in enumerate(ACTIONS)
            if policy.visits[state, number]
        )
        print(f"{space.in_words(int(state))}: {ACTIONS[policy.choices[state]]}; {worth}")
    print(f"{asked.out}: {policy.digest}, {int(policy.visits.sum())} iterations, bound {policy.bound:.1e}")
    return 0


if __name__ == "__main__":
    raise SystemExit(exit_code(main))
