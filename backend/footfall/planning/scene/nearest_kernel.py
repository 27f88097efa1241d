"""Compiled lower bounds of what parts of a moving rover leave to spare, so that few distances of meshes are asked for.

Two bounds of each thing in each posture: a coarse one, by balls or by the highest ground around, and a finer one, which
is proven as well (proof/separation.py). The finer one is as good as convex hulls allow where it is less than any finer
one found before it, and else no worse than the coarse one: of what may be the least only that counts.
"""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints
from footfall.planning.scene.ground_nearness_kernel import (
    DEPTH,
    RaisedGround,
    as_triangle,
    boxes_apart,
    empty_memory,
    over_points,
    tile_apart,
)
from footfall.robot.proof.separation import SCRATCH, least_apart
from footfall.robot.proof.shells import CENTER, REACH

ROUNDING = 0.001
"""Ground may be so much higher than its greatest height says, as heights are stored as float32 [m]."""


@njit()
def own_bounds(
    shells: Array, points: Array, poses: Array, pairs: Ints, deltas: Array, far: float
) -> tuple[Array, Array]:
    """Coarse and finer bounds of how far pairs are apart beyond δ, (n, pairs) each [m].

    shells, points: hulls of the links (shells.point_shells); poses: (n, links, 4, 4); pairs: (k, 2) two links each;
    deltas: (k,). What is farther than ``far`` is not looked at any closer.
    """
    n, links, count = poses.shape[0], poses.shape[1], pairs.shape[0]
    if shells.shape[0] < links or deltas.size != count or pairs.shape[1] != 2:
        raise ValueError("the tables of the pairs don't fit each other")
    coarse, finer = np.empty((n, count)), np.empty((n, count))
    middles, scratch, near = np.empty((links, 3)), np.empty((SCRATCH, 3)), far
    for i in range(n):
        for link in range(links):
            for row in range(3):
                middles[link, row] = poses[i, link, row, 3]
                for k in range(3):
                    middles[link, row] += poses[i, link, row, k] * shells[link, CENTER + k]
        for pair in range(count):
            a, b, delta = pairs[pair, 0], pairs[pair, 1], deltas[pair]
            square = 0.0
            for k in range(3):
                square += (middles[a, k] - middles[b, k]) ** 2
            bound = math.sqrt(square) - shells[a, REACH] - shells[b, REACH] - delta
            coarse[i, pair] = bound
            if bound < near:
                found = least_apart(shells, points, a, poses[i], a, b, poses[i], b, near + delta, scratch)
                bound = max(bound, found - delta)
                near = min(near, bound)
            finer[i, pair] = bound
    return coarse, finer


@njit()
def ground_bounds(
    shells: Array,
    points: Array,
    poses: Array,
    deltas: Array,
    ground: RaisedGround,
    beside: float,
    far: float,
) -> tuple[Array, Array, Array]:
    """Coarse and finer bounds of how far links are from the ground beyond δ, (n, links) [m], and (links, 4) boxes.

    shells, points: hulls of the links, and two more rows to write ground into (leg_over_ground.py); poses: (n, links,
    4, 4) in site; deltas: (links,). The boxes around a link's whole way, west, south, east and north, are larger by
    ``beside``.

    Coarse: a link is as far from the ground as its lowest point is above the highest ground in its box; ground farther
    off is at least ``beside`` away. Finer: −inf where a part of it may be below the ground: where one of its points is
    not above it or off the grid, or where its hull is not proven to be apart from it. What is farther than ``far`` is
    not looked at any closer.
    """
    n, links = poses.shape[0], poses.shape[1]
    if shells.shape[0] != links + 2 or deltas.size != links:
        raise ValueError("the tables of the links don't fit each other")
    shells, points = shells.copy(), points.copy()
    coarse, finer = np.empty((n, links)), np.empty((n, links))
    boxes, low, high = np.empty((links, 4)), np.empty((n, links, 3)), np.empty((n, links, 3))
    bottoms = np.empty(links)
    near = far
    for link in range(links):
        boxes[link, :2], boxes[link, 2:] = np.inf, -np.inf
        for i in range(n):
            over = over_points(
                shells,
                points,
                link,
                poses[i, link],
                low[i, link],
                high[i, link],
                ground,
                -np.inf,
            )
            finer[i, link] = over
            if over > 0.0:
                near = min(near, over - deltas[link])
            for k in range(2):
                boxes[link, k] = min(boxes[link, k], low[i, link, k])
                boxes[link, 2 + k] = max(boxes[link, 2 + k], high[i, link, k])
        boxes[link, :2] -= beside
        boxes[link, 2:] += beside
        lowest, highest = _extremes(boxes[link, :2], boxes[link, 2:], ground)
        bottoms[link], highest = lowest + ground.lift - DEPTH, highest + ground.lift
        for i in range(n):
            coarse[i, link] = min(low[i, link, 2] - highest - ROUNDING, beside) - deltas[link]
    memory, window = empty_memory(), np.empty(4, np.int64)
    for i in range(n):
        for link in range(links):
            if not finer[i, link] > 0.0:
                finer[i, link] = -np.inf
                continue
            bound = coarse[i, link]
            if bound < near:
                enough = near + deltas[link]
                _window(low[i, link] - enough, high[i, link] + enough, ground, window)
                window[1] -= 1
                window[3] -= 1
                # ground outside of the window is farther than is asked for
                found = min(
                    enough,
                    tile_apart(
                        shells,
                        points,
                        link,
                        links,
                        poses[i],
                        low[i, link],
                        high[i, link],
                        enough,
                        ground,
                        window,
                        bottoms[link],
                        memory,
                    ),
                )
                bound = max(bound, found - deltas[link]) if found > 0.0 else -np.inf
                near = min(near, bound)
            finer[i, link] = bound
    return coarse, finer, boxes


@njit()
def near_triangles(
    shells: Array,
    points: Array,
    T: Array,
    within: float,
    ground: RaisedGround,
) -> Ints:
    """Triangles of the ground that may be nearer to a link than ``within`` [m], the others are proven to be farther.

    Row and column of the block, and which half of it. shells, points: of :func:`ground_bounds`, the link's is the
    first; T: (1, 4, 4).
    """
    shells, points = shells.copy(), points.copy()
    low, high, ground_low, ground_high = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    over_points(shells, points, 0, T[0], low, high, ground, -np.inf)
    memory, window = empty_memory(), np.empty(4, np.int64)
    _window(low - within, high + within, ground, window)
    found = np.empty((2 * max((window[1] - window[0]) * (window[3] - window[2]), 0), 3), np.int64)
    count, triangle = 0, shells.shape[0] - 1
    for row in range(window[0], window[1] - 1):
        for col in range(window[2], window[3] - 1):
            for half in range(2):
                as_triangle(shells, points, triangle, row, col, half, ground, ground_low, ground_high)
                if boxes_apart(low, high, ground_low, ground_high) >= within:
                    continue
                away = least_apart(shells, points, 0, T, 0, triangle, memory.identity, 0, within, memory.scratch)
                if away < within:
                    found[count, 0], found[count, 1], found[count, 2] = row, col, half
                    count += 1
    return found[:count]


@njit()
def _extremes(low: Array, high: Array, ground: RaisedGround) -> tuple[float, float]:
    """Lowest and highest ground in a box and beside it by a cell [m]; infinite where there is none."""
    window, lowest, highest = np.empty(4, np.int64), np.inf, -np.inf
    _window(low, high, ground, window)
    for row in range(window[0], window[1]):
        for col in range(window[2], window[3]):
            height = float(ground.heights[row, col])
            lowest, highest = min(lowest, height), max(highest, height)
    return lowest, highest


@njit()
def _window(low: Array, high: Array, ground: RaisedGround, window: Ints) -> None:
    """Write first row and the one after the last, then the same of columns: cells in a box and their neighbours."""
    for k in range(2):
        size = ground.heights.shape[1 - k]
        first = math.floor((low[k] - ground.corner[k]) / ground.resolution)
        last = math.ceil((high[k] - ground.corner[k]) / ground.resolution) + 1
        window[2 - 2 * k] = min(max(first, 0), size)
        window[3 - 2 * k] = min(max(last, 0), size)
