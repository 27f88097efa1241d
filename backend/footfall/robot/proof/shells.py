"""Convex shells around links: solids whose farthest point in a direction is quickly found.

A *shell* is the Minkowski sum of the hull of some points, a box, and a disc about y, in the link's axes. A box is one
point and a box; a wheel one point, a box that has a width only, and a disc; a chassis its corners. A mesh is a
surface made of triangles, so it lies inside its shell as soon as its corners do: the shell is convex.
Boxes and drums stand for a mesh only where they are hardly larger; any other mesh gets its convex hull.
"""

import math

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.mesh import Mesh

CENTER, HALF, EXTENT, DISC, REACH, FIRST, LAST = 0, 3, 6, 9, 10, 11, 12
"""Columns of a table of shells, one row for each; three columns for each of the first three.

CENTER: in the link's frame; all else is seen from there. HALF: half lengths of the box. EXTENT: half lengths of a box
around the shell. DISC: radius of the disc. REACH: radius of a ball around the shell. FIRST, LAST: the shell's
points are rows FIRST to LAST − 1 of the table of points. All in metres but the last two.
"""

COLUMNS = 13

_BOX_FIT, _DRUM_FIT = 1.001, 1.03
"""How much larger than the mesh a box or a drum may be and still stand for it (ratio of volumes)."""


def shells(meshes: list[Mesh]) -> tuple[Array, Array]:
    """One shell for each mesh: table of shells (n, COLUMNS) and table of points (p, 3).

    Raises InvalidRobot where a mesh is not closed.
    """
    return _tables([_fit(mesh) for mesh in meshes])


def point_shells(meshes: list[Mesh]) -> tuple[Array, Array]:
    """Shells of the meshes' corners alone, as :func:`shells`: their hulls, no larger than a convex mesh is."""
    fits = []
    for mesh in meshes:
        center = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
        fits.append((center, mesh.vertices[np.unique(mesh.triangles)] - center, np.zeros(3), 0.0))
    return _tables(fits)


def _tables(fits: list[tuple[Array, Array, Array, float]]) -> tuple[Array, Array]:
    table, points = np.zeros((len(fits), COLUMNS)), []
    first = 0
    for row, (center, corners, half, disc) in zip(table, fits, strict=True):
        row[CENTER : CENTER + 3] = center
        row[HALF : HALF + 3] = half
        row[EXTENT : EXTENT + 3] = np.abs(corners).max(axis=0) + half + (disc, 0.0, disc)
        row[DISC] = disc
        row[REACH] = np.linalg.norm(corners, axis=1).max() + math.hypot(math.hypot(half[0], half[2]) + disc, half[1])
        row[FIRST], row[LAST] = first, first + len(corners)
        first += len(corners)
        points.append(corners)
    return table, np.concatenate(points)


def _fit(mesh: Mesh) -> tuple[Array, Array, Array, float]:
    """Centre, points, half lengths and disc of the shell around a mesh."""
    triangles = mesh.vertices[mesh.triangles]
    volume = float(np.linalg.det(triangles).sum()) / 6
    if not volume > 0:
        raise InvalidRobot("a link's mesh must be closed, its triangles counter-clockwise seen from outside")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    center, half = (low + high) / 2, (high - low) / 2
    around = mesh.vertices - center
    radius = float(np.hypot(around[:, 0], around[:, 2]).max())
    if 8 * half.prod() <= _BOX_FIT * volume:
        return center, np.zeros((1, 3)), half, 0.0
    if 2 * math.pi * radius**2 * half[1] <= _DRUM_FIT * volume:
        return center, np.zeros((1, 3)), np.array([0.0, half[1], 0.0]), radius
    return center, around[np.unique(mesh.triangles)], np.zeros(3), 0.0
