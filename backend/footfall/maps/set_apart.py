"""What sets each of several places apart from the others: the measure in which it stands alone, with its number."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from footfall.maps.spoken import spoken


@dataclass(frozen=True)
class Measure:
    """words: for whoever is first; unit: as ``spoken`` has it; most: whether more is better."""

    words: str
    unit: str
    most: bool


MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "margin": Measure("most margin", "m", True),
        "away": Measure("nearest", "m", False),
        "slope": Measure("flattest", "rad", False),
        "torque_ratio": Measure("least torque", "share", False),
        "certainty": Measure("best known", "share", True),
        "limit_margin": Measure("most room in the joints", "rad", True),
        "advance": Measure("farthest ahead", "m", True),
        "support": Measure("most of the wheel carried", "share", True),
        "step": Measure("smallest step", "m", False),
        "roughness": Measure("smoothest", "m", False),
        "height_sd": Measure("surest height", "m", False),
        "age": Measure("seen last", "s", False),
    }
)
"""What places are compared in, what an operator asks first at the front. away: how far the foot goes; the others are
layers and factors of those names."""


@dataclass(frozen=True)
class Apart:
    """In what a place is better than the others that were suggested, or how good it is among them.

    measure: of MEASURES; rank: the place's in it, 1 the best, no other place has it; amount in unit; text: all of it
    for a person.
    """

    measure: str
    rank: int
    amount: float
    unit: str
    text: str


def set_apart(amounts: Sequence[Mapping[str, float]]) -> tuple[Apart | None, ...]:
    """For each place (name → amount) its own measure; None where every measure has it like another.

    The first place in any measure comes before the second in any. A measure that is not known of every place compares
    none, and amounts that are spoken alike are equal. No two places have the same measure and rank.
    """
    found: list[Apart | None] = [None] * len(amounts)
    known = [name for name in MEASURES if amounts and all(np.isfinite(one.get(name, np.nan)) for one in amounts)]
    if len(amounts) < 2:
        return tuple(found)
    ranked = {name: _ranked(name, [one[name] for one in amounts]) for name in known}
    for rank in range(1, len(amounts) + 1):
        for name in known:
            at = ranked[name][rank - 1]
            if at is not None and found[at] is None:
                found[at] = _apart(name, rank, amounts[at][name])
    return tuple(found)


def _ranked(name: str, amounts: Sequence[float]) -> list[int | None]:
    """The places by rank, the best first; None for one that shares its rank."""
    measure = MEASURES[name]
    words = [spoken(amount, measure.unit) for amount in amounts]
    ranked = sorted(range(len(amounts)), key=lambda i: -amounts[i] if measure.most else amounts[i])
    return [at if words.count(words[at]) == 1 else None for at in ranked]


def _apart(name: str, rank: int, amount: float) -> Apart:
    measure = MEASURES[name]
    words = measure.words if rank == 1 else f"{_ordinal(rank)} {measure.words}"
    return Apart(name, rank, amount, measure.unit, f"{words}: {spoken(amount, measure.unit)}")


def _ordinal(number: int) -> str:
    ends = {1: "st", 2: "nd", 3: "rd"}
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ends.get(number % 10, 'th')}"
