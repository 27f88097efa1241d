"""What straight ways over a grid of costs cost, exactly, and ways made shorter by them."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit

Floats = NDArray[np.float64]

_ROUNDS = 8
"""Times that all points of a way are moved, each time by half as much."""


@njit()
def line_cost(costs: Floats, a: Floats, b: Floats) -> float:
    """Cost of the straight line from a to b, (row, column) in edges; costs: with a border, see field_kernel.

    Along an edge the cheaper of both cells counts. Source: the cells are found as J. Amanatides & A. Woo, "A fast voxel
    traversal algorithm for ray tracing" (Eurographics 1987) do.
    """
    dr, dc = b[0] - a[0], b[1] - a[1]
    length = math.hypot(dr, dc)
    if length == 0.0:
        return 0.0
    total, at = 0.0, 0.0
    while at < 1.0:
        r, c = a[0] + at * dr, a[1] + at * dc
        following = min(1.0, _to_next(r, dr, at), _to_next(c, dc, at))
        middle = 0.5 * (at + following)
        total += (following - at) * length * _cost_at(costs, a[0] + middle * dr, a[1] + middle * dc, dr, dc)
        at = following
    return total


@njit()
def _to_next(x: float, dx: float, at: float) -> float:
    """The share of the line at which it comes to the next grid line across; x: where it is now."""
    if dx == 0.0:
        return math.inf
    edge = math.floor(x + 1e-9) + 1.0 if dx > 0.0 else math.ceil(x - 1e-9) - 1.0
    return at + (edge - x) / dx


@njit()
def _cost_at(costs: Floats, r: float, c: float, dr: float, dc: float) -> float:
    """Of the cell at a point; on an edge that the line goes along, of the cheaper."""
    row, col = math.floor(r), math.floor(c)
    if dr == 0.0 and r == row:
        return min(costs[int(row), int(col)], costs[int(row) - 1, int(col)])
    if dc == 0.0 and c == col:
        return min(costs[int(row), int(col)], costs[int(row), int(col) - 1])
    return costs[int(row), int(col)]


@njit()
def shortcuts(costs: Floats, way: Floats, own: Floats) -> NDArray[np.bool_]:
    """Which points of a way (n, 2) are left when straight lines replace what is no cheaper; own: (n − 1,) its costs."""
    n = len(way)
    kept = np.zeros(n, np.bool_)
    kept[0] = kept[n - 1] = True
    at = 0
    while at < n - 1:
        best, reach = at + 1, 2
        spent = own[at]
        last = at + 1
        # farther and farther as long as that pays
        while True:
            end = min(at + reach, n - 1)
            if end == last:
                break
            for i in range(last, end):
                spent += own[i]
            last = end
            if line_cost(costs, way[at], way[end]) <= spent * (1.0 + 1e-12):
                best = end
            elif end - at > 8 * (best - at):
                break
            reach = reach + max(1, reach // 2)
        kept[best] = True
        at = best
    return kept


@njit()
def settle_points(costs: Floats, way: Floats, step: float) -> None:
    """Move the points of a way (n, 2) between its ends to where they cost least; it never gets dearer.

    step: by how much at first [edges].
    """
    n = len(way)
    moved = np.empty(2)
    for _ in range(_ROUNDS):
        for i in range(1, n - 1):
            now = line_cost(costs, way[i - 1], way[i]) + line_cost(costs, way[i], way[i + 1])
            # along the edges of cells, where costs change
            for k in range(4):
                moved[0] = way[i, 0] + step * (k - 1) * (k % 2 == 0)
                moved[1] = way[i, 1] + step * (k - 2) * (k % 2 == 1)
                if not (1.0 <= moved[0] <= costs.shape[0] - 1.0 and 1.0 <= moved[1] <= costs.shape[1] - 1.0):
                    continue
                cost = line_cost(costs, way[i - 1], moved) + line_cost(costs, moved, way[i + 1])
                if cost < now - 1e-12:
                    now = cost
                    way[i, 0], way[i, 1] = moved[0], moved[1]
        step *= 0.5
