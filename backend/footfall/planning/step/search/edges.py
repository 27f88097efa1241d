"""The space that the searches move in: a box of configurations, some of them free, and edges between them.

Distances that decide how finely an edge is checked are in the maximum norm: neighbouring checked
configurations differ by at most ε in *every* joint [rad].
"""

import itertools
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.joint_path import largest_change


@lru_cache(maxsize=32)
def bisection_order(levels: int) -> Array:
    """Fractions of an edge (2^levels − 1,), middle first, then the quarters: blocked edges are mostly found early."""
    order = np.array([i / 2**level for level in range(1, levels + 1) for i in range(1, 2**level, 2)])
    order.flags.writeable = False
    return order


def levels_for(length: float, epsilon: float) -> int:
    """How often an edge is halved until its pieces are no longer than ε."""
    return max(0, int(np.ceil(np.log2(length / epsilon)))) if length > epsilon else 0


class Space:
    """A box of configurations and a test.

    lower, upper: (d,) limits. free: configuration → bool, asked only inside the limits.
    epsilon: see the module docstring. tick: called at every test, or with how many tests; may raise to stop a search.
    first_unsure: (n, d) → the first that is not surely inside the limits and free, or n; asked before ``free``.
    edges_sure: (n, d) → whether all between n waypoints is surely free at ε or finer, the waypoints being so; asked
    before single configurations.
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        free: Callable[[Array], bool],
        epsilon: float = 0.01,
        tick: Callable[..., None] = lambda looks=1: None,
        first_unsure: Callable[[Array], int] = lambda qs: 0,
        edges_sure: Callable[[Array], bool] = lambda path: False,
    ) -> None:
        self.lower, self.upper = np.asarray(lower, float), np.asarray(upper, float)
        self.epsilon, self.tick = epsilon, tick
        self.checked = 0
        self._free, self._first_unsure, self._edges_sure = free, first_unsure, edges_sure

    def is_free(self, q: Array) -> bool:
        """Whether q (d,) is inside the limits and passes the test."""
        self.tick()
        if (q < self.lower).any() or (q > self.upper).any():
            return False
        self.checked += 1
        return self._free(q)

    def is_sure(self, q: Array) -> bool:
        """Whether q (d,) is surely inside the limits and free."""
        return self._first_unsure(q[None]) == 1

    def edge_is_free(self, a: Array, b: Array) -> bool:
        """Whether everything between a and b (d,) is free at ε; the two ends are not tested again."""
        self.tick()
        if self._edges_sure(np.array([a, b])):
            return True
        order = bisection_order(levels_for(largest_change(a, b), self.epsilon))
        return self._first_not_free(a + order[:, None] * (b - a)) == len(order)

    def path_is_free(self, path: Array) -> bool:
        """Whether waypoints (n, d) and the edges between them are free."""
        self.tick()
        if self._edges_sure(path):
            return self._first_not_free(path) == len(path)
        inner = [
            a + bisection_order(levels_for(largest_change(a, b), self.epsilon))[:, None] * (b - a)
            for a, b in itertools.pairwise(path)
        ]
        every = np.concatenate([path, *inner])
        return self._first_not_free(every) == len(every)

    def first_blocked(self, a: Array, b: Array) -> float | None:
        """Fraction 0…1 of the way from a to b (d,) where the first blocked configuration is met, or None."""
        # the very configurations that edge_is_free looks at, in the order of the way, and the ends
        parts = 2 ** levels_for(largest_change(a, b), self.epsilon)
        at = np.arange(parts + 1) / parts
        blocked = self._first_not_free(a + at[:, None] * (b - a))
        return None if blocked == len(at) else float(at[blocked])

    def _first_not_free(self, qs: Array) -> int:
        """The first of n configurations (n, d) that is not free, or n."""
        at = 0
        while at < len(qs):
            self.tick()
            sure = self._first_unsure(qs[at:])
            self.checked += sure
            at += sure
            if at < len(qs):
                if not self.is_free(qs[at]):
                    return at
                at += 1
        return at
