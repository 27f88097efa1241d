"""The way that leads from a place to the goal, by what the corners around it cost."""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array

_NEAR = 1e-7
"""A point so near to a corner or an edge is on it [edges]."""


@njit()
def onward(costs: Array, g: Array, row: float, col: float, out: Array) -> float:
    """The place on the edges of the cells that hold a place over which the goal costs least, into ``out``; that cost.

    Source: the interpolation of Ferguson & Stentz (2005), from any point instead of a corner.
    """
    best = math.inf
    south, west = math.floor(row - _NEAR), math.floor(col - _NEAR)
    north, east = math.floor(row + _NEAR), math.floor(col + _NEAR)
    for r in range(south, north + 1):
        for c in range(west, east + 1):
            cost = costs[r, c]
            to_south, to_north = min(cost, costs[r - 1, c]), min(cost, costs[r + 1, c])
            to_west, to_east = min(cost, costs[r, c - 1]), min(cost, costs[r, c + 1])
            best = _edge(g, row, col, r, c, r, c + 1, cost, to_south, best, out)
            best = _edge(g, row, col, r, c + 1, r + 1, c + 1, cost, to_east, best, out)
            best = _edge(g, row, col, r + 1, c, r + 1, c + 1, cost, to_north, best, out)
            best = _edge(g, row, col, r, c, r + 1, c, cost, to_west, best, out)
    return best


@njit()
def _edge(
    g: Array,
    row: float,
    col: float,
    ar: int,
    ac: int,
    br: int,
    bc: int,
    cost: float,
    along: float,
    best: float,
    out: Array,
) -> float:
    """Least of ``best`` and the cost over the edge from a to b, or along it; where that is goes into ``out``."""
    off = abs(row - ar) if ar == br else abs(col - ac)
    share = col - ac if ar == br else row - ar
    ga, gb = g[ar, ac], g[br, bc]
    if min(ga, gb) + along * off >= best:
        return best
    if off < _NEAR:
        # the place is on this edge: only its ends lead anywhere
        for end in range(2):
            away = abs(share - end)
            there = gb if end else ga
            if away > _NEAR and along * away + there < best:
                best = along * away + there
                out[0], out[1] = (br, bc) if end else (ar, ac)
        return best
    if cost == math.inf:
        return best
    # what it costs over the edge is convex along it
    gain = ga - gb
    if abs(gain) < cost:
        t = min(max(share + off * gain / math.sqrt(cost * cost - gain * gain), 0.0), 1.0)
    else:
        t = 1.0 if gain > 0.0 else 0.0
    there = ga if t == 0.0 else gb if t == 1.0 else (1.0 - t) * ga + t * gb
    total = cost * math.sqrt(off * off + (t - share) ** 2) + there
    if total < best:
        best = total
        out[0], out[1] = ar + t * (br - ar), ac + t * (bc - ac)
    return best


@njit()
def follow(costs: Array, g: Array, begin: Array, goal: Array, most: int) -> Array:
    """Points (n, 2) from ``begin``, (row, column) in edges; the last is ``goal`` where a way leads there."""
    way = np.empty((most, 2))
    row, col = math.floor(goal[0]), math.floor(goal[1])
    way[0, 0], way[0, 1] = begin[0], begin[1]
    out = np.empty(2)
    for last in range(most - 1):
        r, c = way[last, 0], way[last, 1]
        if row - _NEAR <= r <= row + 1 + _NEAR and col - _NEAR <= c <= col + 1 + _NEAR:
            way[last + 1, 0], way[last + 1, 1] = goal[0], goal[1]
            return way[: last + 2]
        if onward(costs, g, r, c, out) == math.inf:
            return way[: last + 1]
        way[last + 1, 0], way[last + 1, 1] = out[0], out[1]
    return way
