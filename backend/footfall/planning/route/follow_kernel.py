"""The way that leads from a place to the goal, by what the corners around it cost."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit

Floats = NDArray[np.float64]

_NEAR = 1e-7
"""A point so near to a corner or an edge is on it [edges]."""
# the edges of a cell, south, east, north, west: rows and columns of both ends, and of the cell on the other side
_ENDS = np.array([[0, 0, 0, 1], [0, 1, 1, 1], [1, 0, 1, 1], [0, 0, 1, 0]])
_BEYOND = np.array([[-1, 0], [0, 1], [1, 0], [0, -1]])


@njit()
def onward(costs: Floats, g: Floats, at: Floats, out: Floats) -> float:
    """The place on the edges of the cells that hold ``at`` over which the goal costs least, into ``out``; that cost.

    Source: the interpolation of Ferguson & Stentz (2005), from any point instead of a corner.
    """
    best = math.inf
    row, col = round(at[0]), round(at[1])
    on_row, on_col = abs(at[0] - row) < _NEAR, abs(at[1] - col) < _NEAR
    south = int(row) - 1 if on_row else math.floor(at[0])
    north = int(row) if on_row else south
    west = int(col) - 1 if on_col else math.floor(at[1])
    east = int(col) if on_col else west
    for r in range(south, north + 1):
        for c in range(west, east + 1):
            cost = costs[r, c]
            for side in range(4):
                ar, ac = r + _ENDS[side, 0], c + _ENDS[side, 1]
                br, bc = r + _ENDS[side, 2], c + _ENDS[side, 3]
                along = min(cost, costs[r + _BEYOND[side, 0], c + _BEYOND[side, 1]])
                best = _edge(g, at, ar, ac, br, bc, cost, along, best, out)
    return best


@njit()
def _edge(
    g: Floats,
    at: Floats,
    ar: int,
    ac: int,
    br: int,
    bc: int,
    cost: float,
    along: float,
    best: float,
    out: Floats,
) -> float:
    """Least of ``best`` and the cost over the edge from a to b; where that is goes into ``out``."""
    off = abs(at[0] - ar) if ar == br else abs(at[1] - ac)
    share = at[1] - ac if ar == br else at[0] - ar
    ga, gb = g[ar, ac], g[br, bc]
    if min(ga, gb) + min(cost, along) * off >= best:
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
    for choice in range(3):
        t = float(choice)
        if choice == 2:
            gain = ga - gb
            if not math.isfinite(gain) or abs(gain) >= cost:
                continue
            t = share + off * gain / math.sqrt(cost * cost - gain * gain)
            if not 0.0 < t < 1.0:
                continue
        there = ga if t == 0.0 else gb if t == 1.0 else (1.0 - t) * ga + t * gb
        total = cost * math.sqrt(off * off + (t - share) ** 2) + there
        if total < best:
            best = total
            out[0], out[1] = ar + t * (br - ar), ac + t * (bc - ac)
    return best


@njit()
def follow(costs: Floats, g: Floats, begin: Floats, goal: Floats, most: int) -> Floats:
    """Points (n, 2) from ``begin``, (row, column) in edges; the last is ``goal`` where a way leads there."""
    way = np.empty((most, 2))
    way[0] = begin
    count = 1
    there = np.empty(2)
    while count < most - 1:
        at = way[count - 1]
        row, col = math.floor(goal[0]), math.floor(goal[1])
        inside = row - _NEAR <= at[0] <= row + 1 + _NEAR and col - _NEAR <= at[1] <= col + 1 + _NEAR
        if inside and costs[row, col] < math.inf:
            way[count] = goal
            return way[: count + 1]
        found = onward(costs, g, at, there)
        if found == math.inf:
            return way[:count]
        way[count] = there
        count += 1
    return way[:count]
