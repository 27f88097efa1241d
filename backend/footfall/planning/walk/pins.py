"""Pinned places in a search: which have had a foot, and what it costs that one has not."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array

UNMET = 3.0
"""What it costs that a pinned place has had no foot yet, in foot moves."""
BACK = 4.0
"""The way back of the leg that is put there counts so much: the others wait for it."""


class Pins:
    """The places of one search. count: how many are pinned."""

    def __init__(self, count: int, pinned: NDArray[np.int64], high: Array, end: float, stride: float) -> None:
        """Look up what the legs reach from the pinned places.

        Args:
            count: how many places are pinned.
            pinned: (n,) which of them each footfall is, or −1.
            high: (legs, n) up to where on the guide each leg reaches each footfall [m], −inf where it may not stand.
            end: how long the guide is [m].
            stride: how far a foot's span gets in one foot move [m].
        """
        self.count, self._pinned, self._stride = count, pinned, stride
        self._end = end
        rows = [np.flatnonzero(pinned == pin) for pin in range(count)]
        self._high = np.array([high[:, own].max(axis=1, initial=-np.inf) for own in rows]).reshape(count, len(high))

    def of(self, place: int) -> frozenset[int]:
        """Which pinned place a footfall is, if any."""
        return frozenset({int(self._pinned[place])} - {-1})

    def unmet(self, met: frozenset[int]) -> NDArray[np.bool_]:
        """Which pinned places have had no foot, (pins,)."""
        return ~np.isin(np.arange(self.count), list(met))

    def unmet_on(self, rows: NDArray[np.int64], met: frozenset[int]) -> NDArray[np.bool_]:
        """Which have had none after a foot is put on each of some footfalls (n,), as (n, pins)."""
        return self.unmet(met) & (self._pinned[rows][:, None] != np.arange(self.count))

    def left(self, low: Array, high: Array, unmet: NDArray[np.bool_]) -> Array:
        """What it costs that places have had no foot, in foot moves.

        A leg that is beyond a place goes back to it, and those that reach only beyond it as well: so feet don't walk
        past it.

        Args:
            low: where the spans of the feet begin, (n, legs) [m].
            high: where they end [m].
            unmet: which pinned places have had no foot, (n, pins).

        Returns:
            (n,).
        """
        out = np.zeros(len(low))
        for pin in np.flatnonzero(unmet.any(axis=0)):
            back = []
            for leg in np.flatnonzero(np.isfinite(self._high[pin])):
                at = min(float(self._high[pin, leg]), self._end)
                own = np.maximum(np.minimum(high[:, leg], self._end) - at, 0.0)
                others = np.maximum(np.delete(low, leg, axis=1) - at, 0.0).sum(axis=1)
                back.append((BACK * own + others) / self._stride)
            out += unmet[:, pin] * (UNMET + np.min(back, axis=0, initial=np.inf))
        return out
