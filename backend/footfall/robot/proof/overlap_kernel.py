"""Compiled part of leg_overlap.py: convex bodies that share room, and ground too close to links."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.leg_frames import PART_COUNT, leg_frames
from footfall.robot.proof.obstacles import NOTHING, SELF, TERRAIN

_TOUCH = 1e-9
"""Overlaps smaller than this [m] are left to the meshes."""
_WHEEL = PART_COUNT - 1


class Solids(NamedTuple):
    """Convex bodies, n of them.

    vertices (n, v, 3), face normals (n, f, 3), edge directions (n, e, 3), each without parallels; centres (n, 3), radii
    (n,) about them, halves (n, 3) of boxes along their axes, NaN for others.
    """

    vertices: Array
    normals: Array
    edges: Array
    centers: Array
    radii: Array
    halves: Array


class Ground(NamedTuple):
    """Heights on a grid (core.grid), every how many cells a vertex is tried, and T_site_hip."""

    heights: NDArray[np.float32]
    x0: float
    y0: float
    resolution: float
    stride: int
    T_site_hip: Array


class WheelAndGround(NamedTuple):
    """How near the leg may come to the ground.

    lift: of the ground, −inf for no ground. radius, half_width: of the wheel that must be free of it; deltas: (7,)
    distances that the links must keep from it. All in [m].
    """

    lift: float
    radius: float
    half_width: float
    deltas: Array


class OverlapPairs(NamedTuple):
    """Which bodies are looked at in pairs.

    codes: (frozen,) what each frozen one is; checked: (7, frozen) by which links it counts; own: (k, 2) links of the
    leg.
    """

    codes: NDArray[np.uint8]
    checked: NDArray[np.bool_]
    own: NDArray[np.int64]


@njit()
def _separated(axis: Array, a: Array, b: Array) -> bool:
    """Whether vertices a and b lie apart along an axis, which need not be of unit length."""
    length = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
    if length < 1e-6:
        return False
    low_a = low_b = np.inf
    high_a = high_b = -np.inf
    for k in range(len(a)):
        along = axis[0] * a[k, 0] + axis[1] * a[k, 1] + axis[2] * a[k, 2]
        low_a, high_a = min(low_a, along), max(high_a, along)
    for k in range(len(b)):
        along = axis[0] * b[k, 0] + axis[1] * b[k, 1] + axis[2] * b[k, 2]
        low_b, high_b = min(low_b, along), max(high_b, along)
    return min(high_a, high_b) - max(low_a, low_b) < _TOUCH * length


@njit()
def _overlap(a: Array, normals_a: Array, edges_a: Array, b: Array, normals_b: Array, edges_b: Array) -> bool:
    """Whether two convex bodies share room: no axis of either kind separates them."""
    for k in range(len(normals_a)):
        if _separated(normals_a[k], a, b):
            return False
    for k in range(len(normals_b)):
        if _separated(normals_b[k], a, b):
            return False
    axis = np.empty(3)
    for i in range(len(edges_a)):
        for j in range(len(edges_b)):
            u, v = edges_a[i], edges_b[j]
            axis[0], axis[1], axis[2] = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
            if _separated(axis, a, b):
                return False
    return True


@njit()
def _turned(R: Array, rows: Array, shift: Array, out: Array) -> None:
    for i in range(len(rows)):
        for k in range(3):
            out[i, k] = R[k, 0] * rows[i, 0] + R[k, 1] * rows[i, 1] + R[k, 2] * rows[i, 2] + shift[k]


@njit()
def _far(a: Array, b: Array, reach: float) -> bool:
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return x * x + y * y + z * z > reach * reach


@njit()
def _height(ground: Ground, x: float, y: float) -> float:
    """Height of the surface (terrain.triangulate), NaN where there is none."""
    u, v = (x - ground.x0) / ground.resolution, (y - ground.y0) / ground.resolution
    rows, cols = ground.heights.shape
    if not (u >= 0 and v >= 0 and u < cols - 1 and v < rows - 1):
        return np.nan
    col, row = int(u), int(v)
    east, north = u - col, v - row
    sw, se = float(ground.heights[row, col]), float(ground.heights[row, col + 1])
    nw, ne = float(ground.heights[row + 1, col]), float(ground.heights[row + 1, col + 1])
    if math.isnan(sw + se + nw + ne):
        return np.nan
    if east >= north:
        return sw + east * (se - sw) + north * (ne - se)
    return sw + north * (nw - sw) + east * (ne - nw)


@njit()
def _ground_near(
    ground: Ground, lift: float, R: Array, center: Array, half: Array, round_wheel: bool, delta: float, size: Array
) -> bool:
    """Whether a vertex of the lifted ground lies closer than delta to a box, or a cylinder about y, at a pose in site.

    half: (3,) of the box; of a cylinder radius, half width, radius. size: (3,) half extents in site, delta included.
    """
    rows, cols = ground.heights.shape
    s = ground.stride
    first_row = max(0, math.ceil((center[1] - size[1] - ground.y0) / (ground.resolution * s))) * s
    first_col = max(0, math.ceil((center[0] - size[0] - ground.x0) / (ground.resolution * s))) * s
    last_row = min(rows - 1.0, math.floor((center[1] + size[1] - ground.y0) / ground.resolution))
    last_col = min(cols - 1.0, math.floor((center[0] + size[0] - ground.x0) / ground.resolution))
    row = first_row
    while row <= last_row:
        y = ground.y0 + row * ground.resolution - center[1]
        col = first_col
        while col <= last_col:
            z = ground.heights[row, col] + lift - center[2]
            if abs(z) < size[2]:
                x = ground.x0 + col * ground.resolution - center[0]
                u = R[0, 0] * x + R[1, 0] * y + R[2, 0] * z
                v = R[0, 1] * x + R[1, 1] * y + R[2, 1] * z
                w = R[0, 2] * x + R[1, 2] * y + R[2, 2] * z
                v = max(abs(v) - half[1], 0.0)
                if round_wheel:
                    u, w = max(math.sqrt(u * u + w * w) - half[0], 0.0), 0.0
                else:
                    u, w = max(abs(u) - half[0], 0.0), max(abs(w) - half[2], 0.0)
                if u * u + v * v + w * w < delta * delta:
                    return True
            col += s
        row += s
    return False


@njit()
def _hits_ground(ground: Ground, limits: WheelAndGround, moving: Solids, R_hip: Array, at_hip: Array) -> int:
    """The link that hits the lifted ground, from the wheel inwards; −1 for none."""
    T, lift, deltas = ground.T_site_hip, limits.lift, limits.deltas
    R, center, half, size = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    for step in range(PART_COUNT):
        part = _WHEEL - step
        for k in range(3):
            for j in range(3):
                R[k, j] = T[k, 0] * R_hip[part, 0, j] + T[k, 1] * R_hip[part, 1, j] + T[k, 2] * R_hip[part, 2, j]
            center[k] = T[k, 0] * at_hip[part, 0] + T[k, 1] * at_hip[part, 1] + T[k, 2] * at_hip[part, 2] + T[k, 3]
        if center[2] < _height(ground, center[0], center[1]) + lift - 1e-6:
            return part
        if part == _WHEEL:
            half[0], half[1], half[2] = limits.radius, limits.half_width, limits.radius
        else:
            half[:] = moving.halves[part]
            if math.isnan(half[0]):
                continue
        for k in range(3):
            size[k] = abs(R[k, 0]) * half[0] + abs(R[k, 1]) * half[1] + abs(R[k, 2]) * half[2] + deltas[part]
        if _ground_near(ground, lift, R, center, half, part == _WHEEL, deltas[part], size):
            return part
    return -1


@njit(parallel=True)
def overlaps(
    lengths: Array,
    qs: Array,
    moving: Solids,
    frozen: Solids,
    pairs: OverlapPairs,
    ground: Ground,
    limits: WheelAndGround,
    link: NDArray[np.uint8],
    hit: NDArray[np.uint8],
) -> None:
    """Write which link surely hits what, (n,) each, for leg postures (n, 6); NOTHING where no collision is sure.

    Of two links of the leg it is the outer one that hits.
    """
    codes, checked, own = pairs.codes, pairs.checked, pairs.own
    for index in prange(len(qs)):
        i = np.int64(index)
        R, at = np.empty((PART_COUNT, 3, 3)), np.empty((PART_COUNT, 3))
        leg_frames(lengths, qs[i], R, at)
        vertices = np.empty_like(moving.vertices)
        normals, edges = np.empty_like(moving.normals), np.empty_like(moving.edges)
        centers = np.empty((PART_COUNT, 3))
        zero = np.zeros(3)
        for part in range(PART_COUNT):
            _turned(R[part], moving.vertices[part], at[part], vertices[part])
            _turned(R[part], moving.normals[part], zero, normals[part])
            _turned(R[part], moving.edges[part], zero, edges[part])
            for k in range(3):
                c = moving.centers[part]
                centers[part, k] = R[part, k, 0] * c[0] + R[part, k, 1] * c[1] + R[part, k, 2] * c[2] + at[part, k]
        for other in range(len(codes)):
            for part in range(PART_COUNT):
                if hit[i] != NOTHING or not checked[part, other]:
                    continue
                if _far(centers[part], frozen.centers[other], float(moving.radii[part] + frozen.radii[other])):
                    continue
                if _overlap(
                    vertices[part],
                    normals[part],
                    edges[part],
                    frozen.vertices[other],
                    frozen.normals[other],
                    frozen.edges[other],
                ):
                    link[i], hit[i] = part, codes[other]
        for pair in range(len(own)):
            a, b = own[pair]
            if hit[i] != NOTHING or _far(centers[a], centers[b], float(moving.radii[a] + moving.radii[b])):
                continue
            if _overlap(vertices[a], normals[a], edges[a], vertices[b], normals[b], edges[b]):
                link[i], hit[i] = max(a, b), SELF
        if hit[i] == NOTHING and limits.lift > -np.inf:
            part = _hits_ground(ground, limits, moving, R, centers)
            if part >= 0:
                link[i], hit[i] = part, TERRAIN
