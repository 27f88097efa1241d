"""Which way the chassis faces along a route, where turning on the spot costs something: the cheapest for that way.

The way is cut into pieces, each in one cell. Dynamic programming over pieces × headings: the chassis keeps its heading
along a piece, and turns at its ends, through headings that the piece's ground allows. Within a cell a metre costs the
same everywhere, so turning between the ends of a piece is never cheaper.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array, Ints
from footfall.core.grid import GridGeometry

_NEAR = 1e-9
"""Two cuts of a straight part that are so near to each other are one; a point so near to an edge is on it [cells]."""


@dataclass(frozen=True, eq=False)
class WayPieces:
    """A way cut where it passes from one cell to the next.

    points: (n + 1, 2) x, y [m]; corners: (n + 1,) whether the way itself has a point there. lengths: (n,) [m]. cells:
    (n, 2, 2) row and column of the cell that each lies in, and of the one beside it where it goes along an edge.
    """

    points: Array
    corners: NDArray[np.bool_]
    lengths: Array
    cells: Ints


@dataclass(frozen=True, eq=False)
class Faced:
    """A way with a heading [rad] for each of its straight parts: points (n + 1, 2) [m], headings (n,), cost."""

    points: Array
    headings: Array
    cost: float


def pieces(geometry: GridGeometry, way: Array) -> WayPieces:
    """A way (n, 2) [m] over a grid, cut at its cells' edges."""
    size = geometry.resolution
    edges = (way - (geometry.x0, geometry.y0)) / size + 0.5
    points, corners, lengths, middles = [way[0]], [True], [], []
    for (a, b), (from_, to) in zip(pairwise(edges), pairwise(way), strict=True):
        length = float(np.linalg.norm(b - a))
        if length <= _NEAR:
            continue
        cuts = [np.array([0.0, 1.0])]
        for axis in range(2):
            if abs(b[axis] - a[axis]) > _NEAR:
                low, high = sorted((a[axis], b[axis]))
                cuts.append((np.arange(math.ceil(low), math.floor(high) + 1) - a[axis]) / (b[axis] - a[axis]))
        at = np.sort(np.concatenate(cuts))
        at = at[(at >= 0.0) & (at <= 1.0)]
        at = at[np.append(np.diff(at) > _NEAR / length, True)]
        at[0] = 0.0
        for begin, end in pairwise(at):
            points.append(to if end == 1.0 else from_ + end * (to - from_))
            corners.append(bool(end == 1.0))
            lengths.append((end - begin) * length * size)
            middles.append(a + 0.5 * (begin + end) * (b - a))
    cells = np.array([_cells(middle, geometry) for middle in middles], np.int64).reshape(-1, 2, 2)
    return WayPieces(np.array(points), np.array(corners), np.array(lengths), cells)


def _cells(middle: Array, geometry: GridGeometry) -> list[list[int]]:
    """The cell of a place x, y in edges, and the one on the other side of an edge that it is on."""
    whole = np.round(middle)
    on_edge = np.abs(middle - whole) < _NEAR
    upper = np.where(on_edge, whole, np.floor(middle)).astype(int)
    lower = upper - on_edge
    most = np.array([geometry.cols, geometry.rows]) - 1
    return [[int(col_row[1]), int(col_row[0])] for col_row in (np.clip(lower, 0, most), np.clip(upper, 0, most))]


def faced(cut: WayPieces, costs: Array, yaw: float, turning: float) -> Faced | tuple[float, float]:
    """The cheapest headings along a way.

    Args:
        cut: the way in pieces.
        costs: (headings, pieces) of a metre, infinite where the chassis must not face so; heading k is 2 π k / headings
            from east.
        yaw: how the rover faces now [rad]; as it stands there already, it may turn to any heading first.
        turning: what a radian costs [m].

    Returns:
        The headings and what they cost, or where x, y [m] none goes on.
    """
    count, number = costs.shape
    if not number:
        return Faced(np.array([cut.points[0], cut.points[0]]), np.array([yaw]), 0.0)
    angles = 2.0 * math.pi * np.arange(count) / count
    step = turning * 2.0 * math.pi / count
    spent = turning * np.abs(np.remainder(angles - yaw + math.pi, 2.0 * math.pi) - math.pi)
    origins = np.empty((number, count), np.int64)
    for i in range(number):
        allowed = np.isfinite(costs[:, i])
        spent = np.where(allowed, spent, math.inf)
        if not np.isfinite(spent).any():
            return float(cut.points[i, 0]), float(cut.points[i, 1])
        turned, first = (spent, np.arange(count)) if i == 0 else _turned(spent, np.arange(count), allowed, step)
        moved = np.where(allowed, turned + cut.lengths[i] * np.where(allowed, costs[:, i], 0.0), math.inf)
        spent, second = _turned(moved, np.arange(count), allowed, step)
        # along the piece it faces ``second``, into it came ``first`` of that
        origins[i] = first[second] * count + second
    heading = int(np.argmin(spent))
    cost = float(spent[heading])
    along = np.empty(number, np.int64)
    for i in range(number - 1, -1, -1):
        heading, along[i] = divmod(int(origins[i, heading]), count)
    keeps = np.append(cut.corners[1:-1] | (along[1:] != along[:-1]), True)
    points = np.vstack([cut.points[:1], cut.points[1:][keeps]])
    return Faced(points, angles[along[keeps]], cost)


def _turned(spent: Array, at: Ints, allowed: NDArray[np.bool_], step: float) -> tuple[Array, Ints]:
    """The least that each heading costs with a turn through allowed ones, and from which heading it comes.

    step: of a turn to the next heading. Twice around either way every turn has been looked at.
    """
    cost, origin, count = spent.tolist(), at.tolist(), len(spent)
    free = allowed.tolist()
    for way in (1, -1):
        for k in range(2 * count):
            here, there = (way * k) % count, (way * (k + 1)) % count
            if free[here] and free[there] and cost[here] + step < cost[there]:
                cost[there], origin[there] = cost[here] + step, origin[here]
    return np.array(cost), np.array(origin, np.int64)
