"""Whether the colours of the maps are what the planner says: ``python -m benchmarks.greens --scenes 3 --each 15``.

On seeded rock fields and steep fractals, of every leg's map seeded cells that are green and cells that are purple (in
collision) are planned to. A green cell that no step leads to is a wrong green; a purple one that a step leads to was
named for postures that were not tried: the planner may lean the wheel. Legs that can't be lifted are counted as such.
"""

import argparse
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.timing import Figure
from footfall.core.errors import InvalidInput
from footfall.maps.layers import COLLISION, REACHABLE_STABLE, MapStack
from footfall.planning.answers import Status
from footfall.planning.step.problem import PlanResult, StepSettings
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, rock_field

SEED = 7
STEEP = 0.3
"""Standard deviation of the fractals' heights [m]."""
LIMIT = 20.0
"""Wall clock of one plan [s]."""
WORDS = 40
"""Letters of a reason that make a kind."""
MOST_REFUSED = 0.02
"""Share of the green cells that may be refused."""


def stances(count: int) -> Iterator[tuple[Dem, RobotState]]:
    """Rock fields and steep fractals in turn on whose middle the rover can stand."""
    seed = SEED
    while count:
        if seed % 2:
            dem = rock_field(size=8.0, resolution=0.04, abundance=0.08, largest=0.5, seed=seed)
        else:
            dem = fractal(size=8.0, resolution=0.04, roughness=STEEP, seed=seed)
        seed += 1
        try:
            state = footfall.stand(robot(), dem)
        except InvalidInput:
            continue
        count -= 1
        yield dem, state


def steps(dem: Dem, state: RobotState, stack: MapStack, code: int, count: int) -> Iterator[PlanResult]:
    """Plans of a leg to seeded cells of a class."""
    cells = np.argwhere(stack.layers["footing"] == code)
    rng = np.random.default_rng(SEED + stack.leg)
    for row, col in cells[rng.permutation(len(cells))[:count]]:
        target = float(stack.geometry.xs[col]), float(stack.geometry.ys[row])
        yield footfall.plan_step(
            robot(), dem, state, leg=stack.leg, target=target, settings=StepSettings(seed=1, time_limit=LIMIT)
        )


def kind(reason: str) -> str:
    """What a refusal is about, without its numbers."""
    return "".join("#" if letter.isdigit() else letter for letter in reason)[:WORDS]


@dataclass(frozen=True)
class Looked:
    """What came of the cells that were planned to. greens, purples: of each cell whether a step leads to it.

    refusals: of green cells by kind; grounded: how many legs can't be lifted.
    """

    greens: tuple[bool, ...]
    purples: tuple[bool, ...]
    refusals: Counter[str]
    grounded: int


def look(scenes: Iterable[tuple[Dem, RobotState]], legs: Sequence[int], each: int) -> Looked:
    """Plan to so many cells of each colour for each leg of each scene."""
    greens, purples, refusals, grounded = [], [], Counter(), 0
    for dem, state in scenes:
        for leg in legs:
            stack = footfall.compute_maps(robot(), dem, state, leg=leg)
            grounded += bool(stack.not_lifted)
            for result in steps(dem, state, stack, REACHABLE_STABLE, each):
                greens.append(result.status is Status.FOUND)
                if not greens[-1]:
                    refusals[kind(result.reason)] += 1
            purples += [one.status is Status.FOUND for one in steps(dem, state, stack, COLLISION, each)]
    return Looked(tuple(greens), tuple(purples), refusals, grounded)


def figures(quick: bool) -> Iterator[Figure]:
    looked = look(stances(2 if quick else 4), robot().legs, 4 if quick else 8)
    if looked.greens:
        refused = looked.greens.count(False) / len(looked.greens)
        yield Figure("greens.refused", (refused,), "share", MOST_REFUSED)
    if looked.purples:
        yield Figure("greens.purple_that_could", (sum(looked.purples) / len(looked.purples),), "share")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("--scenes", type=int, default=3)
    parser.add_argument("--each", type=int, default=15, help="cells of each colour for each leg")
    asked = parser.parse_args()
    looked = look(stances(asked.scenes), robot().legs, asked.each)
    refused, could = looked.greens.count(False), sum(looked.purples)
    print(f"green refused {refused} of {len(looked.greens)}, purple that could {could} of {len(looked.purples)}")
    print(f"legs that can't be lifted: {looked.grounded} of {len(robot().legs) * asked.scenes}")
    for text, count in looked.refusals.most_common():
        print(f"{count:4d} {text}")


if __name__ == "__main__":
    main()
