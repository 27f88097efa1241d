"""Closed low-count meshes of the simple shapes that robot descriptions use."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.mesh import Mesh


def box(size: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Box of edge lengths ``size`` (3,) [m]: 8 vertices, 12 triangles."""
    half = np.asarray(size, float) / 2
    signs = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return _mesh(signs * half + np.asarray(center, float), triangles)


def prism(corners: int, width: float, height: float, center: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Upright regular prism, its first corner on +x.

    Args:
        corners: how many.
        width: across the corners [m].
        height: of the prism [m].
        center: (3,) [m].

    Returns:
        The mesh.
    """
    angles = [2 * math.pi * i / corners for i in range(corners)]
    rim = np.array([(math.cos(a) * width / 2, math.sin(a) * width / 2, 0.0) for a in angles])
    lift = np.array([0.0, 0.0, height / 2])
    return _mesh(np.concatenate([rim - lift, rim + lift]) + np.asarray(center, float), _drum(corners))


def cylinder_y(radius: float, width: float, sides: int, center: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Cylinder about y; its corners lie on the radius and the first one points along +x.

    Args:
        radius: of the circle [m].
        width: along y [m].
        sides: how many corners a circle has.
        center: (3,) [m].

    Returns:
        The mesh.
    """
    upright = prism(sides, 2 * radius, width)
    # (x, y, z) → (x, z, −y) turns the axis from z to y and keeps the handedness
    vertices = upright.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    return _mesh(vertices + np.asarray(center, float), upright.triangles)


def extents(mesh: Mesh) -> NDArray[np.float64]:
    """Size of the axis-aligned box around a mesh, (3,) [m]."""
    return np.ptp(mesh.vertices, axis=0)


def merged(meshes: list[Mesh]) -> Mesh:
    """All meshes as one, unconnected."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts, strict=False)]).astype(np.int32),
    )


def obj_text(mesh: Mesh) -> str:
    """Wavefront OBJ text of a mesh."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.triangles]
    return "\n".join(lines) + "\n"


def _drum(n: int) -> list[tuple[int, int, int]]:
    sides = []
    for i in range(n):
        j = (i + 1) % n
        sides += [(i, j, n + j), (i, n + j, n + i)]
    bottom = [(0, i + 1, i) for i in range(1, n - 1)]
    top = [(n, n + i, n + i + 1) for i in range(1, n - 1)]
    return sides + bottom + top


def _mesh(vertices: NDArray[np.float64], triangles: ArrayLike) -> Mesh:
    # Whole nanometres: sines differ in the last bit between machines, and the digest must not.
    return Mesh(np.round(vertices, 9) + 0.0, np.asarray(triangles, np.int32))
