"""Commands of foot moves with the pose held over rocks: their time, and what the proven bounds save of it.

``python -m benchmarks.foot_moves --terrains 3`` plans short walks, executes foot moves of them and makes commands, with
the proven bounds of planning/stance/nearest_kernel.py and without in turn, the same commands both times.
Processor time of one foot move; of collisions: what finding the nearest distances takes.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.timing import Figure
from footfall.planning.execution.settings import ExecutionSettings
from footfall.planning.stance import whole_body
from footfall.planning.walk_execution.plan import plan_walk_execution
from footfall.sequence.of_execution import sequence_of_execution
from footfall.terrain.generate import rock_field

BOUNDS = ("own_bounds", "ground_bounds")
GAPS = ("own_gap", "ground_gap")
MOVES = 3
"""Foot moves of each walk that are commanded."""


@dataclass
class Took:
    """Processor time [s] of all and of what is spent in collisions, and the digest of the commands."""

    whole: float
    collisions: float
    digest: str


def main() -> None:
    """A row for each figure."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--terrains", type=int, default=3)
    found = [one for number in range(parser.parse_args().terrains) for one in walked(number)]
    rows = {
        "foot_moves.whole": ([ours.whole / MOVES for ours, _ in found], "s"),
        "foot_moves.collisions": ([ours.collisions / MOVES for ours, _ in found], "s"),
        "foot_moves.whole_without_bounds": ([without.whole / MOVES for _, without in found], "s"),
        "foot_moves.collisions_without_over_with": ([b.collisions / a.collisions for a, b in found], "ratio"),
        "foot_moves.other_commands": ([float(a.digest != b.digest) for a, b in found], ""),
    }
    for name, (samples, unit) in rows.items():
        print(name, Figure(name, tuple(samples), unit).as_dict(), flush=True)


def walked(number: int) -> Iterator[tuple[Took, Took]]:
    """With the bounds and without, twice in turn, on one terrain."""
    world = rock_field(size=10.0, resolution=0.04, abundance=0.03, smallest=0.1, largest=0.4, seed=number)
    state = footfall.stand(robot(), world)
    walk = footfall.plan_walk(robot(), world, state, (1.0, 0.0), seed=1).plan
    if walk is None:
        return

    def commands() -> str:
        settings = ExecutionSettings(mode="pose_held")
        done = plan_walk_execution(robot(), world, state, walk, settings, count=MOVES).execution
        return "" if done is None else sequence_of_execution(done, robot(), world).digest

    commands()
    for _ in range(2):
        ours = took(commands)
        with without_bounds():
            yield ours, took(commands)


def took(commands: Callable[[], str]) -> Took:
    """What commands take."""
    spent = [0.0]
    kept = {name: getattr(whole_body.WholeBody, name) for name in GAPS}

    def timed(gap: Callable[..., Any]) -> Callable[..., Any]:
        def call(*asked: Any, **named: Any) -> Any:
            began = time.process_time()
            nearest = gap(*asked, **named)
            spent[0] += time.process_time() - began
            return nearest

        return call

    for name, gap in kept.items():
        setattr(whole_body.WholeBody, name, timed(gap))
    try:
        began = time.process_time()
        digest = commands()
        return Took(time.process_time() - began, spent[0], digest)
    finally:
        for name, gap in kept.items():
            setattr(whole_body.WholeBody, name, gap)


@contextmanager
def without_bounds() -> Iterator[None]:
    """Nothing is proven meanwhile beyond the coarse bounds."""
    kept = {name: getattr(whole_body, name) for name in BOUNDS}

    def coarse_only(bounds: Callable[..., Any]) -> Callable[..., Any]:
        def call(*asked: Any) -> Any:
            coarse, finer, *boxes = bounds(*asked)
            return coarse, np.full_like(finer, -np.inf), *boxes

        return call

    for name, bounds in kept.items():
        setattr(whole_body, name, coarse_only(bounds))
    try:
        yield
    finally:
        for name, bounds in kept.items():
            setattr(whole_body, name, bounds)


if __name__ == "__main__":
    sys.exit(main())
