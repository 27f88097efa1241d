"""Shortening of a path: Dijkstra over its waypoints, then over finer ones, while that pays.

After the smoothing of Klampt and of "Motion planning for a six-legged lunar robot" (Hauser, Bretl,
Latombe & Wilcox, 2006): every pair of waypoints that see each other is an edge; the shortest path
over them replaces the old one; bisecting its segments gives new waypoints to shortcut between.
Length is Euclidean in joint space.
"""

import heapq
import itertools

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.joint_path import length
from footfall.planning.step.search.edges import Space

LEAST_GAIN = 0.25
MOST_WAYPOINTS = 48
"""All pairs may be tried, so their number is bounded: 48 waypoints are at most 1128 edges a round."""


def smooth(space: Space, path: Array, least_gain: float = LEAST_GAIN) -> Array:
    """Shorter waypoints with the same ends, every edge free at the space's ε.

    Args:
        space: what is free.
        path: waypoints, (n, d).
        least_gain: rounds go on until one shortens the path by less than this share of its length.

    Returns:
        (m, d).
    """
    if len(path) == 2:
        return _thinned(path)
    seen: dict[tuple[bytes, bytes], bool] = {}
    for a, b in itertools.pairwise(path):
        seen[a.tobytes(), b.tobytes()] = True
    before = length(path)
    path = shortest(space, _thinned(path), seen) if len(path) <= MOST_WAYPOINTS else _coarse(space, path, seen)
    while before > 0 and length(path) > 0:
        finer = bisected(path)
        if len(finer) == len(path) or len(finer) > MOST_WAYPOINTS:
            break
        for a, b in itertools.pairwise(finer):
            seen[a.tobytes(), b.tobytes()] = True
        shorter = shortest(space, finer, seen)
        gain = 1.0 - length(shorter) / length(path)
        path = shorter
        if gain < least_gain:
            break
    return path


def _thinned(path: Array) -> Array:
    """Without repeated waypoints."""
    keep = np.r_[True, np.abs(np.diff(path, axis=0)).max(axis=1) > 0]
    return path[keep]


def _coarse(space: Space, path: Array, seen: dict[tuple[bytes, bytes], bool]) -> Array:
    """Shorten a long path piece by piece until it is short enough to take whole."""
    while len(path) > MOST_WAYPOINTS:
        pieces = [
            shortest(space, _thinned(path[i : i + MOST_WAYPOINTS]), seen)
            for i in range(0, len(path) - 1, MOST_WAYPOINTS - 1)
        ]
        joined = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
        if len(joined) == len(path):
            return joined
        path = joined
    return shortest(space, path, seen)


def bisected(path: Array) -> Array:
    """The path (n, d) with the middle of every segment as a further waypoint, (2n − 1, d)."""
    out = np.empty((2 * len(path) - 1, path.shape[1]))
    out[::2] = path
    out[1::2] = 0.5 * (path[:-1] + path[1:])
    return out


def shortest(space: Space, path: Array, seen: dict[tuple[bytes, bytes], bool]) -> Array:
    """Shortest route over waypoints from the first to the last, all pairs being candidates.

    Dijkstra (1959) with the straight-line distance to the goal as bound, which never exceeds what is left, so the route
    is the shortest. An edge is tested when its end is taken from the queue, so most are never tested.

    Args:
        space: what is free.
        path: waypoints, (n, d).
        seen: remembers tested edges.

    Returns:
        (m, d).
    """
    goal = len(path) - 1
    distance = np.linalg.norm(path[:, None] - path[None, :], axis=2)
    keys = [q.tobytes() for q in path]

    def visible(i: int, j: int) -> bool:
        key = (keys[i], keys[j])
        if key not in seen:
            seen[key] = seen[key[::-1]] = space.edge_is_free(path[i], path[j])
        return seen[key]

    came: dict[int, int] = {}
    queue: list[tuple[float, float, int, int]] = [(float(distance[0, goal]), 0.0, 0, 0)]
    while queue:
        _, travelled, i, source = heapq.heappop(queue)
        if i in came or (i != source and not visible(source, i)):
            continue
        came[i] = source
        if i == goal:
            break
        for j in range(len(path)):
            if j not in came:
                so_far = travelled + float(distance[i, j])
                heapq.heappush(queue, (so_far + float(distance[j, goal]), so_far, j, i))
    route = [goal]
    while route[-1] != 0:
        route.append(came[route[-1]])
    return path[route[::-1]]
