"""How many times longer one planner takes than another on the same walks, with an interval."""

from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput

DRAWS = 10_000
"""Samples of the bootstrap (Efron, "Bootstrap methods: another look at the jackknife", 1979)."""


@dataclass(frozen=True)
class Ratio:
    """The median ratio of paired times and its 95 % interval; at_least: of how many pairs it is only a lower bound."""

    median: float
    low: float
    high: float
    at_least: int


def paired_ratio(peer: Array, ours: Array, limit: float, seed: int = 0) -> Ratio:
    """Of the peer's times (n,) to ours (n,) [s]; a time of the peer that is not finite counts as ``limit`` [s].

    That makes the ratio of such a pair smaller than it is. A walk that we don't find has no ratio: raises InvalidInput,
    as it does where there is no pair.
    """
    if not len(peer) or len(peer) != len(ours) or not (np.isfinite(ours) & (ours > 0.0)).all():
        raise InvalidInput("paired times are of the same walks, ours finite and above zero", pairs=len(ours))
    unsolved = ~np.isfinite(peer)
    ratios = np.where(unsolved, limit, peer) / ours
    rows = np.random.default_rng(seed).integers(len(ratios), size=(DRAWS, len(ratios)))
    low, high = np.percentile(np.median(ratios[rows], axis=1), [2.5, 97.5])
    return Ratio(float(np.median(ratios)), float(low), float(high), int(unsolved.sum()))
