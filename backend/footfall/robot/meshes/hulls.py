"""Convex hulls of meshes, for coal."""

import coal
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from footfall.core.arrays import Array, Ints
from footfall.core.mesh import Mesh
from footfall.robot.meshes.bvh import bvh

FEW = 64
"""Triangles of which no hulls are made, where those of more can't be."""
MOST_NEIGHBOURS = 200
"""Of a corner: coal takes no hull with a corner of more than 255, as a disc of so many sides has."""


def hulls_around(mesh: Mesh) -> list[coal.CollisionGeometry]:
    """Shapes that hold every triangle of a mesh.

    Args:
        mesh: with a triangle at least.

    Returns:
        Its hull, or those of its halves where coal can't have that of the whole; of what is flat the mesh itself.
    """
    if _can_be(mesh.vertices):
        return [_hull(mesh.vertices)]
    if len(mesh.triangles) <= FEW:
        return [bvh(mesh)]
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    along = middles[:, int(np.argmax(np.ptp(middles, axis=0)))]
    order, half = np.argsort(along, kind="stable"), len(along) // 2
    return [one for part in (order[:half], order[half:]) for one in hulls_around(_part(mesh, part))]


def _can_be(points: Array) -> bool:
    """Whether coal can have their hull: it ends the process at flat ones."""
    try:
        corners = ConvexHull(points).simplices
    except QhullError:
        return False
    edges = np.unique(np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return int(np.bincount(edges.ravel()).max()) <= MOST_NEIGHBOURS


def _hull(points: Array) -> coal.ConvexBase:
    corners = coal.StdVec_Vec3s()
    for point in points:
        corners.append(np.array(point))
    return coal.ConvexBase.convexHull(corners, True, "Qt")


def _part(mesh: Mesh, triangles: Ints) -> Mesh:
    used, numbers = np.unique(mesh.triangles[triangles], return_inverse=True)
    return Mesh(mesh.vertices[used], numbers.reshape(-1, 3).astype(np.int32))
