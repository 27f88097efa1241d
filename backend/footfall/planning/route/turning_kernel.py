"""Compiled: the cheapest way over places × headings, A* with a heap of what is still to be looked at.

A state is a heading and a cell, the chassis over the cell's middle: it goes to one of eight cells at its heading, or
turns to the heading beside that. Source: P. E. Hart, N. J. Nilsson, B. Raphael, "A formal basis for the heuristic
determination of minimum cost paths" (IEEE Trans. Systems Science and Cybernetics 4, 1968).
"""

import math

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints32

NONE = -1
SIZE, BEST, LAST = 0, 1, 2
"""Places in the numbers of a search: states that wait; what the best way costs; the state that it ends in."""
_AWAY = math.sqrt(2.0)


@njit()
def _put(ids: Ints32, keys: Array, places: Ints32, size: int, at: int, key: float, state: int) -> None:
    """Write a state to where it belongs above or below a place of the heap that is free."""
    while at > 0 and key < keys[(at - 1) // 2]:
        up = (at - 1) // 2
        ids[at], keys[at] = ids[up], keys[up]
        places[ids[at]] = at
        at = up
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if not keys[child] < key:
            break
        ids[at], keys[at] = ids[child], keys[child]
        places[ids[at]] = at
        at = child
    ids[at], keys[at], places[state] = state, key, at


@njit()
def reach(
    state: int,
    spent: float,
    over: int,
    left: float,
    costs: Array,
    origins: Ints32,
    ids: Ints32,
    keys: Array,
    places: Ints32,
    numbers: Array,
) -> None:
    """A state is reached for so much over another one: where that is less than before it waits to be looked at.

    left: at least so much from there to the goal.
    """
    if spent >= costs[state]:
        return
    costs[state], origins[state] = spent, over
    at = places[state]
    if at == NONE:
        at = int(numbers[SIZE])
        numbers[SIZE] += 1
    _put(ids, keys, places, int(numbers[SIZE]), at, spent + left, state)


@njit()
def look(
    metre: Array,
    length: float,
    step: float,
    goal: Ints32,
    ends: Array,
    costs: Array,
    origins: Ints32,
    ids: Ints32,
    keys: Array,
    places: Ints32,
    numbers: Array,
    most: int,
) -> bool:
    """Look at states until none can make the best way cheaper; whether that is so.

    metre: (headings, rows, cols) what a metre costs, at least 1, infinite where forbidden; the headings of a half turn,
    the other half having the same. length: of a cell [m]. step: of a turn to the next heading. goal: row and column.
    ends: (headings,) from the middle of that cell on. costs, origins: of each state, and over which it is reached.
    most: states in one call.
    """
    headings, rows, cols = metre.shape
    for _ in range(most):
        if numbers[SIZE] == 0 or keys[0] >= numbers[BEST]:
            return True
        state = int(ids[0])
        places[state] = NONE
        last = int(numbers[SIZE]) - 1
        numbers[SIZE] = last
        if last > 0:
            _put(ids, keys, places, last, 0, keys[last], int(ids[last]))
        heading, cell = state // (rows * cols), state % (rows * cols)
        row, col = cell // cols, cell % cols
        own = costs[state]
        if row == goal[0] and col == goal[1] and own + ends[heading] < numbers[BEST]:
            numbers[BEST], numbers[LAST] = own + ends[heading], state
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                r, c = row + dr, col + dc
                if (dr == 0 and dc == 0) or not (0 <= r < rows and 0 <= c < cols):
                    continue
                # half of the way lies in each of the two cells
                each = 0.5 * length * (_AWAY if dr != 0 and dc != 0 else 1.0)
                spent = own + each * (metre[heading, row, col] + metre[heading, r, c])
                there = (heading * rows + r) * cols + c
                reach(there, spent, state, least(r, c, goal, length), costs, origins, ids, keys, places, numbers)
        for side in (1, headings - 1):
            other = (heading + side) % headings
            if metre[other, row, col] < math.inf:
                there = (other * rows + row) * cols + col
                left = least(row, col, goal, length)
                reach(there, own + step, state, left, costs, origins, ids, keys, places, numbers)
    return False


@njit()
def least(row: int, col: int, goal: Ints32, length: float) -> float:
    """At least so much from the middle of a cell to that of the goal's, in eight directions over the best ground."""
    north, east = abs(row - goal[0]), abs(col - goal[1])
    return length * (max(north, east) + (_AWAY - 1.0) * min(north, east))
