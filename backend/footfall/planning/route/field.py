"""What every place of a grid of costs is away from one goal, and the cheapest ways there; repaired when costs change.

Field D* (Ferguson & Stentz 2005): ways may cross edges of cells anywhere, so they are not bound to eight directions.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.planning.route import spread_kernel as spreading
from footfall.planning.route.corners_kernel import LEAST_RISE, NONE, steps_of, unknown_corners
from footfall.planning.route.field_kernel import COLS, LOOKED_AT, RISE, SHIFT, WAITING, change, look, take_over
from footfall.planning.route.follow_kernel import follow
from footfall.planning.route.line_kernel import line_costs
from footfall.planning.route.straighten import straightened

LEAST_COST = 1.0
"""Of a cell: so much at least for each metre."""
_DEAR = 1.0 / 64.0
"""Lists of corners are at least so wide [mean cost of an edge]: a few cheap cells make no difference."""
AT_ONCE = 200_000
"""Corners that are looked at between two reports of progress."""
_BORDER = 1
_BEYOND = 3.0
"""Corners are looked at as far as those around the rover cost, and so many times the least cost of an edge more."""
_NEAR = 1e-9
"""A point so near to an edge is on it [edges]."""


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
        costs = np.full(shape, math.inf)
        costs[_BORDER : _BORDER + rows, _BORDER : _BORDER + cols] = given
        self._corners = unknown_corners(costs)
        self._costs, self._g = (self._corners[name].reshape(shape) for name in ("cell", "g"))
        self.goal = np.array(goal, np.float64)
        self._goal = self._free_edges(self.goal, "the goal")
        self._steps, self._queue = steps_of(shape[1]), np.empty(len(self._corners), WAITING)
        self._numbers = np.zeros(5)
        self._numbers[COLS], self._numbers[RISE] = shape[1], LEAST_RISE * LEAST_COST
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
        flat = self._flat(where)
        self._corners["cell"][flat] = values
        if self._here is not None:
            change(self._corners, self._steps, self._queue, self._numbers, self._here, self._ends, flat)

    def plan(self, begin: ArrayLike, progress: Progress = no_progress) -> tuple[Array, float]:
        """The cheapest way (n, 2) [m] from ``begin`` to the goal and its cost; no points, infinite where none leads.

        What was found for other beginnings and before changes is used again. progress: may raise Cancelled.
        """
        here = self._free_edges(np.asarray(begin, np.float64), "the rover")
        if not np.array_equal(np.floor(here), np.floor(self._goal)):
            self._look(here, progress)
        return self._way(here)

    def _look(self, here: Array, progress: Progress) -> None:
        if self._here is None:
            self._here = here
            self._spread(here, progress)
        self._numbers[SHIFT] += self._numbers[RISE] * math.hypot(*(here - self._here))
        self._here = here
        known = (self._corners, self._steps, self._queue, self._numbers, here, self._ends)
        while not look(*known, _BEYOND * LEAST_COST, AT_ONCE):
            progress(0.9, "looking for the cheapest way")

    def _spread(self, here: Array, progress: Progress) -> None:
        """Look from the goal on, all costs being new."""
        free = self._costs[np.isfinite(self._costs)]
        numbers = np.zeros(5)
        numbers[spreading.RISE] = self._numbers[RISE]
        numbers[spreading.WIDTH] = LEAST_RISE * max(free.min(), _DEAR * free.mean())
        lists = np.full(spreading.LISTS + 1, NONE, np.int32)
        row, col, cols = int(here[0]), int(here[1]), self._costs.shape[1]
        around = np.array([r * cols + c for r in (row, row + 1) for c in (col, col + 1)], np.int32)
        spreading.begin(self._corners, self._ends, lists, numbers)
        searched = (self._corners, self._steps, around, _BEYOND * LEAST_COST, lists, numbers)
        try:
            while not spreading.spread(*searched, AT_ONCE):
                looked_at = numbers[spreading.LOOKED_AT] / len(self._corners)
                progress(min(0.9, looked_at), "looking for the cheapest way")
        finally:
            # what waits is looked at later, when that is asked for
            take_over(self._corners, self._queue, self._numbers, here, lists)
            self._numbers[LOOKED_AT] = numbers[spreading.LOOKED_AT]

    def cost_from(self, way: ArrayLike) -> float:
        """What a way (n, 2) [m] costs."""
        points = np.array([self._edges(point, "a point of the way") for point in np.asarray(way, np.float64)])
        return self.geometry.resolution * float(line_costs(self._costs, points).sum())

    def _flat(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        return (cells[:, 0] + _BORDER) * self._costs.shape[1] + cells[:, 1] + _BORDER

    def _way(self, here: Array) -> tuple[Array, float]:
        way = follow(self._costs, self._g, here, self._goal, 4 * sum(self._g.shape))
        if not np.array_equal(way[-1], self._goal):
            return np.empty((0, 2)), math.inf
        way, own = straightened(self._costs, way)
        x0, y0, size = self.geometry.x0, self.geometry.y0, self.geometry.resolution
        places = np.column_stack([x0, y0]) + size * (way[:, ::-1] - _BORDER - 0.5)
        return places, size * float(own.sum())

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
