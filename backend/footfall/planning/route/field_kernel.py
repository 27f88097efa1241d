"""Field D*: what each corner of a grid of cells is away from the goal, kept right while costs change.

Source: D. Ferguson & A. Stentz, "Field D*: an interpolation-based path planner and replanner" (ISRR 2005); the order
in which corners are looked at is D* Lite's (S. Koenig & M. Likhachev, AAAI 2002). The corners: see corners_kernel.
"""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints, Ints32
from footfall.planning.route.corners_kernel import BESIDE, EAST, NONE, NORTH, Records, over

SIZE, SHIFT, RISE, LOOKED_AT, COLS = 0, 1, 2, 3, 4
"""Places in the numbers of a search: how many corners wait; Koenig's k_m; how much more than its neighbours a corner
costs at least, which is the estimate of what is left for each edge; corners that were looked at; columns."""
WAITING = np.dtype([("first", np.float64), ("second", np.float64), ("corner", np.int64)])
"""An entry of the queue, a heap: a corner and its keys."""
_DOUBTED = -2
"""The way of a corner beside a cell that changed."""


@njit()
def _less(first: float, second: float, other: float, last: float) -> bool:
    """Whether keys come before ``other`` and ``last``."""
    return first < other or (first == other and second < last)


@njit()
def _enter(corners: Records, queue: Records, at: int, first: float, second: float, corner: int) -> None:
    queue[at].first, queue[at].second, queue[at].corner = first, second, corner
    corners[corner].place = at


@njit()
def _put(corners: Records, queue: Records, size: int, at: int, first: float, second: float, corner: int) -> None:
    """Write an entry to where it belongs above or below a place that is free."""
    while at > 0 and _less(first, second, queue[(at - 1) // 2].first, queue[(at - 1) // 2].second):
        up = (at - 1) // 2
        _enter(corners, queue, at, queue[up].first, queue[up].second, queue[up].corner)
        at = up
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and _less(
            queue[child + 1].first, queue[child + 1].second, queue[child].first, queue[child].second
        ):
            child += 1
        if not _less(queue[child].first, queue[child].second, first, second):
            break
        _enter(corners, queue, at, queue[child].first, queue[child].second, queue[child].corner)
        at = child
    _enter(corners, queue, at, first, second, corner)


@njit()
def _wait(corners: Records, queue: Records, numbers: Array, corner: int, key: float, least: float) -> None:
    """Put a corner into the queue, or to another place of it."""
    at = int(corners[corner].place)
    if at == NONE:
        at = int(numbers[SIZE])
        numbers[SIZE] += 1
    _put(corners, queue, int(numbers[SIZE]), at, key, least, corner)


@njit()
def _leave(corners: Records, queue: Records, numbers: Array, corner: int) -> None:
    """Take a corner out of the queue."""
    at, last = int(corners[corner].place), int(numbers[SIZE]) - 1
    corners[corner].place = NONE
    numbers[SIZE] = last
    if at < last:
        _put(corners, queue, last, at, queue[last].first, queue[last].second, queue[last].corner)


@njit()
def _estimate(numbers: Array, here: Array, row: int, col: int) -> float:
    """At least so much from ``here`` to a corner."""
    north, east = row - here[0], col - here[1]
    return numbers[RISE] * math.sqrt(north * north + east * east)


@njit()
def _settle(corners: Records, queue: Records, numbers: Array, here: Array, corner: int, row: int, col: int) -> None:
    """UpdateVertex: a corner waits as long as g and rhs differ."""
    g, rhs = corners[corner].g, corners[corner].rhs
    if g != rhs:
        least = min(g, rhs)
        key = least + _estimate(numbers, here, row, col) + numbers[SHIFT]
        _wait(corners, queue, numbers, corner, key, least)
    elif corners[corner].place != NONE:
        _leave(corners, queue, numbers, corner)


@njit()
def _anew(corners: Records, steps: Ints, ends: Array, corner: int) -> None:
    """Sets rhs of a corner anew from all its pairs; ends: (m, 2) the corners beside the goal and what they cost."""
    least, best = math.inf, NONE
    for i in range(len(ends)):
        if ends[i, 0] == corner:
            least = ends[i, 1]
    for pair in range(8):
        cost = over(corners, steps, corner, pair)
        if cost < least:
            least, best = cost, pair
    corners[corner].rhs, corners[corner].way = least, best


@njit()
def take_over(corners: Records, queue: Records, numbers: Array, here: Array, lists: Ints32) -> None:
    """Put all corners that wait in lists (see spread_kernel) into the queue."""
    cols = int(numbers[COLS])
    for corner in lists:
        while corner != NONE:
            _settle(corners, queue, numbers, here, corner, corner // cols, corner % cols)
            corner = corners[corner].after


@njit()
def change(
    corners: Records,
    steps: Ints,
    queue: Records,
    numbers: Array,
    here: Array,
    ends: Array,
    cells: NDArray[np.int64],
) -> None:
    """Look anew at the corners around cells (k,) that have other costs now; they wait."""
    cols = int(numbers[COLS])
    for cell in cells:
        for corner in (cell, cell + 1, cell + cols, cell + cols + 1):
            corners[corner].way = _DOUBTED
    for cell in cells:
        for corner in (cell, cell + 1, cell + cols, cell + cols + 1):
            if corners[corner].way == _DOUBTED:
                _anew(corners, steps, ends, corner)
                _settle(corners, queue, numbers, here, corner, corner // cols, corner % cols)


@njit()
def _enough(corners: Records, queue: Records, numbers: Array, here: Array, beyond: float) -> bool:
    """Whether all four corners around ``here`` are known, and nothing that waits can make them less."""
    row, col, cols = int(here[0]), int(here[1]), int(numbers[COLS])
    most = 0.0
    for r in (row, row + 1):
        for c in (col, col + 1):
            g, rhs = corners[r * cols + c].g, corners[r * cols + c].rhs
            if g != rhs:
                return False
            if rhs < math.inf:
                most = max(most, rhs + _estimate(numbers, here, r, c))
    # where no corner is reached yet there is all to look at
    return most > 0.0 and queue[0].first > most + beyond + numbers[SHIFT]


@njit()
def look(
    corners: Records,
    steps: Ints,
    queue: Records,
    numbers: Array,
    here: Array,
    ends: Array,
    beyond: float,
    most: int,
) -> bool:
    """ComputeShortestPath: look at corners until those around ``here`` are right; whether they are.

    beyond: corners that cost so much more are looked at too. most: corners in one call.
    """
    cols = int(numbers[COLS])
    for _ in range(most):
        if numbers[SIZE] == 0 or _enough(corners, queue, numbers, here, beyond):
            return True
        corner = int(queue[0].corner)
        row, col = corner // cols, corner % cols
        g, rhs = corners[corner].g, corners[corner].rhs
        least = min(g, rhs)
        key = least + _estimate(numbers, here, row, col) + numbers[SHIFT]
        if queue[0].first < key:
            _wait(corners, queue, numbers, corner, key, least)
            continue
        numbers[LOOKED_AT] += 1
        if g > rhs:
            corners[corner].g = rhs
            _leave(corners, queue, numbers, corner)
            _lower(corners, steps, queue, numbers, here, corner, row, col)
        else:
            corners[corner].g = math.inf
            _settle(corners, queue, numbers, here, corner, row, col)
            _raise(corners, steps, queue, numbers, here, ends, corner, row, col)
    return False


@njit()
def _lower(
    corners: Records, steps: Ints, queue: Records, numbers: Array, here: Array, corner: int, row: int, col: int
) -> None:
    """A corner became cheaper: so may its neighbours, over the two edges that it ends."""
    own = corners[corner].g
    for k in range(8):
        beside = corner + steps[BESIDE, k]
        rhs = corners[beside].rhs
        # a way over this corner costs more than it does
        if rhs <= own + numbers[RISE]:
            continue
        least = rhs
        for pair in ((k + 3) & 7, (k + 4) & 7):
            cost = over(corners, steps, beside, pair)
            if cost < least:
                least, corners[beside].way = cost, pair
        if least < rhs:
            corners[beside].rhs = least
            _settle(corners, queue, numbers, here, beside, row + steps[NORTH, k], col + steps[EAST, k])


@njit()
def _raise(
    corners: Records,
    steps: Ints,
    queue: Records,
    numbers: Array,
    here: Array,
    ends: Array,
    corner: int,
    row: int,
    col: int,
) -> None:
    """A corner is no longer known: neighbours that went over it look for another way."""
    for k in range(8):
        beside = corner + steps[BESIDE, k]
        back = (k + 4) % 8
        if corners[beside].way == back or corners[beside].way == (back + 7) % 8:
            _anew(corners, steps, ends, beside)
            _settle(corners, queue, numbers, here, beside, row + steps[NORTH, k], col + steps[EAST, k])
