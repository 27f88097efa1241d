"""The cheapest way where turning on the spot costs something: places and headings searched together.

Exact over the middles of cells in eight directions; then each part at one heading is cut short where a straight line
is no dearer.
"""

import math
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.planning.route import turning_kernel as kernel
from footfall.planning.route.straighten import straightened

MOST_STATES = 1 << 23
"""Cells × headings of a half turn that are searched together at most: some 250 MB."""
AT_ONCE = 200_000
"""States that are looked at between two reports of progress."""


def way_with_turns(
    geometry: GridGeometry,
    metre: Array,
    begin: ArrayLike,
    goal: ArrayLike,
    yaw: float,
    turning: float,
    progress: Progress = no_progress,
) -> tuple[Array, float]:
    """The way whose metres and turns cost least over the middles of cells; cut short, it may cost less.

    Args:
        geometry: the grid.
        metre: (headings / 2, rows, cols) what one costs, at least 1; heading k is 2 π k / headings from east, and the
            other half turn costs the same.
        begin: x, y (2,) in site [m].
        goal: x, y (2,) in site [m].
        yaw: how the rover faces now [rad]; it may turn to any heading first.
        turning: what a radian costs [m].
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        Points (n, 2) [m] and what the way costs; no points and infinite where none leads.

    Raises:
        InvalidInput: there are more than MOST_STATES cells × headings.
        Cancelled: ``progress`` raised it.
    """
    if metre.size > MOST_STATES:
        raise InvalidInput(
            f"ways are searched together with their headings over at most {MOST_STATES} cells × headings of a half "
            f"turn, these are {metre.size}: take coarser cells, fewer headings, or search the way alone",
            cells=metre.size,
        )
    half, rows, cols = metre.shape
    size, step = geometry.resolution, turning * math.pi / half
    first, last = np.asarray(begin, np.float64), np.asarray(goal, np.float64)
    here, there = _cell(geometry, first), _cell(geometry, last)
    target = np.array(there, np.int32)
    free = np.isfinite(metre)
    ends = np.where(free[:, *there], metre[:, *there], 1.0) * math.dist(last, _middle(geometry, *there))
    costs, origins = np.full(metre.size, math.inf), np.full(metre.size, kernel.NONE, np.int32)
    ids, keys = np.empty(metre.size, np.int32), np.empty(metre.size)
    places, numbers = np.full(metre.size, kernel.NONE, np.int32), np.array([0.0, math.inf, kernel.NONE])
    waiting = (costs, origins, ids, keys, places, numbers)
    for heading in np.flatnonzero(free[:, *here]):
        # both ways of facing along one line cost the same from here on
        turned = abs(math.remainder(math.pi * heading / half - yaw, math.pi))
        spent = turning * turned + metre[heading, *here] * math.dist(first, _middle(geometry, *here))
        state = int(heading * rows + here[0]) * cols + here[1]
        kernel.reach(state, float(spent), kernel.NONE, kernel.least(*here, target, size), *waiting)
    while not kernel.look(metre, size, step, target, ends, *waiting, AT_ONCE):
        progress(0.5, "looking for the cheapest way with its turns")
    if math.isinf(numbers[kernel.BEST]):
        return np.empty((0, 2)), math.inf
    states, state = [], int(numbers[kernel.LAST])
    while state != kernel.NONE:
        states.append(state)
        state = int(origins[state])
    return _shortened(geometry, metre, states[::-1], first, last), float(numbers[kernel.BEST])


def _shortened(geometry: GridGeometry, metre: Array, states: list[int], begin: Array, goal: Array) -> Array:
    """The way over states, each part at one heading cut short; where it turns it keeps to the middle of that cell."""
    _, rows, cols = metre.shape
    origin = np.array([geometry.y0, geometry.x0])
    begin_at, goal_at = ((place[::-1] - origin) / geometry.resolution + 1.5 for place in (begin, goal))
    cells = [state % (rows * cols) for state in states]
    middles = np.array([(cell // cols + 1.5, cell % cols + 1.5) for cell in cells])
    headings = [state // (rows * cols) for state in states]
    points, first = [begin_at], 0
    for heading, group in groupby(headings):
        last = first + len(list(group))
        line = np.vstack([points[-1:], middles[first:last], [goal_at] if last == len(states) else np.empty((0, 2))])
        line = line[np.append(True, (np.diff(line, axis=0) != 0.0).any(axis=1))]
        if len(line) > 1:
            padded = np.full((rows + 3, cols + 3), math.inf)
            padded[1 : rows + 1, 1 : cols + 1] = metre[heading]
            points += list(straightened(padded, line)[0][1:])
        first = last
    return origin[::-1] + geometry.resolution * (np.array(points)[:, ::-1] - 1.5)


def _cell(geometry: GridGeometry, place: Array) -> tuple[int, int]:
    row, col = geometry.cell(*place)
    return int(np.clip(row, 0, geometry.rows - 1)), int(np.clip(col, 0, geometry.cols - 1))


def _middle(geometry: GridGeometry, row: int, col: int) -> tuple[float, float]:
    """x, y [m]."""
    return geometry.x0 + col * geometry.resolution, geometry.y0 + row * geometry.resolution
