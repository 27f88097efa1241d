"""What every place of a grid of costs is away from one goal, and the cheapest ways there; repaired when costs change.

Field D* (Ferguson & Stentz 2005): ways may cross edges of cells anywhere, so they are not bound to eight directions.
"""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.planning.route.field_kernel import (
    COLS,
    ESTIMATE,
    LOOKED_AT,
    NONE,
    SHIFT,
    Corners,
    change,
    look,
    steps_of,
)
from footfall.planning.route.follow_kernel import follow
from footfall.planning.route.line_kernel import line_cost, settle_points, shortcuts

Array = NDArray[np.float64]

LEAST_COST = 1.0
"""Of a cell: so much at least for each metre."""
ESTIMATE_SHARE = math.sqrt(0.5)
"""Of the least cost, taken for what is left between two places. A corner that is reached over an edge costs at least
c / √2 more than either end of it (√(c² − f²) with f = c / √2 at the most, see edge_cost), c a cell's cost: with more
than this share corners would be looked at before those that they depend on, again and again."""
AT_ONCE = 200_000
"""Corners that are looked at between two reports of progress."""
_BORDER = 1
_BEYOND = 3.0
"""Corners are looked at as far as those around the rover cost, and so many times the least cost of an edge more."""
_ROUNDS = 2
"""Times that a way is cut short and its corners are moved."""
_NEAR = 1e-9
"""A point so near to an edge is on it [edges]."""
_STEP = 0.5
"""A corner is moved by so much at first [edges]."""


class CostField:
    """Costs of a grid of cells, and what the way to ``goal`` costs from where it was asked for.

    Not thread-safe. costs: (rows, cols), for each metre, at least LEAST_COST; infinite where nothing may go.
    goal: x, y [m] in a cell that is not blocked. Raises InvalidInput.
    """

    def __init__(self, geometry: GridGeometry, costs: ArrayLike, goal: ArrayLike) -> None:
        given = np.asarray(costs, np.float64)
        if given.shape != geometry.shape:
            raise InvalidInput(f"costs {given.shape} for a grid of {geometry.shape} cells")
        _require_costs(given)
        self.geometry, rows, cols = geometry, *geometry.shape
        shape = (rows + 1 + 2 * _BORDER, cols + 1 + 2 * _BORDER)
        self._costs = np.full(shape, math.inf)
        self._costs[_BORDER : _BORDER + rows, _BORDER : _BORDER + cols] = given
        self.goal = np.array(goal, np.float64)
        self._goal = self._free_edges(self.goal, "the goal")
        self._g = np.full(shape, math.inf)
        count = self._g.size
        self._known = Corners(
            costs=self._costs.ravel(),
            g=self._g.ravel(),
            rhs=np.full(count, math.inf),
            ways=np.full(count, NONE, np.int8),
            steps=steps_of(shape[1]),
            heap=np.empty(count, np.int32),
            first=np.empty(count),
            second=np.empty(count),
            places=np.full(count, NONE, np.int32),
            numbers=np.zeros(5),
        )
        self._numbers = self._known.numbers
        self._numbers[COLS], self._numbers[ESTIMATE] = shape[1], ESTIMATE_SHARE * LEAST_COST
        self._here: Array | None = None
        row, col = (int(at) for at in self._goal)
        corners = [(r, c) for r in (row, row + 1) for c in (col, col + 1)]
        own = self._costs[row, col]
        self._ends = np.array([(r * shape[1] + c, own * math.hypot(*(self._goal - (r, c)))) for r, c in corners])

    @property
    def looked_at(self) -> int:
        """Corners that were looked at, in all searches together."""
        return int(self._numbers[LOOKED_AT])

    def change(self, cells: ArrayLike, costs: ArrayLike) -> None:
        """Give cells (k, 2), row and column, other costs (k,). Raises InvalidInput."""
        where, values = np.asarray(cells, np.int64).reshape(-1, 2), np.asarray(costs, np.float64).ravel()
        if len(where) != len(values) or (where < 0).any() or (where >= self.geometry.shape).any():
            raise InvalidInput("every cell that is changed lies in the grid, and has one cost")
        _require_costs(values)
        goal = np.floor(self._goal).astype(np.int64) - _BORDER
        if (where == goal).all(axis=1).any():
            raise InvalidInput("the cost under the goal can't be changed; make a new field")
        here = np.zeros(2) if self._here is None else self._here
        change(self._known, here, self._ends, self._flat(where), values)

    def plan(self, begin: ArrayLike, progress: Progress = no_progress) -> tuple[Array, float]:
        """The cheapest way (n, 2) [m] from ``begin`` to the goal and its cost; no points, infinite where none leads.

        What was found for other beginnings and before changes is used again. progress: may raise Cancelled.
        """
        here = self._free_edges(np.asarray(begin, np.float64), "the rover")
        if self._here is None:
            self._here = here
            # the corners around the goal begin to wait
            cell = self._flat(np.floor(self._goal)[None].astype(np.int64) - _BORDER)
            change(self._known, here, self._ends, cell, self._costs.ravel()[cell])
        else:
            self._numbers[SHIFT] += ESTIMATE_SHARE * LEAST_COST * math.hypot(*(here - self._here))
            self._here = here
        row, col = (int(at) for at in self._goal)
        direct = line_cost(self._costs, here, self._goal) if (row, col) == (int(here[0]), int(here[1])) else math.inf
        first = max(1.0, math.hypot(*(here - self._goal)))
        while math.isinf(direct) and not look(self._known, here, self._ends, _BEYOND * LEAST_COST, AT_ONCE):
            waiting = self._known.first[0] - self._numbers[SHIFT]
            progress(min(0.9, first / max(first, waiting)), "looking for the cheapest way")
        return self._way(here)

    def cost_from(self, way: ArrayLike) -> float:
        """What a way (n, 2) [m] costs."""
        points = np.array([self._edges(point, "a point of the way") for point in np.asarray(way, np.float64)])
        return self.geometry.resolution * float(self._own(points).sum())

    def _flat(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        return (cells[:, 0] + _BORDER) * self._costs.shape[1] + cells[:, 1] + _BORDER

    def _way(self, here: Array) -> tuple[Array, float]:
        way = follow(self._costs, self._g, here, self._goal, 4 * sum(self._g.shape))
        if not np.array_equal(way[-1], self._goal):
            return np.empty((0, 2)), math.inf
        own = self._own(way)
        for _ in range(_ROUNDS):
            before = own.sum()
            way = way[shortcuts(self._costs, way, own)]
            settle_points(self._costs, way, _STEP)
            own = self._own(way)
            if own.sum() > before * (1.0 - 1e-6):
                break
        x0, y0, size = self.geometry.x0, self.geometry.y0, self.geometry.resolution
        places = np.column_stack([x0, y0]) + size * (way[:, ::-1] - _BORDER - 0.5)
        return places, size * float(own.sum())

    def _own(self, way: Array) -> Array:
        return np.array([line_cost(self._costs, a, b) for a, b in pairwise(way)])

    def _free_edges(self, place: Array, what: str) -> Array:
        """As ``_edges``; raises InvalidInput where nothing may go, too."""
        at = self._edges(place, what)
        if math.isinf(self._costs[int(at[0]), int(at[1])]):
            raise InvalidInput(f"{what} at ({place[0]:g}, {place[1]:g}) is where nothing may go")
        return at

    def _edges(self, place: Array, what: str) -> Array:
        """(row, column) in edges of a place x, y [m]. Raises InvalidInput outside."""
        x0, y0, size = self.geometry.x0, self.geometry.y0, self.geometry.resolution
        at = (np.array([place[1] - y0, place[0] - x0]) / size + 0.5) + _BORDER
        if not (
            np.isfinite(at).all() and (at >= _BORDER).all() and (at < np.array(self.geometry.shape) + _BORDER).all()
        ):
            raise InvalidInput(f"{what} at ({place[0]:g}, {place[1]:g}) lies outside the map")
        # what is on an edge stays there however it was rounded
        whole = np.round(at)
        return np.where(np.abs(at - whole) < _NEAR, whole, at)


def _require_costs(costs: Array) -> None:
    if not (costs >= LEAST_COST).all():
        raise InvalidInput(f"a cell costs at least {LEAST_COST:g} a metre, or infinitely much where nothing may go")
