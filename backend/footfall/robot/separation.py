"""A compiled proof that two convex shells are apart.

Let A and B be convex, n a unit vector, and s_A(d) a point of A that is farthest along d. For every a in A and b in B,
n · (a − b) ≥ n · (s_A(−n) − s_B(n)), hence |a − b| is at least that: *any* n gives a lower bound of the distance.
:func:`apart` answers yes only when the bound of some n reaches what is required, so a yes is a proof, whatever rounding
or chance led to that n. It looks for n along the point of A − B that is nearest to the origin, by the
algorithm of E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A fast procedure for computing the distance between complex
objects in three-dimensional space", IEEE J. Robotics and Automation 4 (1988): a simplex of up to four points of
A − B moves towards it. A point of A − B nearer to the origin than required ends the search with no; the
nearest point of a simplex is found by the regions of C. Ericson, *Real-Time Collision Detection* (2005), §5.1.5.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from footfall.robot.shells import CENTER, DISC, EXTENT, FIRST, HALF, LAST, REACH

Array = NDArray[np.float64]

MOST_STEPS = 24
"""Support points looked at before giving up; a typical answer needs one to five."""

SCRATCH = 11
"""Rows of the scratch memory that :func:`apart` needs."""

_PROGRESS = 1e-10
"""The search ends when a step could shorten the distance by no more than this share."""


@njit(cache=True)
def apart(
    shells: Array,
    points: Array,
    a: int,
    poses_a: Array,
    i: int,
    b: int,
    poses_b: Array,
    j: int,
    required: float,
    scratch: Array,
) -> bool:
    """Whether shell a at poses_a[i] and shell b at poses_b[j] are proven to be at least ``required`` > 0 [m] apart.

    shells, points: see shells.py. poses: (n, 3, 4). scratch: memory to work in, (SCRATCH, 3). False means no proof.
    """
    return apart_by(shells, points, a, poses_a, i, b, poses_b, j, required, required, scratch) >= required


@njit(cache=True)
def apart_by(
    shells: Array,
    points: Array,
    a: int,
    poses_a: Array,
    i: int,
    b: int,
    poses_b: Array,
    j: int,
    required: float,
    enough: float,
    scratch: Array,
) -> float:
    """A proven lower bound of the distance of two shells [m]; below ``required`` > 0 it says that there is no proof.

    Less than their distance may be told where it is more than ``enough`` ≥ required; see :func:`apart`.
    """
    R, t, simplex = scratch[:3], scratch[3], scratch[4:]
    square = _from_middle(shells, a, poses_a, i, b, poses_b, j, scratch)
    far = shells[a, REACH] + shells[b, REACH] + enough
    if square >= far * far:
        return enough
    _turn(poses_a, i, poses_b, j, R)
    faces = _faces_apart(shells, a, b, R, t, enough, simplex)
    if faces >= enough:
        return faces
    return max(faces, _search(shells, points, a, b, R, t, enough, required, simplex))


@njit(cache=True)
def least_apart(
    shells: Array,
    points: Array,
    a: int,
    poses_a: Array,
    i: int,
    b: int,
    poses_b: Array,
    j: int,
    enough: float,
    scratch: Array,
) -> float:
    """A proven lower bound of the distance of two shells [m], mostly their distance; see :func:`apart`.

    Less may be told where it is more than ``enough``; what is not above zero says nothing.
    """
    R, t, simplex = scratch[:3], scratch[3], scratch[4:]
    square = _from_middle(shells, a, poses_a, i, b, poses_b, j, scratch)
    balls = math.sqrt(square) - shells[a, REACH] - shells[b, REACH]
    if balls >= enough:
        return balls
    _turn(poses_a, i, poses_b, j, R)
    faces = _faces_apart(shells, a, b, R, t, enough, simplex)
    if faces >= enough:
        return faces
    return max(balls, faces, _search(shells, points, a, b, R, t, enough, 0.0, simplex))


@njit(cache=True)
def _from_middle(
    shells: Array, a: int, poses_a: Array, i: int, b: int, poses_b: Array, j: int, scratch: Array
) -> float:
    """Write where the middle of b is from that of a, in the axes of a, into scratch[3]; its square."""
    t = scratch[3]
    for row in range(3):
        scratch[4, row] = (
            poses_b[j, row, 0] * shells[b, CENTER]
            + poses_b[j, row, 1] * shells[b, CENTER + 1]
            + poses_b[j, row, 2] * shells[b, CENTER + 2]
            + poses_b[j, row, 3]
            - poses_a[i, row, 3]
        )
    square = 0.0
    for k in range(3):
        t[k] = -shells[a, CENTER + k]
        for row in range(3):
            t[k] += poses_a[i, row, k] * scratch[4, row]
        square += t[k] * t[k]
    return square


@njit(cache=True)
def _turn(poses_a: Array, i: int, poses_b: Array, j: int, R: Array) -> None:
    """Write the turn from the axes of a to those of b."""
    for k in range(3):
        for m in range(3):
            R[k, m] = (
                poses_a[i, 0, k] * poses_b[j, 0, m]
                + poses_a[i, 1, k] * poses_b[j, 1, m]
                + poses_a[i, 2, k] * poses_b[j, 2, m]
            )


@njit(cache=True)
def _faces_apart(shells: Array, a: int, b: int, R: Array, t: Array, required: float, simplex: Array) -> float:
    """How far a face of the boxes around the shells separates them, no more is looked for than ``required``.

    simplex[0] is the axis that does so best.
    """
    best = -np.inf
    for k in range(3):
        gap = abs(t[k]) - shells[a, EXTENT + k]
        for m in range(3):
            gap -= shells[b, EXTENT + m] * abs(R[k, m])
        if gap >= required:
            return gap
        if gap > best:
            best = gap
            simplex[0, 0] = simplex[0, 1] = simplex[0, 2] = 0.0
            simplex[0, k] = math.copysign(1.0, t[k])
    for m in range(3):
        along = t[0] * R[0, m] + t[1] * R[1, m] + t[2] * R[2, m]
        gap = abs(along) - shells[b, EXTENT + m]
        for k in range(3):
            gap -= shells[a, EXTENT + k] * abs(R[k, m])
        if gap >= required:
            return gap
        if gap > best:
            best = gap
            for k in range(3):
                simplex[0, k] = math.copysign(R[k, m], along * R[k, m])
    return best


@njit(cache=True)
def _search(
    shells: Array, points: Array, a: int, b: int, R: Array, t: Array, enough: float, too_near: float, simplex: Array
) -> float:
    """The best bound found by a search for separating directions from a to b, from the one in simplex[0] on.

    It ends when the bound is ``enough``, or when a point of A − B is nearer to the origin than ``too_near``.
    """
    best = -np.inf
    vx, vy, vz = simplex[0, 0], simplex[0, 1], simplex[0, 2]
    size, count = 1.0, 0
    for _ in range(MOST_STEPS):
        px, py, pz = support(shells, points, a, vx, vy, vz)
        ux = R[0, 0] * vx + R[1, 0] * vy + R[2, 0] * vz
        uy = R[0, 1] * vx + R[1, 1] * vy + R[2, 1] * vz
        uz = R[0, 2] * vx + R[1, 2] * vy + R[2, 2] * vz
        qx, qy, qz = support(shells, points, b, -ux, -uy, -uz)
        wx = R[0, 0] * qx + R[0, 1] * qy + R[0, 2] * qz + t[0] - px
        wy = R[1, 0] * qx + R[1, 1] * qy + R[1, 2] * qz + t[1] - py
        wz = R[2, 0] * qx + R[2, 1] * qy + R[2, 2] * qz + t[2] - pz
        along = vx * wx + vy * wy + vz * wz
        best = max(best, along / size)
        if best >= enough or (count > 0 and size * size - along <= _PROGRESS * size * size):
            return best
        simplex[count, 0], simplex[count, 1], simplex[count, 2] = wx, wy, wz
        if count == 0:
            count, vx, vy, vz = 1, wx, wy, wz
        elif count == 1:
            count, vx, vy, vz = _nearest_on_segment(simplex)
        elif count == 2:
            count, vx, vy, vz = _nearest_on_triangle(simplex)
        else:
            count, vx, vy, vz = _nearest_on_tetrahedron(simplex)
        size = math.sqrt(vx * vx + vy * vy + vz * vz)
        if not size >= too_near or size <= 0.0:
            return best
    return best


@njit(cache=True)
def support(shells: Array, points: Array, i: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The point of shell i that is farthest along (x, y, z), in the shell's axes and from its middle."""
    first, last = int(shells[i, FIRST]), int(shells[i, LAST])
    best = first
    if last - first > 1:
        most = -np.inf
        for k in range(first, last):
            along = points[k, 0] * x + points[k, 1] * y + points[k, 2] * z
            if along > most:
                best, most = k, along
    px = points[best, 0] + math.copysign(shells[i, HALF], x)
    py = points[best, 1] + math.copysign(shells[i, HALF + 1], y)
    pz = points[best, 2] + math.copysign(shells[i, HALF + 2], z)
    if shells[i, DISC] > 0.0:
        size = math.sqrt(x * x + z * z)
        if size > 0.0:
            px += shells[i, DISC] * x / size
            pz += shells[i, DISC] * z / size
    return px, py, pz


@njit(cache=True)
def _nearest_on_segment(s: Array) -> tuple[int, float, float, float]:
    """Point of the segment s[0], s[1] nearest to the origin; keeps the corners that span it in front."""
    dx, dy, dz = s[1, 0] - s[0, 0], s[1, 1] - s[0, 1], s[1, 2] - s[0, 2]
    length = dx * dx + dy * dy + dz * dz
    share = -(s[0, 0] * dx + s[0, 1] * dy + s[0, 2] * dz)
    if share <= 0.0:
        return 1, s[0, 0], s[0, 1], s[0, 2]
    if share >= length:
        _move(s, 1, 0)
        return 1, s[0, 0], s[0, 1], s[0, 2]
    share /= length
    return 2, s[0, 0] + share * dx, s[0, 1] + share * dy, s[0, 2] + share * dz


@njit(cache=True)
def _nearest_on_triangle(s: Array) -> tuple[int, float, float, float]:
    """Point of the triangle s[0], s[1], s[2] nearest to the origin; keeps the corners that span it in front."""
    abx, aby, abz = s[1, 0] - s[0, 0], s[1, 1] - s[0, 1], s[1, 2] - s[0, 2]
    acx, acy, acz = s[2, 0] - s[0, 0], s[2, 1] - s[0, 1], s[2, 2] - s[0, 2]
    d1 = -(abx * s[0, 0] + aby * s[0, 1] + abz * s[0, 2])
    d2 = -(acx * s[0, 0] + acy * s[0, 1] + acz * s[0, 2])
    if d1 <= 0.0 and d2 <= 0.0:
        return 1, s[0, 0], s[0, 1], s[0, 2]
    d3 = -(abx * s[1, 0] + aby * s[1, 1] + abz * s[1, 2])
    d4 = -(acx * s[1, 0] + acy * s[1, 1] + acz * s[1, 2])
    if d3 >= 0.0 and d4 <= d3:
        _move(s, 1, 0)
        return 1, s[0, 0], s[0, 1], s[0, 2]
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _nearest_on_segment(s)
    d5 = -(abx * s[2, 0] + aby * s[2, 1] + abz * s[2, 2])
    d6 = -(acx * s[2, 0] + acy * s[2, 1] + acz * s[2, 2])
    if d6 >= 0.0 and d5 <= d6:
        _move(s, 2, 0)
        return 1, s[0, 0], s[0, 1], s[0, 2]
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        _move(s, 2, 1)
        return _nearest_on_segment(s)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        _move(s, 2, 0)
        return _nearest_on_segment(s)
    whole = va + vb + vc
    if not whole > 0.0:  # corners in a line
        return _nearest_on_segment(s)
    v, w = vb / whole, vc / whole
    return 3, s[0, 0] + v * abx + w * acx, s[0, 1] + v * aby + w * acy, s[0, 2] + v * abz + w * acz


@njit(cache=True)
def _nearest_on_tetrahedron(s: Array) -> tuple[int, float, float, float]:
    """Point of the tetrahedron s[0] … s[3] nearest to the origin; s[4] … s[6] are memory to work in.

    The newest corner is s[3] and the origin lies beyond it from the face of the others, so that face is left out.
    """
    nearest, face = np.inf, -1
    for skipped in range(3):
        i, j = (skipped + 1) % 3, (skipped + 2) % 3
        ux, uy, uz = s[i, 0] - s[3, 0], s[i, 1] - s[3, 1], s[i, 2] - s[3, 2]
        tx, ty, tz = s[j, 0] - s[3, 0], s[j, 1] - s[3, 1], s[j, 2] - s[3, 2]
        nx, ny, nz = uy * tz - uz * ty, uz * tx - ux * tz, ux * ty - uy * tx
        inner = nx * (s[skipped, 0] - s[3, 0]) + ny * (s[skipped, 1] - s[3, 1]) + nz * (s[skipped, 2] - s[3, 2])
        if inner * -(nx * s[3, 0] + ny * s[3, 1] + nz * s[3, 2]) > 0.0:
            continue
        _move(s, 3, 4)
        _move(s, i, 5)
        _move(s, j, 6)
        _, x, y, z = _nearest_on_triangle(s[4:])
        if x * x + y * y + z * z < nearest:
            nearest, face = x * x + y * y + z * z, skipped
    if face < 0:
        return 4, 0.0, 0.0, 0.0
    _move(s, 3, face)
    return _nearest_on_triangle(s)


@njit(cache=True, inline="always")
def _move(s: Array, source: int, target: int) -> None:
    s[target, 0], s[target, 1], s[target, 2] = s[source, 0], s[source, 1], s[source, 2]
