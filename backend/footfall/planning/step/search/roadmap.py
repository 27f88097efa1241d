"""The two trees of milestones that SBL grows, with the segments between them and how far each is checked."""

from collections import deque

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.step.search.edges import levels_for

START, GOAL = 0, 1
DIVISIONS = 16
"""Cells of the density grid along each of its two coordinates."""
REPICK = 64
"""Milestones after which the density grid changes to two other coordinates."""


class Roadmap:
    """Milestones in a box; each belongs to the tree of the start or of the goal.

    Milestone 0 is the start, 1 the goal. The density grid lies over two coordinates chosen at random
    and changed from time to time (Sánchez & Latombe 2003): picking a filled cell, then a milestone in
    it, favours milestones in thinly covered regions.
    """

    def __init__(self, lower: Array, upper: Array, start: Array, goal: Array, rng: np.random.Generator) -> None:
        self._lower, self._range = lower, np.maximum(upper - lower, 1e-12)
        self._rng = rng
        self.q = np.empty((256, len(start)))
        self.side = np.empty(256, np.int8)
        self.count = 0
        self.parent: list[int] = []
        self.near: list[set[int]] = []
        self.level: dict[tuple[int, int], int] = {}
        self._cells: tuple[dict[tuple[int, int], list[int]], ...] = ({}, {})
        self._filled: tuple[list[tuple[int, int]], ...] = ([], [])
        self._axes = (0, 0)
        self._append(start, START, -1)
        self._append(goal, GOAL, -1)
        self._regrid()

    def _append(self, q: Array, side: int, parent: int) -> int:
        if self.count == len(self.q):
            self.q = np.concatenate([self.q, np.empty_like(self.q)])
            self.side = np.concatenate([self.side, np.empty_like(self.side)])
        index = self.count
        self.q[index], self.side[index] = q, side
        self.parent.append(parent)
        self.near.append(set())
        self.count += 1
        return index

    def add(self, q: Array, parent: int) -> int:
        """Install q (d,) as a child of ``parent``, the segment between them unchecked; returns its index."""
        index = self._append(q, int(self.side[parent]), parent)
        self.join(parent, index)
        if self.count % REPICK == 0:
            self._regrid()
        else:
            self._enter_cell(index)
        return index

    def join(self, i: int, j: int) -> None:
        """A new unchecked segment."""
        self.near[i].add(j)
        self.near[j].add(i)
        self.level[_key(i, j)] = 0

    def _cell(self, index: int) -> tuple[int, int]:
        a, b = self._axes
        at = (self.q[index, [a, b]] - self._lower[[a, b]]) / self._range[[a, b]] * DIVISIONS
        return int(at[0]), int(at[1])

    def _enter_cell(self, index: int) -> None:
        side = int(self.side[index])
        cell = self._cell(index)
        cells = self._cells[side]
        if cell not in cells:
            cells[cell] = []
            self._filled[side].append(cell)
        cells[cell].append(index)

    def _regrid(self, repick: bool = True) -> None:
        dimension = self.q.shape[1]
        if repick and dimension > 1:
            a, b = self._rng.choice(dimension, 2, replace=False)
            self._axes = (int(a), int(b))
        self._cells, self._filled = ({}, {}), ([], [])
        for index in range(self.count):
            self._enter_cell(index)

    def pick(self, side: int) -> int:
        """A milestone of one tree, with probability about inverse to the density around it."""
        filled = self._filled[side]
        members = self._cells[side][filled[int(self._rng.integers(len(filled)))]]
        return members[int(self._rng.integers(len(members)))]

    def closest_opposite(self, index: int) -> tuple[int, float]:
        """Nearest milestone of the other tree and its distance (maximum norm)."""
        others = np.flatnonzero(self.side[: self.count] != self.side[index])
        distances = np.abs(self.q[others] - self.q[index]).max(axis=1)
        k = int(np.argmin(distances))
        return int(others[k]), float(distances[k])

    def route(self, i: int, j: int) -> list[int]:
        """Milestones from the start to the goal over the bridge i–j, which joins the two trees."""
        if self.side[i] != START:
            i, j = j, i
        first, second = self._to_root(i), self._to_root(j)
        return first[::-1] + second

    def _to_root(self, i: int) -> list[int]:
        out = [i]
        while self.parent[out[-1]] >= 0:
            out.append(self.parent[out[-1]])
        return out

    def remove(self, i: int, j: int) -> None:
        """Take a colliding segment out; what hung behind it now belongs to the tree that it still touches."""
        self.near[i].discard(j)
        self.near[j].discard(i)
        del self.level[_key(i, j)]
        parent, side = [-1] * self.count, np.full(self.count, -1, np.int8)
        for root in (START, GOAL):
            queue = deque([root])
            side[root] = root
            while queue:
                m = queue.popleft()
                for k in sorted(self.near[m]):
                    if side[k] < 0:
                        side[k], parent[k] = root, m
                        queue.append(k)
        self.parent, self.side[: self.count] = parent, side
        self._regrid(repick=False)

    def remaining_levels(self, i: int, j: int, epsilon: float) -> int:
        """How many more halvings the segment needs."""
        needed = levels_for(float(np.abs(self.q[i] - self.q[j]).max()), epsilon)
        return needed - self.level[_key(i, j)]

    def unchecked_length(self, i: int, j: int) -> float:
        """Check score: length of the pieces between configurations checked so far (maximum norm)."""
        return float(np.abs(self.q[i] - self.q[j]).max()) / 2 ** self.level[_key(i, j)]

    def next_points(self, i: int, j: int) -> Array:
        """The configurations that the next halving adds, (k, d); marks that halving as done."""
        key = _key(i, j)
        self.level[key] += 1
        pieces = 2 ** self.level[key]
        t = np.arange(1, pieces, 2)[:, None] / pieces
        a, b = self.q[key[0]], self.q[key[1]]
        return a + t * (b - a)


def _key(i: int, j: int) -> tuple[int, int]:
    return (i, j) if i < j else (j, i)
