"""The chassis' way around what can't be stepped over: a shortest path over a grid of costs, straightened and rounded.

The path is Dijkstra's ("A note on two problems in connexion with graphs", 1959) among the eight neighbours of each
cell. Chords replace its corners where they cost no more (Geraerts & Overmars, "Creating high-quality paths for motion
planning", 2007); what corners are left are rounded.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from footfall.core.arrays import Array
from footfall.planning.walk.travel_cost import TravelCost

CELL = 0.25
"""Of the grid [m]."""
EASY = 2.0
"""A straight way that nowhere costs more than this a metre is taken."""
SAVES = 1.2
"""A way around must save a straight one so much [m of easy way], and as much again for each ten metres of it."""
NEVER = 1e4
"""Cost of a metre where the chassis surely can't be."""
ROUNDED = 0.8
"""Length over which corners are rounded [m]."""
DEARER = 1.05
"""What rounding may cost more."""


@dataclass(frozen=True, eq=False)
class NoWay:
    """x, y: where the chassis can get at most towards the goal; short: how far that is from it [m]."""

    x: float
    y: float
    short: float


@dataclass(frozen=True, eq=False)
class ChassisCosts:
    """low: (2,) the middle of the first cell [m]. costs: (rows, cols) of a metre; may: where the chassis may be."""

    low: Array
    costs: Array
    may: NDArray[np.bool_]

    def along(self, points: Array) -> float:
        """Cost of a way straight from point to point, (n, 2)."""
        fine = resampled(points, CELL / 4)
        # cells where the chassis can't be count as a whole, not by their share
        costs = map_coordinates(self.costs, self._at(fine), order=1, mode="nearest")
        cols, rows = np.rint((fine - self.low) / CELL).astype(int).T
        costs[~self.may[np.clip(rows, 0, len(self.may) - 1), np.clip(cols, 0, self.may.shape[1] - 1)]] = NEVER
        steps = np.hypot(*np.diff(fine, axis=0).T)
        return float((0.5 * (costs[1:] + costs[:-1]) * steps).sum())

    def _at(self, points: Array) -> Array:
        return ((points - self.low) / CELL).T[::-1]

    def cell(self, point: Array) -> tuple[int, int]:
        """Row and column of the cell that a point (2,) is in."""
        col, row = np.rint((point - self.low) / CELL).astype(int)
        return int(np.clip(row, 0, len(self.costs) - 1)), int(np.clip(col, 0, self.costs.shape[1] - 1))

    def shortest(self, begin: Array, end: Array, within: float) -> tuple[Array, float] | NoWay:
        """The cheapest path of cells' middles (n, 2) from a place to one so near another [m], and its cost."""
        rows, cols = self.costs.shape
        source = int(np.ravel_multi_index(self.cell(begin), (rows, cols)))
        lengths, before = dijkstra(self._graph(source), indices=source, return_predecessors=True)
        lengths, before = np.asarray(lengths), np.asarray(before)
        y, x = np.divmod(np.arange(rows * cols), cols)
        middles = self.low + CELL * np.column_stack([x, y])
        away = np.hypot(*(middles - end).T)
        reached = np.isfinite(lengths)
        near = reached & (away <= within + CELL)
        if not near.any():
            nearest = int(np.argmin(np.where(reached, away, np.inf)))
            return NoWay(float(middles[nearest, 0]), float(middles[nearest, 1]), float(away[nearest]))
        last = int(np.ravel_multi_index(self.cell(end), (rows, cols)))
        if not reached[last]:
            last = int(np.argmin(np.where(near, lengths, np.inf)))
        path = [last]
        while path[-1] != source:
            path.append(int(before[path[-1]]))
        return middles[path[::-1]], float(lengths[last])

    def _graph(self, source: int) -> csr_matrix:
        """Weights between neighbouring cells where the chassis may be; it is at the source, whatever is thought."""
        rows, cols = self.costs.shape
        number, may = np.arange(rows * cols).reshape(rows, cols), self.may.copy()
        may.flat[source] = True
        ones, others, weights = [], [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = (slice(0, rows - down), slice(max(-right, 0), cols - max(right, 0)))
            there = (slice(down, rows), slice(max(right, 0), cols + min(right, 0)))
            both = may[here] & may[there]
            ones.append(number[here][both])
            others.append(number[there][both])
            weights.append(CELL * math.hypot(down, right) * 0.5 * (self.costs[here] + self.costs[there])[both])
        one, other, weight = np.concatenate(ones), np.concatenate(others), np.concatenate(weights)
        both_ways = (np.concatenate([one, other]), np.concatenate([other, one]))
        return csr_matrix((np.tile(weight, 2), both_ways), (rows * cols, rows * cols))


def is_easy(cost: TravelCost) -> bool:
    """Whether nothing is in the straight way."""
    return bool(cost.at(resampled(np.array([cost.begin[:2], cost.end[:2]]), CELL)).max() <= EASY)


def cost_grid(cost: TravelCost, low: Array, high: Array) -> ChassisCosts:
    """The costs of travel between two corners.

    Args:
        cost: what it costs to travel.
        low: south-west corner, (2,) in site [m].
        high: north-east corner, (2,) in site [m].

    Returns:
        The costs on a grid.
    """
    xs, ys = (np.arange(low[k], high[k] + CELL, CELL) for k in range(2))
    xy = np.stack(np.meshgrid(xs, ys), axis=-1)
    costs = cost.at(xy.reshape(-1, 2)).reshape(xy.shape[:2])
    return ChassisCosts(xy[0, 0], costs, cost.may_stand(xy, CELL))


def way_around(grid: ChassisCosts, begin: Array, end: Array, within: float) -> Array | NoWay:
    """The cheapest way between two places.

    Args:
        grid: costs.
        begin: (2,) in site [m].
        end: (2,) in site [m].
        within: how near to the end is near enough [m].

    Returns:
        Points (n, 2) [m], two where the way is straight and costs no more; or why there is none.
    """
    straight = np.array([begin, end])
    found = grid.shortest(begin, end, within)
    if isinstance(found, NoWay):
        return found
    direct = grid.along(straight)
    # the middles of the cells that begin and end are in, less those
    path = straightened(grid, np.concatenate([[begin], found[0][1:-1], [end]]))
    least = grid.along(path)
    if direct <= least + SAVES * (1.0 + 0.1 * math.dist(begin, end)):
        return straight
    smooth = rounded(path)
    return smooth if grid.along(smooth) <= min(DEARER * least, direct) else path


def straightened(grid: ChassisCosts, points: Array) -> Array:
    """The same way (n, 2) with chords where they cost no more: from each point to the farthest that can be had so."""
    steps = np.diff(points, axis=0)
    turns = np.abs(steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]) > 1e-9
    points = points[np.concatenate([[True], turns, [True]])]
    pieces = np.array([grid.along(points[i : i + 2]) for i in range(len(points) - 1)])
    done = np.concatenate([[0.0], np.cumsum(pieces)])
    kept = [0]
    while kept[-1] < len(points) - 1:
        i = kept[-1]
        for j in range(len(points) - 1, i, -1):
            if j == i + 1 or grid.along(points[[i, j]]) <= done[j] - done[i] + 1e-9:
                kept.append(j)
                break
    return points[kept]


def rounded(points: Array) -> Array:
    """The same way (n, 2) with corners rounded: twice a running mean over ROUNDED [m], its ends where they were."""
    out = resampled(points, CELL / 4)
    half = max(1, round(0.5 * ROUNDED / (CELL / 4)))
    for _ in range(2):
        ends = 2.0 * out[0] - out[half:0:-1], 2.0 * out[-1] - out[-2 : -2 - half : -1]
        if min(len(ends[0]), len(ends[1])) < half:
            return points
        padded = np.concatenate([ends[0], out, ends[1]])
        sums = np.cumsum(np.concatenate([np.zeros((1, 2)), padded]), axis=0)
        out = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    return np.concatenate([points[:1], out[1:-1], points[-1:]])


def resampled(points: Array, step: float) -> Array:
    """Points (n, 2) along a way, evenly and no farther apart than ``step`` [m], its ends included."""
    ways = lengths_to(points)
    at = np.linspace(0.0, ways[-1], max(2, 1 + math.ceil(ways[-1] / step)))
    return np.column_stack([np.interp(at, ways, column) for column in points.T])


def lengths_to(points: Array) -> Array:
    """How far along a way each of its points (n, 2) is, (n,) [m]."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
