"""What corners cost, from the goal outwards, on a grid of which nothing is known yet.

Corners wait in lists by what they cost, all in one list a little more than in the one before it. A list is no wider
than what an edge costs at least, where cells differ little in cost: so none in it makes another one in it cheaper, and
each is looked at once, without a heap. Source: R. B. Dial, "Algorithm 360: shortest-path forest with topological
ordering" (CACM 12, 1969); with wider lists, looked at in rounds, it is U. Meyer & P. Sanders, "Δ-stepping" (1998).
"""

import math

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints, Ints32
from footfall.planning.route.corners_kernel import BESIDE, NONE, Records, over

LISTS = 1024
"""Lists of corners; one more holds all that cost more than those do."""
WIDTH, RISE, FIRST, NEXT, LOOKED_AT = 0, 1, 2, 3, 4
"""Places in the numbers of a spread: how wide a list is; how much more than its neighbours a corner costs at least; of
which number, counted in widths from nothing, the first list is; which list is next; corners that were looked at."""


@njit()
def _list_of(numbers: Array, cost: float) -> int:
    """The list of what costs so much."""
    number = cost / numbers[WIDTH] - numbers[FIRST]
    return int(number) if number < LISTS else LISTS


@njit()
def _put(corners: Records, lists: Ints32, corner: int, at: int) -> None:
    following = lists[at]
    lists[at] = corner
    corners[corner].after, corners[corner].before = following, NONE
    if following != NONE:
        corners[following].before = corner


@njit()
def _take(corners: Records, lists: Ints32, corner: int, at: int) -> None:
    following, before = corners[corner].after, corners[corner].before
    if before == NONE:
        lists[at] = following
    else:
        corners[before].after = following
    if following != NONE:
        corners[following].before = before


@njit()
def begin(corners: Records, ends: Array, lists: Ints32, numbers: Array) -> None:
    """Put the corners beside the goal into their lists; ends: (m, 2) they and what they cost."""
    for i in range(len(ends)):
        corner = int(ends[i, 0])
        corners[corner].rhs = ends[i, 1]
        _put(corners, lists, corner, _list_of(numbers, ends[i, 1]))


@njit()
def spread(
    corners: Records, steps: Ints, around: Ints32, beyond: float, lists: Ints32, numbers: Array, most: int
) -> bool:
    """Look at corners until those ``around`` the rover are right; whether they are, or nothing waits.

    beyond: corners that cost so much more are looked at too. most: corners in one call, about.
    """
    enough = numbers[LOOKED_AT] + most
    while numbers[LOOKED_AT] < enough:
        at = int(numbers[NEXT])
        if at == LISTS:
            if lists[LISTS] == NONE:
                return True
            _farther(corners, lists, numbers)
        elif lists[at] == NONE:
            known = 0.0
            for corner in around:
                known = max(known, corners[corner].rhs)
            if known + beyond < (numbers[FIRST] + at) * numbers[WIDTH]:
                return True
            numbers[NEXT] += 1
        else:
            _look_at(corners, steps, lists, at, numbers)
    return False


@njit()
def _look_at(corners: Records, steps: Ints, lists: Ints32, at: int, numbers: Array) -> None:
    """All corners of a list become known, and their neighbours cheaper; those may come into the same list again."""
    corner = int(lists[at])
    lists[at] = NONE
    while corner != NONE:
        following = int(corners[corner].after)
        own = corners[corner].rhs
        corners[corner].g = own
        numbers[LOOKED_AT] += 1
        for k in range(8):
            beside = corner + steps[BESIDE, k]
            before = corners[beside].rhs
            if before <= own + numbers[RISE]:
                continue
            least = before
            for pair in ((k + 3) & 7, (k + 4) & 7):
                cost = over(corners, steps, beside, pair)
                if cost < least:
                    least, corners[beside].way = cost, pair
            if least < before:
                _move(corners, lists, beside, least, numbers)
        corner = following


@njit()
def _move(corners: Records, lists: Ints32, corner: int, cost: float, numbers: Array) -> None:
    """A corner became cheaper: put it into its list, out of that where it waits."""
    rhs, to = corners[corner].rhs, _list_of(numbers, cost)
    waits = rhs < corners[corner].g
    at = _list_of(numbers, rhs) if waits else NONE
    corners[corner].rhs = cost
    if at == to:
        return
    if waits:
        _take(corners, lists, corner, at)
    _put(corners, lists, corner, to)


@njit()
def _farther(corners: Records, lists: Ints32, numbers: Array) -> None:
    """Let the lists begin with the cheapest corner that is left in the last one, and fill them from it."""
    left = int(lists[LISTS])
    lists[LISTS] = NONE
    least, corner = math.inf, left
    while corner != NONE:
        least = min(least, corners[corner].rhs)
        corner = int(corners[corner].after)
    numbers[FIRST], numbers[NEXT] = math.floor(least / numbers[WIDTH]), 0
    while left != NONE:
        following = int(corners[left].after)
        _put(corners, lists, left, _list_of(numbers, corners[left].rhs))
        left = following
