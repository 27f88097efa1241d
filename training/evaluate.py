"""What a learned policy is worth on ground that it never saw: ``python -m training.evaluate gaits.npz --routes 200``.

It is compared with always the same action and with a rule of thumb, on the same routes. Intervals hold 95 %: Wilson's
of the share that arrives, the bootstrap's over routes of all else; differences are paired by route.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import footfall
from footfall.io.policies import read_policy
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.policy import GaitPolicy
from footfall.planning.choice.reward import reward
from footfall.terrain.dem import Dem
from training.choosers import LEARNED, NAMES, chooser
from training.command import add_who_makes, as_many_as, exit_code, length
from training.finished import Finished, Item, completed
from training.gait_policy import what_rollouts_are_of
from training.grounds import UNSEEN, family
from training.intervals import Interval, in_words, mean, ratio, share
from training.route import ARRIVED, NO_START, Route, robot, route_from, walked

METRES = 20.0


def total(route: Route, settings: ChoiceSettings) -> float:
    """The sum of the rewards of a route, without discount."""
    return sum(reward(one.came, settings.weights) for one in route.decisions)


def compared(task: tuple[str, tuple[str, int, float, GaitPolicy, Dem | None]]) -> tuple[str, Item]:
    """One route by one chooser, over made ground or a part of a map."""
    key, (name, seed, metres, policy, of) = task
    route = walked(seed, metres, chooser(name, policy), policy.settings, of)
    return key, {"route": route.as_json, "planning": route.planning}


def figures(routes: Sequence[Route], settings: ChoiceSettings) -> dict[str, Interval]:
    """Of one chooser over its routes that began."""
    metres = [route.metres for route in routes]
    mishaps = [100.0 * sum(bool(one.came.mishap) for one in route.decisions) for route in routes]
    return {
        "time per metre [s]": ratio([sum(one.came.time for one in route.decisions) for route in routes], metres),
        "planning per metre [s]": ratio([route.planning for route in routes], metres),
        "mishaps per 100 m": ratio(mishaps, metres),
        "share that arrives": share(sum(route.ended == ARRIVED for route in routes), len(routes)),
        "reward of a route": mean([total(route, settings) for route in routes]),
    }


def verdicts(routes: Mapping[str, Sequence[Route]], settings: ChoiceSettings) -> list[str]:
    """In words, of each chooser that the learned one is compared with: more reward, less, or no difference shown."""
    told = []
    for name in NAMES:
        if name == LEARNED:
            continue
        pairs = zip(routes[LEARNED], routes[name], strict=True)
        more = mean([total(own, settings) - total(other, settings) for own, other in pairs])
        said = "learning gives more" if more.low > 0 else "learning gives less" if more.high < 0 else "no gain is shown"
        told.append(f"{LEARNED} − {name}: {in_words(more)} reward a route; {said}")
    return told


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="file that training.gait_policy wrote")
    parser.add_argument("--routes", type=as_many_as(UNSEEN), default=200)
    parser.add_argument("--metres", type=length, default=METRES, help="of each")
    parser.add_argument("--map", type=Path, help="terrain file that the routes go over; made ground where none is said")
    add_who_makes(parser)
    parser.add_argument("--finished", type=Path, help="file of finished routes; default: beside the policy")
    asked = parser.parse_args()
    policy = read_policy(asked.policy, robot().digest)
    map_of = None if asked.map is None else footfall.read_terrain(asked.map)
    kind = ".compared" if asked.map is None else f".{asked.map.stem}"
    path = asked.finished or asked.policy.with_suffix(f"{kind}.jsonl")
    seeds = UNSEEN[: asked.routes]
    of = {**what_rollouts_are_of(asked.metres, policy.settings), "policy": policy.digest}
    of |= {} if map_of is None else {"map": map_of.digest}
    tasks = [(f"{name} {seed}", (name, seed, asked.metres, policy, map_of)) for seed in seeds for name in NAMES]
    finished = Finished(path, of)
    items = completed(finished, tasks, compared, _tell, asked.processes, asked.scheduler)
    routes: dict[str, list[Route]] = {name: [] for name in NAMES}
    for (_, (name, *_)), item in zip(tasks, items, strict=True):
        route = route_from(item["route"], item["planning"])
        if route.ended != NO_START:
            routes[name].append(route)
    began = len(routes[LEARNED])
    kinds = ", ".join(sorted({family(seed) for seed in seeds})) if map_of is None else f"over {map_of.name}"
    print(f"{began} of {len(seeds)} routes of {asked.metres:g} m begin with a stance; {kinds}")
    if not began:
        return 1
    for name in NAMES:
        told = "; ".join(f"{what} {in_words(one)}" for what, one in figures(routes[name], policy.settings).items())
        print(f"{name}: {told}")
    print("\n".join(verdicts(routes, policy.settings)))
    return 0


if __name__ == "__main__":
    raise SystemExit(exit_code(main))
