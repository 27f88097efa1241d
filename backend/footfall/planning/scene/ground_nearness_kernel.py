"""Which links can be the nearest to which ground: compiled lower bounds, as nearness_kernel.py has of pairs of links.

Ground is looked at as boxes around a few of its blocks, and as its triangles where those may be the nearest.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.proof.separation import SCRATCH, least_apart
from footfall.robot.proof.shells import CENTER, EXTENT, FIRST, HALF, LAST, REACH

LEAF = 4
"""Cells along the side of the boxes that stand for ground."""
DEPTH = 1.0
"""How far those boxes go down below the lowest ground of their tile [m]; any would do."""


class RaisedGround(NamedTuple):
    """The heights of a grid (rows, cols), all of them known and raised by ``lift``, and where it lies [m].

    corner: (2,) x and y of the first cell; resolution: side of the cells.
    """

    heights: NDArray[np.float32]
    corner: Array
    resolution: float
    lift: float


class Memory(NamedTuple):
    """What a search for distances writes into, and a pose that moves nothing."""

    identity: Array
    scratch: Array
    corners: Array


@njit()
def ground_bounds(
    shells: Array,
    points: Array,
    poses: Array,
    deltas: Array,
    ground: RaisedGround,
    boxes: Array,
    windows: NDArray[np.int64],
    below: float,
    nearest: bool,
) -> tuple[float, int, int, Array]:
    """A distance to the ground beyond δ that exists, of which posture and link, and bounds of what may be nearer.

    shells, points: of points alone (shells.point_shells), a row for each link, the last two for ground; poses: (n,
    links, 4, 4) in site; deltas: (links,). boxes: (tiles, 6) lowest and highest corner of each tile, unraised; windows:
    (tiles, 4) its first and last row and column. ``below``: more is not looked for [m].
    Returns the least of ``below`` and the heights of a link's points over the ground under them, beyond δ, with its
    posture and link (−1 where it is ``below``); and lower bounds (n, links, tiles). Those that are less than that are
    as good as the links' hulls allow; with ``nearest`` only those that are less than every bound before.
    """
    n, links, tiles = poses.shape[0], poses.shape[1], windows.shape[0]
    if shells.shape[0] < links + 2 or deltas.size != links or boxes.shape[0] != tiles:
        raise ValueError("the tables of the links don't fit each other")
    shells, points = shells.copy(), points.copy()
    low, high = np.empty((n, links, 3)), np.empty((n, links, 3))
    least, posture, lowest = below, -1, -1
    for i in range(n):
        for link in range(links):
            over = over_points(
                shells,
                points,
                link,
                poses[i, link],
                low[i, link],
                high[i, link],
                ground,
                np.inf,
            )
            if over > 0.0 and over - deltas[link] < least:
                least, posture, lowest = over - deltas[link], i, link
    out, near = np.empty((n, links, tiles)), least
    memory = empty_memory()
    ground_low, ground_high = np.empty(3), np.empty(3)
    for i in range(n):
        for link in range(links):
            for tile in range(tiles):
                for k in range(3):
                    ground_low[k], ground_high[k] = boxes[tile, k], boxes[tile, 3 + k]
                ground_low[2] += ground.lift
                ground_high[2] += ground.lift
                bound = boxes_apart(low[i, link], high[i, link], ground_low, ground_high)
                enough = near + deltas[link]
                if bound < enough:
                    bound = tile_apart(
                        shells,
                        points,
                        link,
                        shells.shape[0] - 2,
                        poses[i],
                        low[i, link],
                        high[i, link],
                        enough,
                        ground,
                        windows[tile],
                        ground_low[2] - DEPTH,
                        memory,
                    )
                out[i, link, tile] = bound - deltas[link]
                if nearest:
                    near = min(near, out[i, link, tile])
    return least, posture, lowest, out


@njit()
def ground_depths(
    shells: Array,
    points: Array,
    poses: Array,
    ground: RaisedGround,
) -> Array:
    """How far each link's deepest point is under the ground, (n, links) [m]; see :func:`ground_bounds`.

    Negative above it; inf where a point is off the ground that is known.
    """
    n, links = poses.shape[0], poses.shape[1]
    out = np.full((n, links), -np.inf)
    for i in range(n):
        for link in range(links):
            T = poses[i, link]
            for k in range(int(shells[link, FIRST]), int(shells[link, LAST])):
                x, y, z = (
                    points[k, 0] + shells[link, CENTER],
                    points[k, 1] + shells[link, CENTER + 1],
                    points[k, 2] + shells[link, CENTER + 2],
                )
                u = (T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3] - ground.corner[0]) / ground.resolution
                v = (T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3] - ground.corner[1]) / ground.resolution
                height = ground_height(ground.heights, u, v)
                if height == -np.inf:
                    out[i, link] = np.inf
                up = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
                out[i, link] = max(out[i, link], height + ground.lift - up)
    return out


@njit()
def over_points(
    shells: Array,
    points: Array,
    link: int,
    T: Array,
    low: Array,
    high: Array,
    ground: RaisedGround,
    off: float,
) -> float:
    """Least height of a link's points over the ground [m], one off the grid counting as ``off``.

    Writes the box around the link.
    """
    low[:], high[:] = np.inf, -np.inf
    least, at, corner = np.inf, np.empty(3), ground.corner
    for k in range(int(shells[link, FIRST]), int(shells[link, LAST])):
        x, y, z = (
            points[k, 0] + shells[link, CENTER],
            points[k, 1] + shells[link, CENTER + 1],
            points[k, 2] + shells[link, CENTER + 2],
        )
        for row in range(3):
            at[row] = T[row, 0] * x + T[row, 1] * y + T[row, 2] * z + T[row, 3]
            low[row], high[row] = min(low[row], at[row]), max(high[row], at[row])
        u, v = (at[0] - corner[0]) / ground.resolution, (at[1] - corner[1]) / ground.resolution
        height = ground_height(ground.heights, u, v)
        over = at[2] - ground.lift - height if height > -np.inf else off
        if over < least:
            least = over
    return least


@njit()
def empty_memory() -> Memory:
    """Memory of the sizes that are needed."""
    pose = np.zeros((1, 3, 4))
    pose[0, 0, 0] = pose[0, 1, 1] = pose[0, 2, 2] = 1.0
    return Memory(pose, np.empty((SCRATCH, 3)), np.empty((2, 3)))


@njit()
def ground_height(heights: NDArray[np.float32], u: float, v: float) -> float:
    """Height of the triangles at column u and row v, as terrain/ground/surface.py has it; −inf off the grid."""
    if not (0.0 <= u < heights.shape[1] - 1 and 0.0 <= v < heights.shape[0] - 1):
        return -np.inf
    col, row = int(u), int(v)
    east, north = u - col, v - row
    sw, se = float(heights[row, col]), float(heights[row, col + 1])
    nw, ne = float(heights[row + 1, col]), float(heights[row + 1, col + 1])
    if east >= north:
        return sw + east * (se - sw) + north * (ne - se)
    return sw + north * (nw - sw) + east * (ne - nw)


@njit()
def boxes_apart(low_a: Array, high_a: Array, low_b: Array, high_b: Array) -> float:
    """Distance between two boxes along the axes, by their corners (3,) each [m]; 0 where they meet."""
    square = 0.0
    for k in range(3):
        gap = max(low_a[k] - high_b[k], low_b[k] - high_a[k])
        if gap > 0.0:
            square += gap * gap
    return math.sqrt(square)


@njit()
def tile_apart(
    shells: Array,
    points: Array,
    link: int,
    box: int,
    poses: Array,
    low: Array,
    high: Array,
    enough: float,
    ground: RaisedGround,
    window: NDArray[np.int64],
    bottom: float,
    memory: Memory,
) -> float:
    """A lower bound of a link's distance to the ground of a tile [m]: to boxes around a few blocks, then triangles.

    box: row of ``shells`` to write the ground into, the next is for a triangle. low, high: box around the link. As good
    as the link's hull allows where it is less than ``enough``. window: first and last row, first and last column.
    """
    least, corner, resolution = np.inf, ground.corner, ground.resolution
    ground_low, ground_high = memory.corners[0], memory.corners[1]
    ground_low[2] = bottom
    for r in range(window[0], window[1], LEAF):
        for c in range(window[2], window[3], LEAF):
            last_r, last_c = min(r + LEAF, window[1]), min(c + LEAF, window[3])
            ground_low[0], ground_high[0] = corner[0] + c * resolution, corner[0] + last_c * resolution
            ground_low[1], ground_high[1] = corner[1] + r * resolution, corner[1] + last_r * resolution
            most = -np.inf
            for i in range(r, last_r + 1):
                for j in range(c, last_c + 1):
                    most = max(most, float(ground.heights[i, j]))
            ground_high[2] = most + ground.lift
            bound = boxes_apart(low, high, ground_low, ground_high)
            if bound < least and bound < enough:
                _as_box(shells, box, ground_low, ground_high)
                nearer = min(least, enough)
                found = least_apart(shells, points, link, poses, link, box, memory.identity, 0, nearer, memory.scratch)
                bound = max(bound, found)
            if bound < least and bound < enough:
                bound = _block_apart(
                    shells,
                    points,
                    link,
                    box + 1,
                    poses,
                    low,
                    high,
                    min(least, enough),
                    ground,
                    (r, last_r, c, last_c),
                    memory,
                )
            least = min(least, bound)
    return least


@njit()
def _block_apart(
    shells: Array,
    points: Array,
    link: int,
    triangle: int,
    poses: Array,
    low: Array,
    high: Array,
    enough: float,
    ground: RaisedGround,
    block: tuple[int, int, int, int],
    memory: Memory,
) -> float:
    """A lower bound of a link's distance to the triangles of some rows and columns, exact for a convex link."""
    least = np.inf
    ground_low, ground_high = np.empty(3), np.empty(3)
    for r in range(block[0], block[1]):
        for c in range(block[2], block[3]):
            for half in range(2):
                as_triangle(shells, points, triangle, r, c, half, ground, ground_low, ground_high)
                bound = boxes_apart(low, high, ground_low, ground_high)
                if bound < least and bound < enough:
                    nearer = min(least, enough)
                    found = least_apart(
                        shells, points, link, poses, link, triangle, memory.identity, 0, nearer, memory.scratch
                    )
                    bound = max(bound, found)
                least = min(least, bound)
    return least


@njit()
def as_triangle(
    shells: Array,
    points: Array,
    triangle: int,
    r: int,
    c: int,
    half: int,
    ground: RaisedGround,
    low: Array,
    high: Array,
) -> None:
    """Make a row of a table of shells one of the two triangles of a block of ground; writes the box around it."""
    first = int(shells[triangle, FIRST])
    corners = points[first : first + 3]
    # as terrain.ground.triangulate: south-west, south-east, north-east; south-west, north-east, north-west
    for k in range(3):
        row = r + (0 if k == 0 or (half == 0 and k == 1) else 1)
        col = c + (0 if k == 0 or (half == 1 and k == 2) else 1)
        corners[k, 0] = ground.corner[0] + col * ground.resolution
        corners[k, 1] = ground.corner[1] + row * ground.resolution
        corners[k, 2] = float(ground.heights[row, col]) + ground.lift
    square = 0.0
    for k in range(3):
        low[k] = min(corners[0, k], corners[1, k], corners[2, k])
        high[k] = max(corners[0, k], corners[1, k], corners[2, k])
        shells[triangle, CENTER + k] = 0.5 * (low[k] + high[k])
        shells[triangle, EXTENT + k] = high[k] - shells[triangle, CENTER + k]
        square += shells[triangle, EXTENT + k] ** 2
        for one in range(3):
            corners[one, k] -= shells[triangle, CENTER + k]
    shells[triangle, REACH] = math.sqrt(square)


@njit()
def _as_box(shells: Array, box: int, low: Array, high: Array) -> None:
    """Make a row of a table of shells the box between two corners."""
    square = 0.0
    for k in range(3):
        shells[box, CENTER + k] = 0.5 * (low[k] + high[k])
        half = 0.5 * (high[k] - low[k])
        shells[box, HALF + k] = shells[box, EXTENT + k] = half
        square += half * half
    shells[box, REACH] = math.sqrt(square)
