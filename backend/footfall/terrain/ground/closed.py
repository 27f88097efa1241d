"""Closed solids are told from surfaces by the mesh itself: every edge of a solid joins two triangles."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from footfall.core.mesh import Mesh


def closed_share(mesh: Mesh) -> float:
    """Share, by area seen from above, of the mesh's triangles that belong to closed parts.

    Vertices at one place count as one, as STL repeats them.
    """
    _, at = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = at.reshape(-1)[mesh.triangles].astype(np.int64)
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)[whole].reshape(-1, 2)
    size = int(at.max()) + 1
    _, number, count = np.unique(edges[:, 0] * size + edges[:, 1], return_inverse=True, return_counts=True)
    used = triangles[whole]
    parts, part = connected_components(
        coo_array((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=(size, size)), directed=False
    )
    is_open = np.zeros(parts, bool)
    is_open[part[edges[count[number.reshape(-1)] == 1, 0]]] = True
    corners = mesh.vertices[mesh.triangles[whole]][..., :2]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: NDArray[np.float64] = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    total = float(areas.sum())
    return float(areas[~is_open[part[used[:, 0]]]].sum()) / total if total else 0.0
