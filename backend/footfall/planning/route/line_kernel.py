"""What straight ways over a grid of costs cost, exactly, and ways made shorter by them."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array

_ROUNDS = 5
"""Times that all points of a way are moved, each time by half as much."""
_PATIENCE = 4
"""Lines are tried over so many times as many points as were cut off by the last one that paid."""
_NEAR = 1e-9
"""A point so near to an edge is on it [edges]."""


@njit()
def _line(costs: Array, ar: float, ac: float, br: float, bc: float) -> float:
    """Cost of the straight line from a to b, (row, column) in edges; costs: with a border, see corners_kernel.

    Along an edge the cheaper of both cells counts. Source: J. Amanatides & A. Woo, "A fast voxel traversal algorithm
    for ray tracing" (Eurographics 1987).
    """
    dr, dc = br - ar, bc - ac
    if dr == 0.0 and dc == 0.0:
        return 0.0
    row, following_row, share_row = _first(ar, dr)
    col, following_col, share_col = _first(ac, dc)
    near = _NEAR / max(abs(dr), abs(dc))
    # the cell beside an edge that the line goes along
    south, west = row - (dr == 0.0 and ar == row), col - (dc == 0.0 and ac == col)
    down, left = row - south, col - west
    up, right = 1 if dr > 0.0 else -1, 1 if dc > 0.0 else -1
    total, at = 0.0, 0.0
    while True:
        following = min(1.0, following_row, following_col)
        cost = costs[row, col]
        if down or left:
            cost = min(cost, costs[row - down, col - left])
        # nothing of a cell that is only touched: it may be blocked
        if following > at + near:
            total += (following - at) * cost
        at = following
        if at >= 1.0:
            return total * math.sqrt(dr * dr + dc * dc)
        if following_row <= at + near:
            row += up
            following_row += share_row
        if following_col <= at + near:
            col += right
            following_col += share_col


@njit()
def _first(x: float, dx: float) -> tuple[int, float, float]:
    """Along one axis: the cell that a line begins in, the share of it to the next grid line, to each one after that."""
    if dx > 0.0:
        cell = math.floor(x + _NEAR)
        return cell, (cell + 1.0 - x) / dx, 1.0 / dx
    if dx < 0.0:
        cell = math.ceil(x - _NEAR) - 1
        return cell, (cell - x) / dx, -1.0 / dx
    return math.floor(x), math.inf, math.inf


@njit()
def line_costs(costs: Array, way: Array) -> Array:
    """Costs (n − 1,) of the straight lines between the points of a way (n, 2), (row, column) in edges."""
    own = np.empty(len(way) - 1)
    for i in range(len(own)):
        own[i] = _line(costs, way[i, 0], way[i, 1], way[i + 1, 0], way[i + 1, 1])
    return own


@njit()
def shortcuts(costs: Array, way: Array, own: Array) -> NDArray[np.bool_]:
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
            if _line(costs, way[at, 0], way[at, 1], way[end, 0], way[end, 1]) <= spent * (1.0 + 1e-12):
                best = end
            elif end - at > _PATIENCE * (best - at):
                break
            reach = reach + max(1, reach // 2)
        kept[best] = True
        at = best
    return kept


@njit()
def settle_points(costs: Array, way: Array, own: Array, step: float) -> None:
    """Move the points of a way (n, 2) between its ends to where they cost least; it never gets dearer.

    Points on edges, where costs change, move along them. own: (n − 1,) its costs, kept. step: by how much at first
    [edges].
    """
    for _ in range(_ROUNDS):
        for i in range(1, len(way) - 1):
            along_row, along_col = way[i, 0] == math.floor(way[i, 0]), way[i, 1] == math.floor(way[i, 1])
            for k in range(4):
                if (along_row and not along_col) if k < 2 else (along_col and not along_row):
                    continue
                r = way[i, 0] + (step * (2 * k - 1) if k < 2 else 0.0)
                c = way[i, 1] + (step * (2 * k - 5) if k >= 2 else 0.0)
                if not (1.0 <= r <= costs.shape[0] - 1.0 and 1.0 <= c <= costs.shape[1] - 1.0):
                    continue
                before = own[i - 1] + own[i]
                first = _line(costs, way[i - 1, 0], way[i - 1, 1], r, c)
                if not first < before:
                    continue
                second = _line(costs, r, c, way[i + 1, 0], way[i + 1, 1])
                if first + second < before - 1e-12:
                    way[i, 0], way[i, 1], own[i - 1], own[i] = r, c, first, second
        step *= 0.5
