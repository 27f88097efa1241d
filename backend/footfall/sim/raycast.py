"""What rays hit: the terrain and the posed robot in one ray-casting scene (Intel Embree through embreex)."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from footfall.core.mesh import Mesh

TERRAIN = 0
"""Index of the terrain among the hit bodies; robot links follow."""


class Hits:
    """First hit of each ray. ``body`` is -1 where the ray went to the sky; the other arrays are meaningless there.

    body: (n,) int, index into the scene's meshes; distance: (n,) in lengths of the ray's direction;
    normal: (n, 3) unit, towards the ray's origin.
    """

    def __init__(self, body: NDArray, distance: NDArray, normal: NDArray) -> None:
        self.body, self.distance, self.normal = body, distance, normal


class RayScene:
    """Immovable meshes, all in one frame."""

    def __init__(self, meshes: list[Mesh]) -> None:
        self._scene = EmbreeScene()
        # embree reads these arrays in place while the scene lives
        self._kept = []
        for mesh in meshes:
            vertices = np.ascontiguousarray(mesh.vertices, np.float32)
            triangles = np.ascontiguousarray(mesh.triangles, np.int32)
            self._kept.append(TriangleMesh(self._scene, vertices, triangles))

    def first_hits(self, origin: NDArray, directions: NDArray) -> Hits:
        """origin: (3,); directions: (n, 3), any length."""
        directions = np.ascontiguousarray(directions, np.float32)
        origins = np.ascontiguousarray(np.broadcast_to(np.asarray(origin, np.float32), directions.shape))
        found = self._scene.run(origins, directions, output=1)
        normal = found["Ng"].astype(float)
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
        normal[np.einsum("ij,ij->i", normal, directions) > 0] *= -1.0
        body = np.where(found["primID"] < 0, -1, found["geomID"])
        return Hits(body, found["tfar"].astype(float), normal)

    def blocked(self, origins: NDArray, direction: NDArray) -> NDArray[np.bool_]:
        """Whether anything lies in one direction (3,) from each origin (n, 3)."""
        origins = np.ascontiguousarray(origins, np.float32)
        directions = np.ascontiguousarray(np.broadcast_to(np.asarray(direction, np.float32), origins.shape))
        return self._scene.run(origins, directions, query="OCCLUDED") != -1
