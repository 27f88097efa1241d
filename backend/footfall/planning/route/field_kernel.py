"""Field D*: what each corner of a grid of cells is away from the goal, kept right while costs change.

Source: D. Ferguson & A. Stentz, "Field D*: an interpolation-based path planner and replanner" (ISRR 2005); the order
in which corners are looked at is D* Lite's (S. Koenig & M. Likhachev, AAAI 2002).

A cell costs so much for each length of an edge. Lengths are counted in edges, rows go north, columns east. Corner
(r, c) is the south-west one of cell (r, c). Arrays of cells and of corners have one shape and are flat. They have a
border, cells that are blocked and corners that are never reached, so that nothing asks where the grid ends.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Steps = NDArray[np.int64]

SIZE, SHIFT, ESTIMATE, LOOKED_AT, COLS = 0, 1, 2, 3, 4
"""Places in the numbers of a search: how many corners wait; Koenig's k_m; how much at least is left for
each edge; corners that were looked at; columns of the grid."""
NONE = -1


class Corners(NamedTuple):
    """What is known of cells and corners, flat.

    costs: of cells. g: what a corner costs, rhs: what it would by its neighbours; ways: the pair of neighbours that rhs
    comes from. steps: see steps_of. heap, first, second: corners that wait and their keys; places: of each corner in
    the heap. numbers: see SIZE and on.
    """

    costs: Floats
    g: Floats
    rhs: Floats
    ways: NDArray[np.int8]
    steps: Steps
    heap: Ints
    first: Floats
    second: Floats
    places: Ints
    numbers: Floats


BESIDE, INSIDE, ACROSS, STRAIGHT, DIAGONAL, NORTH, EAST = 0, 1, 2, 3, 4, 5, 6
"""Rows of the steps."""


def steps_of(cols: int) -> NDArray[np.int64]:
    """(7, 8) steps in flat arrays of ``cols`` columns, for neighbours k counter-clockwise from the east.

    BESIDE: to neighbour k. Of pair k, neighbours k and k + 1: INSIDE: to the cell between them; ACROSS: to the cell on
    the other side of the edge to the one that is straight ahead; STRAIGHT, DIAGONAL: to the two. NORTH, EAST: rows and
    columns to neighbour k.
    """
    row = np.array([[0, 1, 1, 1, 0, -1, -1, -1], [0, 0, 0, 0, -1, -1, -1, -1], [-1, 0, 0, -1, 0, -1, -1, 0]])
    col = np.array([[1, 1, 0, -1, -1, -1, 0, 1], [0, 0, -1, -1, -1, -1, 0, 0], [0, -1, 0, -1, -1, 0, -1, 0]])
    beside, inside, across = row * cols + col
    straight, diagonal = beside[[0, 2, 2, 4, 4, 6, 6, 0]], beside[[1, 1, 3, 3, 5, 5, 7, 7]]
    return np.ascontiguousarray([beside, inside, across, straight, diagonal, row[0], col[0]], np.int64)


@njit()
def edge_cost(inside: float, beside: float, straight: float, diagonal: float) -> float:
    """Least cost from a corner over the edge between two neighbours: ComputeCost of the paper (its Figure 6).

    inside: cost of the cell between; beside: of that on the other side of the edge to the neighbour straight ahead.
    straight, diagonal: what the neighbours cost; between them it changes evenly.
    """
    along = min(inside, beside)
    if along == math.inf or (straight == math.inf and diagonal == math.inf):
        return math.inf
    if straight <= diagonal or inside == math.inf:
        return along + straight
    gain = straight - diagonal
    bound = min(gain, beside)
    if inside <= bound:
        return inside * math.sqrt(2.0) + diagonal
    share = min(bound / math.sqrt(inside * inside - bound * bound), 1.0)
    return inside * math.sqrt(1.0 + share * share) + bound * (1.0 - share) + diagonal


@njit()
def _over(known: Corners, corner: int, pair: int) -> float:
    """What a corner costs when it is left over the edge of a pair of neighbours."""
    steps = known.steps
    return edge_cost(
        known.costs[int(corner + steps[INSIDE, pair])],
        known.costs[int(corner + steps[ACROSS, pair])],
        known.g[int(corner + steps[STRAIGHT, pair])],
        known.g[int(corner + steps[DIAGONAL, pair])],
    )


@njit()
def _rise(known: Corners, at: int) -> int:
    """Bring an entry of the heap up to where it belongs; its place."""
    heap, first, second, places = known.heap, known.first, known.second, known.places
    corner, key, least = heap[at], first[at], second[at]
    while at > 0:
        parent = (at - 1) // 2
        if first[parent] < key or (first[parent] == key and second[parent] <= least):
            break
        heap[at], first[at], second[at] = heap[parent], first[parent], second[parent]
        places[heap[at]] = at
        at = parent
    heap[at], first[at], second[at], places[corner] = corner, key, least, at
    return at


@njit()
def _sink(known: Corners, size: int, at: int) -> None:
    """Bring an entry of the heap down to where it belongs."""
    heap, first, second, places = known.heap, known.first, known.second, known.places
    corner, key, least = heap[at], first[at], second[at]
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        right = child + 1
        if right < size and (
            first[right] < first[child] or (first[right] == first[child] and second[right] < second[child])
        ):
            child = right
        if key < first[child] or (key == first[child] and least <= second[child]):
            break
        heap[at], first[at], second[at] = heap[child], first[child], second[child]
        places[heap[at]] = at
        at = child
    heap[at], first[at], second[at], places[corner] = corner, key, least, at


@njit()
def _wait(known: Corners, corner: int, key: float, least: float) -> None:
    """Put a corner into the queue, or to another place of it."""
    at = int(known.places[corner])
    if at == NONE:
        at = int(known.numbers[SIZE])
        known.numbers[SIZE] += 1
        known.heap[at], known.places[corner] = corner, at
    known.first[at], known.second[at] = key, least
    _sink(known, int(known.numbers[SIZE]), _rise(known, at))


@njit()
def _leave(known: Corners, corner: int) -> None:
    """Take a corner out of the queue."""
    heap, first, second = known.heap, known.first, known.second
    at, last = int(known.places[corner]), int(known.numbers[SIZE]) - 1
    known.places[corner] = NONE
    known.numbers[SIZE] = last
    if at < last:
        heap[at], first[at], second[at] = heap[last], first[last], second[last]
        _sink(known, last, _rise(known, at))


@njit()
def _estimate(known: Corners, here: Floats, row: int, col: int) -> float:
    """At least so much from ``here`` to a corner."""
    north, east = row - here[0], col - here[1]
    return known.numbers[ESTIMATE] * math.sqrt(north * north + east * east)


@njit()
def _settle(known: Corners, here: Floats, corner: int, row: int, col: int) -> None:
    """UpdateVertex: a corner waits as long as g and rhs differ."""
    if known.g[corner] != known.rhs[corner]:
        least = min(known.g[corner], known.rhs[corner])
        _wait(known, corner, least + _estimate(known, here, row, col) + known.numbers[SHIFT], least)
    elif known.places[corner] != NONE:
        _leave(known, corner)


@njit()
def _anew(known: Corners, ends: Floats, corner: int) -> None:
    """rhs of a corner from all its pairs; ends: (m, 2) the corners beside the goal and what they cost."""
    least, best = math.inf, NONE
    for i in range(len(ends)):
        if ends[i, 0] == corner:
            least = ends[i, 1]
    for pair in range(8):
        cost = _over(known, corner, pair)
        if cost < least:
            least, best = cost, pair
    known.rhs[corner], known.ways[corner] = least, best


@njit()
def change(known: Corners, here: Floats, ends: Floats, cells: NDArray[np.int64], values: Floats) -> None:
    """Give cells (k,) other costs (k,); the corners around them wait."""
    for i in range(len(cells)):
        known.costs[cells[i]] = values[i]
    cols = int(known.numbers[COLS])
    for i in range(len(cells)):
        for corner in (cells[i], cells[i] + 1, cells[i] + cols, cells[i] + cols + 1):
            _anew(known, ends, corner)
            _settle(known, here, corner, corner // cols, corner % cols)


@njit()
def _enough(known: Corners, here: Floats, beyond: float) -> bool:
    """Whether all four corners around ``here`` are known, and nothing that waits can make them less."""
    row, col, cols = int(here[0]), int(here[1]), int(known.numbers[COLS])
    most = 0.0
    for r in (row, row + 1):
        for c in (col, col + 1):
            if known.g[r * cols + c] != known.rhs[r * cols + c]:
                return False
            if known.rhs[r * cols + c] < math.inf:
                most = max(most, known.rhs[r * cols + c] + _estimate(known, here, r, c))
    # where no corner is reached yet there is all to look at
    return most > 0.0 and known.first[0] > most + beyond + known.numbers[SHIFT]


@njit()
def look(known: Corners, here: Floats, ends: Floats, beyond: float, most: int) -> bool:
    """ComputeShortestPath: look at corners until those around ``here`` are right; whether they are.

    beyond: corners that cost so much more are looked at too. most: corners in one call.
    """
    g, rhs, cols = known.g, known.rhs, int(known.numbers[COLS])
    for _ in range(most):
        if known.numbers[SIZE] == 0 or _enough(known, here, beyond):
            return True
        corner = int(known.heap[0])
        row, col = corner // cols, corner % cols
        least = min(g[corner], rhs[corner])
        key = least + _estimate(known, here, row, col) + known.numbers[SHIFT]
        if known.first[0] < key:
            _wait(known, corner, key, least)
            continue
        known.numbers[LOOKED_AT] += 1
        if g[corner] > rhs[corner]:
            g[corner] = rhs[corner]
            _leave(known, corner)
            _lower(known, here, corner, row, col)
        else:
            g[corner] = math.inf
            _settle(known, here, corner, row, col)
            _raise(known, here, ends, corner, row, col)
    return False


@njit()
def _lower(known: Corners, here: Floats, corner: int, row: int, col: int) -> None:
    """A corner became cheaper: so may its neighbours, over the two edges that it ends."""
    rhs, own = known.rhs, known.g[corner]
    for k in range(8):
        beside = corner + known.steps[BESIDE, k]
        # a way over this corner costs more than it does
        if rhs[beside] <= own:
            continue
        better = False
        for pair in ((k + 3) & 7, (k + 4) & 7):
            cost = _over(known, beside, pair)
            if cost < rhs[beside]:
                rhs[beside], known.ways[beside] = cost, pair
                better = True
        if better:
            _settle(known, here, beside, row + known.steps[NORTH, k], col + known.steps[EAST, k])


@njit()
def _raise(known: Corners, here: Floats, ends: Floats, corner: int, row: int, col: int) -> None:
    """A corner is no longer known: neighbours that went over it look for another way."""
    for k in range(8):
        beside = corner + known.steps[BESIDE, k]
        back = (k + 4) % 8
        if known.ways[beside] == back or known.ways[beside] == (back + 7) % 8:
            _anew(known, ends, beside)
            _settle(known, here, beside, row + known.steps[NORTH, k], col + known.steps[EAST, k])
