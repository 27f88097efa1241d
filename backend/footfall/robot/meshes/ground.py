"""What is under the ground: a mesh surface has no inside, so collision checks need a second look.

A link that does not touch the surface is wholly above or wholly below it. So one point of it decides: the link's
centre, compared with the surface's height beside it. The heights are kept on a grid of cells smaller than the ball
around that centre that lies inside the link. Where the link is free of the surface, the surface stays out of the
ball, hence every height in the point's cell lies on the same side of the point: comparing with one of them is exact.
Over unknown ground there is no surface and the answer is "not below".
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh


def crop(mesh: Mesh, center_xy: ArrayLike, radius: float) -> Mesh:
    """The triangles of a mesh that may come near a vertical line.

    Args:
        mesh: the ground, in site [m].
        center_xy: where the line is, (2,) [m].
        radius: how near [m].

    Returns:
        Those triangles.
    """
    corners = mesh.vertices[:, :2][mesh.triangles]
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1, initial=0.0)
    near = np.linalg.norm(middle - np.asarray(center_xy, float), axis=1) <= radius + size
    used, triangles = np.unique(mesh.triangles[near], return_inverse=True)
    return Mesh(mesh.vertices[used], triangles.reshape(-1, 3).astype(np.int32))


def inner_radius(mesh: Mesh) -> float:
    """Radius of a ball about the mean vertex that lies inside a closed convex mesh [m]."""
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return float(((corners[:, 0] - mesh.vertices.mean(axis=0)) * normals).sum(axis=1).min())


class GroundHeights:
    """Heights of a surface mesh on square cells, for :meth:`below`.

    ball: least inner radius of the links whose centres will be asked about [m].
    """

    def __init__(self, mesh: Mesh, ball: float) -> None:
        self._cell = 0.95 * ball / math.sqrt(2)
        # every point of a triangle with edges ≤ s lies within s/√3 of a corner: each covered cell gets a sample
        samples = surface_points(mesh, self._cell * math.sqrt(3) / 2)
        low = np.floor(samples[:, :2].min(axis=0) / self._cell).astype(int)
        cells = np.floor(samples[:, :2] / self._cell).astype(int) - low
        self._shape = tuple(cells.max(axis=0) + 1)
        self._low = low
        heights = np.full(self._shape, -np.inf)
        np.maximum.at(heights, tuple(cells.T), samples[:, 2])
        self._heights = heights

    def above(self, points: Array) -> Array:
        """How far points (n, 3) in site lie above the surface beside them, (n,) [m]; inf over unknown ground."""
        cells = np.floor(points[:, :2] / self._cell).astype(int) - self._low
        inside = ((cells >= 0) & (cells < self._shape)).all(axis=1)
        cells[~inside] = 0
        heights = self._heights[cells[:, 0], cells[:, 1]]
        return np.where(inside, points[:, 2] - heights, np.inf)


def surface_points(mesh: Mesh, spacing: float) -> Array:
    """Points of every triangle on lattices with edges ≤ ``spacing``, and all vertices, (n, 3)."""
    corners = mesh.vertices[mesh.triangles]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(edges / spacing).astype(int), 1)
    points = [mesh.vertices[np.unique(mesh.triangles)]]
    for n in np.unique(parts[parts > 1]):
        weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)], float) / n
        points.append((weights @ corners[parts == n]).reshape(-1, 3))
    return np.concatenate(points)
