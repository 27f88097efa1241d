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

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.robot.proof.shells import CENTER, DISC, EXTENT, FIRST, HALF, LAST, REACH

MOST_STEPS = 24
"""Support points looked at before giving up; a typical answer needs one to five."""

SCRATCH = 11
"""Rows of the scratch memory that :func:`apart` needs: three for the turn from a to b, then these."""
FROM, SIMPLEX = 3, 4
PLENTY = 0.75
"""A bound that has this share of what is asked for beyond ``required`` ends the search: more takes longer to find than
it saves."""
"""Where the middle of b is; the simplex, and room to work in. One array, as each view of a part would take its time."""

_PROGRESS = 1e-10
"""The search ends when a step could shorten the distance by no more than this share."""


@njit()
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
    """Whether two shells are proven to be far enough apart.

    Args:
        shells: see shells.py.
        points: see shells.py.
        a: number of the one shell.
        poses_a: (n, 3, 4).
        i: at which of them it is.
        b: number of the other.
        poses_b: (m, 3, 4).
        j: at which of them it is.
        required: how far apart, above zero [m].
        scratch: memory to work in, (SCRATCH, 3).

    Returns:
        False means no proof.
    """
    return apart_by(shells, points, a, poses_a, i, b, poses_b, j, required, required, scratch) >= required


@njit()
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
    """A proven lower bound of the distance of two shells.

    Args:
        shells: see shells.py.
        points: see shells.py.
        a: number of the one shell.
        poses_a: (n, 3, 4).
        i: at which of them it is.
        b: number of the other.
        poses_b: (m, 3, 4).
        j: at which of them it is.
        required: how far apart, above zero [m].
        enough: less than the distance may be told where that is no less than PLENTY of the way from ``required`` to
            this [m].
        scratch: memory to work in, (SCRATCH, 3).

    Returns:
        [m]; below ``required`` it says that there is no proof.
    """
    square = _from_middle(shells, a, poses_a, i, b, poses_b, j, scratch)
    enough = required + PLENTY * (enough - required)
    far = shells[a, REACH] + shells[b, REACH] + enough
    if square >= far * far:
        return math.sqrt(square) - shells[a, REACH] - shells[b, REACH]
    _turn(poses_a, i, poses_b, j, scratch)
    faces = _faces_apart(shells, a, b, enough, scratch)
    if faces >= enough:
        return faces
    return max(faces, _search(shells, points, a, b, enough, required, scratch))


@njit()
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
    """A proven lower bound of the distance of two shells, mostly their distance.

    Args:
        shells: see shells.py.
        points: see shells.py.
        a: number of the one shell.
        poses_a: (n, 3, 4).
        i: at which of them it is.
        b: number of the other.
        poses_b: (m, 3, 4).
        j: at which of them it is.
        enough: less may be told where it is more than this [m].
        scratch: memory to work in, (SCRATCH, 3).

    Returns:
        [m]; what is not above zero says nothing.
    """
    square = _from_middle(shells, a, poses_a, i, b, poses_b, j, scratch)
    balls = math.sqrt(square) - shells[a, REACH] - shells[b, REACH]
    if balls >= enough:
        return balls
    _turn(poses_a, i, poses_b, j, scratch)
    faces = _faces_apart(shells, a, b, enough, scratch)
    if faces >= enough:
        return faces
    return max(balls, faces, _search(shells, points, a, b, enough, 0.0, scratch))


@njit()
def _from_middle(
    shells: Array, a: int, poses_a: Array, i: int, b: int, poses_b: Array, j: int, scratch: Array
) -> float:
    """Write where the middle of b is from that of a, in the axes of a, into row FROM; its square."""
    x = _off(shells, b, poses_b, j, poses_a, i, 0)
    y = _off(shells, b, poses_b, j, poses_a, i, 1)
    z = _off(shells, b, poses_b, j, poses_a, i, 2)
    square = 0.0
    for k in range(3):
        along = poses_a[i, 0, k] * x + poses_a[i, 1, k] * y + poses_a[i, 2, k] * z - shells[a, CENTER + k]
        scratch[FROM, k] = along
        square += along * along
    return square


@njit(inline="always")
def _off(shells: Array, b: int, poses_b: Array, j: int, poses_a: Array, i: int, row: int) -> float:
    """One coordinate of the way from the origin of a's pose to the middle of b."""
    return (
        poses_b[j, row, 0] * shells[b, CENTER]
        + poses_b[j, row, 1] * shells[b, CENTER + 1]
        + poses_b[j, row, 2] * shells[b, CENTER + 2]
        + poses_b[j, row, 3]
        - poses_a[i, row, 3]
    )


@njit()
def _turn(poses_a: Array, i: int, poses_b: Array, j: int, scratch: Array) -> None:
    """Write the turn from the axes of a to those of b into the first three rows."""
    for k in range(3):
        for m in range(3):
            scratch[k, m] = (
                poses_a[i, 0, k] * poses_b[j, 0, m]
                + poses_a[i, 1, k] * poses_b[j, 1, m]
                + poses_a[i, 2, k] * poses_b[j, 2, m]
            )


@njit()
def _faces_apart(shells: Array, a: int, b: int, required: float, scratch: Array) -> float:
    """How far a face of the boxes around the shells separates them, no more is looked for than ``required``.

    The axis that does so best is put where the simplex begins.
    """
    best = -np.inf
    for k in range(3):
        gap = abs(scratch[FROM, k]) - shells[a, EXTENT + k]
        for m in range(3):
            gap -= shells[b, EXTENT + m] * abs(scratch[k, m])
        if gap >= required:
            return gap
        if gap > best:
            best = gap
            scratch[SIMPLEX, 0] = scratch[SIMPLEX, 1] = scratch[SIMPLEX, 2] = 0.0
            scratch[SIMPLEX, k] = math.copysign(1.0, scratch[FROM, k])
    for m in range(3):
        along = scratch[FROM, 0] * scratch[0, m] + scratch[FROM, 1] * scratch[1, m] + scratch[FROM, 2] * scratch[2, m]
        gap = abs(along) - shells[b, EXTENT + m]
        for k in range(3):
            gap -= shells[a, EXTENT + k] * abs(scratch[k, m])
        if gap >= required:
            return gap
        if gap > best:
            best = gap
            for k in range(3):
                scratch[SIMPLEX, k] = math.copysign(scratch[k, m], along * scratch[k, m])
    return best


@njit()
def _search(shells: Array, points: Array, a: int, b: int, enough: float, too_near: float, scratch: Array) -> float:
    """The best bound found by a search for separating directions from a to b, from the one that is the simplex.

    It ends when the bound is ``enough``, or when a point of A − B is nearer to the origin than ``too_near``.
    """
    best, R = -np.inf, scratch
    vx, vy, vz = scratch[SIMPLEX, 0], scratch[SIMPLEX, 1], scratch[SIMPLEX, 2]
    size, count = 1.0, 0
    for _ in range(MOST_STEPS):
        px, py, pz = support(shells, points, a, vx, vy, vz)
        ux = R[0, 0] * vx + R[1, 0] * vy + R[2, 0] * vz
        uy = R[0, 1] * vx + R[1, 1] * vy + R[2, 1] * vz
        uz = R[0, 2] * vx + R[1, 2] * vy + R[2, 2] * vz
        qx, qy, qz = support(shells, points, b, -ux, -uy, -uz)
        wx = R[0, 0] * qx + R[0, 1] * qy + R[0, 2] * qz + scratch[FROM, 0] - px
        wy = R[1, 0] * qx + R[1, 1] * qy + R[1, 2] * qz + scratch[FROM, 1] - py
        wz = R[2, 0] * qx + R[2, 1] * qy + R[2, 2] * qz + scratch[FROM, 2] - pz
        along = vx * wx + vy * wy + vz * wz
        best = max(best, along / size)
        if best >= enough or (count > 0 and size * size - along <= _PROGRESS * size * size):
            return best
        scratch[SIMPLEX + count, 0], scratch[SIMPLEX + count, 1], scratch[SIMPLEX + count, 2] = wx, wy, wz
        if count == 0:
            count, vx, vy, vz = 1, wx, wy, wz
        elif count == 1:
            count, vx, vy, vz = _nearest_on_segment(scratch, SIMPLEX)
        elif count == 2:
            count, vx, vy, vz = _nearest_on_triangle(scratch, SIMPLEX)
        else:
            count, vx, vy, vz = _nearest_on_tetrahedron(scratch, SIMPLEX)
        size = math.sqrt(vx * vx + vy * vy + vz * vz)
        if not size >= too_near or size <= 0.0:
            return best
    return best


@njit()
def support(shells: Array, points: Array, i: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The point of a shell that is farthest along a direction.

    Args:
        shells: see shells.py.
        points: see shells.py.
        i: number of the shell.
        x: of the direction, in the shell's axes.
        y: of the direction.
        z: of the direction.

    Returns:
        x, y, z in the shell's axes, from its middle [m].
    """
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


@njit()
def _nearest_on_segment(s: Array, o: int) -> tuple[int, float, float, float]:
    """Point of the segment s[0], s[1] nearest to the origin; keeps the corners that span it in front."""
    dx, dy, dz = s[o + 1, 0] - s[o, 0], s[o + 1, 1] - s[o, 1], s[o + 1, 2] - s[o, 2]
    length = dx * dx + dy * dy + dz * dz
    share = -(s[o, 0] * dx + s[o, 1] * dy + s[o, 2] * dz)
    if share <= 0.0:
        return 1, s[o, 0], s[o, 1], s[o, 2]
    if share >= length:
        _move(s, o + 1, o)
        return 1, s[o, 0], s[o, 1], s[o, 2]
    share /= length
    return 2, s[o, 0] + share * dx, s[o, 1] + share * dy, s[o, 2] + share * dz


@njit()
def _nearest_on_triangle(s: Array, o: int) -> tuple[int, float, float, float]:
    """Point of the triangle s[0], s[1], s[2] nearest to the origin; keeps the corners that span it in front."""
    abx, aby, abz = s[o + 1, 0] - s[o, 0], s[o + 1, 1] - s[o, 1], s[o + 1, 2] - s[o, 2]
    acx, acy, acz = s[o + 2, 0] - s[o, 0], s[o + 2, 1] - s[o, 1], s[o + 2, 2] - s[o, 2]
    d1 = -(abx * s[o, 0] + aby * s[o, 1] + abz * s[o, 2])
    d2 = -(acx * s[o, 0] + acy * s[o, 1] + acz * s[o, 2])
    if d1 <= 0.0 and d2 <= 0.0:
        return 1, s[o, 0], s[o, 1], s[o, 2]
    d3 = -(abx * s[o + 1, 0] + aby * s[o + 1, 1] + abz * s[o + 1, 2])
    d4 = -(acx * s[o + 1, 0] + acy * s[o + 1, 1] + acz * s[o + 1, 2])
    if d3 >= 0.0 and d4 <= d3:
        _move(s, o + 1, o)
        return 1, s[o, 0], s[o, 1], s[o, 2]
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _nearest_on_segment(s, o)
    d5 = -(abx * s[o + 2, 0] + aby * s[o + 2, 1] + abz * s[o + 2, 2])
    d6 = -(acx * s[o + 2, 0] + acy * s[o + 2, 1] + acz * s[o + 2, 2])
    if d6 >= 0.0 and d5 <= d6:
        _move(s, o + 2, o)
        return 1, s[o, 0], s[o, 1], s[o, 2]
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        _move(s, o + 2, o + 1)
        return _nearest_on_segment(s, o)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        _move(s, o + 2, o)
        return _nearest_on_segment(s, o)
    whole = va + vb + vc
    if not whole > 0.0:  # corners in a line
        return _nearest_on_segment(s, o)
    v, w = vb / whole, vc / whole
    return 3, s[o, 0] + v * abx + w * acx, s[o, 1] + v * aby + w * acy, s[o, 2] + v * abz + w * acz


@njit()
def _nearest_on_tetrahedron(s: Array, o: int) -> tuple[int, float, float, float]:
    """Point of the tetrahedron s[0] … s[3] nearest to the origin; s[4] … s[6] are memory to work in.

    The newest corner is s[3] and the origin lies beyond it from the face of the others, so that face is left out.
    """
    nearest, face = np.inf, -1
    for skipped in range(3):
        i, j = (skipped + 1) % 3, (skipped + 2) % 3
        ux, uy, uz = s[o + i, 0] - s[o + 3, 0], s[o + i, 1] - s[o + 3, 1], s[o + i, 2] - s[o + 3, 2]
        tx, ty, tz = s[o + j, 0] - s[o + 3, 0], s[o + j, 1] - s[o + 3, 1], s[o + j, 2] - s[o + 3, 2]
        nx, ny, nz = uy * tz - uz * ty, uz * tx - ux * tz, ux * ty - uy * tx
        inner = (
            nx * (s[o + skipped, 0] - s[o + 3, 0])
            + ny * (s[o + skipped, 1] - s[o + 3, 1])
            + nz * (s[o + skipped, 2] - s[o + 3, 2])
        )
        if inner * -(nx * s[o + 3, 0] + ny * s[o + 3, 1] + nz * s[o + 3, 2]) > 0.0:
            continue
        _move(s, o + 3, o + 4)
        _move(s, o + i, o + 5)
        _move(s, o + j, o + 6)
        _, x, y, z = _nearest_on_triangle(s, o + 4)
        if x * x + y * y + z * z < nearest:
            nearest, face = x * x + y * y + z * z, skipped
    if face < 0:
        return 4, 0.0, 0.0, 0.0
    _move(s, o + 3, o + face)
    return _nearest_on_triangle(s, o)


@njit(inline="always")
def _move(s: Array, source: int, target: int) -> None:
    s[target, 0], s[target, 1], s[target, 2] = s[source, 0], s[source, 1], s[source, 2]
