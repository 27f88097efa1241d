"""Walks as an area of ``footfall bench``: what each family of ground takes, and how much of it is solved."""

from collections.abc import Iterator

from benchmarks.timing import Figure
from benchmarks.walks.attempts import attempt
from benchmarks.walks.summary import FLOORS
from benchmarks.walks.terrains import FAMILIES, REPORTED, TRAINING

METRES, LIMIT = 2.75, 60.0


def figures(quick: bool) -> Iterator[Figure]:
    """quick: smooth ground alone, and few terrains."""
    for family in ("smooth",) if quick else FAMILIES:
        metres, floor = max(METRES, FAMILIES[family].least), FLOORS.get(family)
        # the first walk loads what is compiled
        attempt(family, TRAINING[-1], 0, metres, LIMIT)
        made = [attempt(family, number, 0, metres, LIMIT) for number in REPORTED[: 3 if quick else 10]]
        solved = tuple(100.0 * one.found for one in made)
        share = None if floor is None else 100.0 * floor.solved
        yield Figure(f"walk.{family}.solved", (sum(solved) / len(solved),), "%", share, at_most=False)
        found = [one for one in made if one.found]
        if found:
            most = (None, None) if floor is None else (floor.median, floor.p95)
            yield Figure(f"walk.{family}.wall", tuple(one.wall for one in found), "s", most[0], p95_at_most=most[1])
            yield Figure(f"walk.{family}.processor", tuple(one.processor for one in found), "s")
            yield Figure(f"walk.{family}.foot_moves", tuple(float(one.foot_moves) for one in found), "")
