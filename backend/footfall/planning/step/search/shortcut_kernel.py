"""Shortening of a path by shortcuts between random places on it, compiled, over surely free postures.

R. Geraerts & M. H. Overmars, "Creating high-quality paths for motion planning", IJRR 26, 2007. Length is Euclidean in
joint space.
"""

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.planning.scene.leg_free_kernel import BodyTables, edge_is_sure
from footfall.robot.proof.leg_clearance_kernel import LegTables

LEAST_GAIN = 0.005
"""Share of the path's length that a shortcut must save."""
PATIENCE = 16
"""Blocked shortcuts, one after the other, after which no more are tried."""
AT_TURNS = 0.5
"""Share of the shortcuts that cut a corner, as far on one side of a waypoint as on the other."""


@njit()
def shortened(
    path: Array,
    rng: np.random.Generator,
    tries: int,
    epsilon: float,
    clearance: LegTables,
    body: BodyTables,
    mode: int,
) -> Array:
    """Waypoints (m, 6) with the ends of ``path`` (n, 6), never longer; every new edge is sure at ε."""
    # a shortcut past one waypoint puts two in its place
    out = np.empty((path.shape[0] + tries, 6))
    out[: path.shape[0]] = path
    count = path.shape[0]
    first, last, blocked = np.empty(6), np.empty(6), 0
    for _ in range(tries):
        if count < 3 or blocked == PATIENCE:
            break
        total = 0.0
        for k in range(count - 1):
            total += _length(out[k], out[k + 1])
        a, b = rng.random() * total, rng.random() * total
        if rng.random() < AT_TURNS:
            a, b = _beside_a_turn(out, count, rng)
        i = _place(out, count, min(a, b), first)
        j = _place(out, count, max(a, b), last)
        # what saves next to nothing is not worth the looking
        if i == j or abs(b - a) - _length(first, last) < LEAST_GAIN * total:
            continue
        if not edge_is_sure(first, last, epsilon, clearance, body, mode):
            blocked += 1
            continue
        blocked = 0
        # first and last take the place of the waypoints i + 1 … j
        moved = i + 3 - (j + 1)
        if moved > 0:
            for k in range(count - 1, j, -1):
                out[k + moved] = out[k]
        else:
            for k in range(j + 1, count):
                out[k + moved] = out[k]
        out[i + 1], out[i + 2] = first, last
        count += moved
    count = _without_needless(out, count, epsilon, clearance, body, mode)
    return out[:count].copy()


@njit()
def _length(a: Array, b: Array) -> float:
    square = 0.0
    for k in range(a.size):
        square += (a[k] - b[k]) ** 2
    return np.sqrt(square)


@njit()
def _beside_a_turn(path: Array, count: int, rng: np.random.Generator) -> tuple[float, float]:
    """Lengths along a path of two places equally far from a waypoint between its ends."""
    turn = 1 + int(rng.random() * (count - 2))
    along = 0.0
    for k in range(turn):
        along += _length(path[k], path[k + 1])
    away = min(_length(path[turn - 1], path[turn]), _length(path[turn], path[turn + 1])) * rng.random()
    return along - away, along + away


@njit()
def _place(path: Array, count: int, along: float, out: Array) -> int:
    """Write the point at a length along a path; returns its segment."""
    for i in range(count - 1):
        size = _length(path[i], path[i + 1])
        if along <= size or i == count - 2:
            share = min(along / size, 1.0) if size > 0.0 else 0.0
            for k in range(out.size):
                out[k] = path[i, k] + share * (path[i + 1, k] - path[i, k])
            return i
        along -= size
    return count - 2


@njit()
def _without_needless(
    path: Array, count: int, epsilon: float, clearance: LegTables, body: BodyTables, mode: int
) -> int:
    """Take out waypoints whose neighbours see each other, in place; returns how many stay."""
    i = 1
    while i < count - 1:
        if edge_is_sure(path[i - 1], path[i + 1], epsilon, clearance, body, mode):
            for k in range(i, count - 1):
                path[k] = path[k + 1]
            count -= 1
        else:
            i += 1
    return count
