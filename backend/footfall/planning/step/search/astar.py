"""A* over a grid in task space, each grid point standing for the postures that reach it.

The wheel centre moves between the points of a cubic grid that starts at the lifted wheel; the goal hangs onto
the grid points around it. A point is reached on several branches of the inverse kinematics, each a place of its own:
neighbours are joined only where the joints change little, so a path never flips from branch to branch, but may
pass from one to the next where they meet (a straight wrist). Between two places the leg moves along the straight
joint-space edge. An edge is tested when its end is taken from the queue, so the path found is still the shortest
in the task space while most edges are never tested.
"""

import heapq
import itertools
from collections.abc import Callable

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.step.search.edges import Space

_NEIGHBOURS = np.array([o for o in itertools.product((-1, 0, 1), repeat=3) if any(o)])

Cell = tuple[int, int, int]
Place = tuple[Cell | None, int]
"""A grid point (None: the goal) and which of its configurations."""

_START: Place = ((0, 0, 0), -1)
_GOAL: Place = (None, 0)


def astar(
    space: Space,
    postures: Callable[[Array], Array],
    start: tuple[Array, Array],
    goal: tuple[Array, Array],
    cell: float,
    largest_jump: float = 1.0,
) -> Array | None:
    """Waypoints of the shortest path over a grid of places.

    Args:
        space: what is free.
        postures: places (k, 3) [m] → configurations (k, branches, d), NaN where there is none.
        start: place (3,) [m] and configuration (d,), free.
        goal: the same, free.
        cell: side of the grid's cells [m].
        largest_jump: a change of one coordinate above this between neighbours is taken for a break of continuity [rad].

    Returns:
        (n, d), or None where the grid holds none.
    """
    origin, q_start = start
    target, q_goal = goal
    reached: dict[Cell, Array] = {}
    config: dict[Place, Array] = {_START: q_start, _GOAL: q_goal}
    free: dict[Place, bool] = {_START: True, _GOAL: True}

    def point(at: Place) -> Array:
        return target if at[0] is None else origin + cell * np.array(at[0])

    def around(at: Place) -> list[Place]:
        """Neighbours that the leg can follow to."""
        here = np.array(at[0])
        cells: list[Cell] = [(int(i), int(j), int(k)) for i, j, k in here + _NEIGHBOURS]
        new = [c for c in cells if c not in reached]
        if new:
            reached.update(zip(new, postures(origin + cell * np.array(new, float)), strict=True))
        q = np.array([reached[c] for c in cells])
        with np.errstate(invalid="ignore"):
            close = np.abs(q - config[at]).max(axis=2) <= largest_jump
        found: list[Place] = []
        for i, branch in zip(*np.nonzero(close), strict=True):
            place = (cells[i], int(branch))
            config[place] = q[i, branch]
            found.append(place)
        near_goal = np.abs(target - point(at)).max() <= cell * (1 + 1e-9)
        if near_goal and np.abs(q_goal - config[at]).max() <= largest_jump:
            found.append(_GOAL)
        return found

    def passable(a: Place, b: Place) -> bool:
        if b not in free:
            free[b] = space.is_free(config[b])
        return free[b] and space.edge_is_free(config[a], config[b])

    came: dict[Place, Place] = {}
    order = itertools.count()
    first = float(np.linalg.norm(target - origin))
    queue: list[tuple[float, int, float, Place, Place]] = [(first, next(order), 0.0, _START, _START)]
    while queue:
        _, _, travelled, at, source = heapq.heappop(queue)
        space.tick()
        if at in came or (at != source and not passable(source, at)):
            continue
        came[at] = source
        if at == _GOAL:
            return _route(came, config)
        here = point(at)
        for place in around(at):
            if place not in came and free.get(place, True):
                there = point(place)
                so_far = travelled + float(np.linalg.norm(there - here))
                left = float(np.linalg.norm(target - there))
                heapq.heappush(queue, (so_far + left, next(order), so_far, place, at))
    return None


def _route(came: dict[Place, Place], config: dict[Place, Array]) -> Array:
    places = [_GOAL]
    while places[-1] != _START:
        places.append(came[places[-1]])
    return np.array([config[p] for p in reversed(places)])
