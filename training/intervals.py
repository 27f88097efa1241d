"""95 % intervals: Wilson's of a share, the bootstrap's percentiles of a ratio of sums over routes."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_Z = 1.959963984540054
"""Quantile of the normal distribution that 2.5 % lie beyond."""
DRAWS = 4000
SEED = 1


class Interval(NamedTuple):
    """An estimate and the limits around it."""

    at: float
    low: float
    high: float


def share(yes: int, of: int) -> Interval:
    """Of so many that did (E. B. Wilson, "Probable inference, the law of succession, and statistical inference",
    1927)."""
    if not of:
        return Interval(math.nan, 0.0, 1.0)
    p, z2 = yes / of, _Z**2
    middle = (p + z2 / (2 * of)) / (1 + z2 / of)
    half = _Z / (1 + z2 / of) * math.sqrt(p * (1 - p) / of + z2 / (4 * of * of))
    return Interval(p, max(0.0, middle - half), min(1.0, middle + half))


def ratio(over: Sequence[float], under: Sequence[float]) -> Interval:
    """Of sums over routes, routes drawn with replacement (B. Efron, "Bootstrap methods: another look at the jackknife",
    1979): percentiles. NaN where nothing is under."""
    a, b = np.asarray(over, np.float64), np.asarray(under, np.float64)
    if not b.sum() > 0.0:
        return Interval(math.nan, math.nan, math.nan)
    drawn = np.random.default_rng(SEED).integers(0, len(a), (DRAWS, len(a)))
    sums = b[drawn].sum(axis=1)
    ratios = a[drawn].sum(axis=1)[sums > 0.0] / sums[sums > 0.0]
    low, high = np.percentile(ratios, (2.5, 97.5))
    return Interval(float(a.sum() / b.sum()), float(low), float(high))


def mean(numbers: Sequence[float]) -> Interval:
    """By the same draws; of differences between two policies on the same routes it is the paired interval."""
    return ratio(numbers, [1.0] * len(numbers))


def in_words(one: Interval) -> str:
    """What it is, and its interval."""
    return f"{one.at:.2f} ({one.low:.2f} … {one.high:.2f})"
