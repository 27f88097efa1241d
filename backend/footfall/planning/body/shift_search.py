"""The smallest shift of the chassis that a step can do with: a deterministic search in six dimensions.

The cross-entropy method (Rubinstein, 1999) over Halton points: round by round the spread of the samples follows that
of the best so far. A shift without violations beats one with; of two without, the cheaper wins; of two with, the one
that falls short by less (Deb, "An efficient constraint handling method for genetic algorithms", 2000).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from footfall.core.arrays import Array

FIRST, NEXT, ROUNDS = 768, 256, 24
PATIENCE = 5
"""The search ends after so many rounds that made the best less than 1 % better."""
ELITE = 24
WIDER = 1.3
"""The next round's spread over that of the elite: a bare copy of it would narrow before it has moved."""
LEAST_SPREAD = 2e-3
"""Of the spread at the beginning."""
CLOSER = np.linspace(0.05, 0.95, 19)
"""Shares of the best shift that are tried in every round: the way back to no shift at all."""
SEPARATE = 0.04
"""Alternatives are at least this far from each other [m, turns by the lever]."""


@dataclass(frozen=True)
class Ranked:
    """Shifts tried, (n, 6), best first, with their violations in sum and their costs, (n,)."""

    shifts: Array
    short: Array
    cost: Array

    @property
    def score(self) -> float:
        """Of the best: its cost, or a large number that grows with its violations."""
        return float(self.cost[0]) if self.short[0] == 0 else 1e3 * (1.0 + float(self.short[0]))

    def alternatives(self, scale: Array, most: int, shortest: float = 0.0) -> Array:
        """Shifts with no violations, or with so little, (k, 6), best first, none near another.

        scale: (6,) metres a unit. most: of them.
        """
        chosen: list[Array] = []
        for shift in self.shifts[self.short <= shortest]:
            if all(np.linalg.norm(scale * (shift - other)) >= SEPARATE for other in chosen):
                chosen.append(shift)
                if len(chosen) == most:
                    break
        return np.array(chosen).reshape(-1, 6)


def search(
    short: Callable[[Array], Array], scale: Array, bounds: Array, starts: Array, tick: Callable[[], None]
) -> Ranked:
    """Search for the cheapest shift without violations.

    Args:
        short: shifts (n, 6) → sums of their violations (n,).
        scale: (6,), the cost is the norm of scale · shift.
        bounds: largest size of each, (6,) [m, rad].
        starts: tried first, (k, 6) [m, rad].
        tick: called between rounds.

    Returns:
        Shifts that were tried, best first, with their violations and costs.
    """
    from scipy.stats.qmc import Halton  # scipy.stats takes half a second to load, and few processes search

    points = ndtri(np.clip(Halton(6, scramble=False).random(FIRST + 1 + NEXT * ROUNDS)[1:], 1e-9, 1 - 1e-9))
    spread = 0.45 * bounds
    tried = _ranked(short, scale, np.clip(np.concatenate([starts, spread * points[:FIRST]]), -bounds, bounds), None)
    history = [tried.score]
    for i in range(ROUNDS):
        tick()
        if i >= PATIENCE and history[-1] > 0.99 * history[-1 - PATIENCE]:
            break
        elite = tried.shifts[:ELITE]
        middle = elite.mean(axis=0) if tried.short[0] > 0 else elite[0]
        deviation = np.maximum(WIDER * np.sqrt(np.square(elite - middle).mean(axis=0)), LEAST_SPREAD * spread)
        new = middle + deviation * points[FIRST + NEXT * i : FIRST + NEXT * (i + 1)]
        new = np.concatenate([new, CLOSER[:, None] * tried.shifts[0]])
        tried = _ranked(short, scale, np.clip(new, -bounds, bounds), tried)
        history.append(tried.score)
    return tried


def _ranked(short: Callable[[Array], Array], scale: Array, shifts: Array, before: Ranked | None) -> Ranked:
    missed, cost = short(shifts), np.linalg.norm(scale * shifts, axis=1)
    if before is not None:
        shifts = np.concatenate([before.shifts, shifts])
        missed, cost = np.concatenate([before.short, missed]), np.concatenate([before.cost, cost])
    order = np.lexsort([cost, missed])
    return Ranked(shifts[order], missed[order], cost[order])
