"""Compiled search for the nearest triangle that faces the same way."""

import math

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit


def nearest_triangles(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    corners: NDArray[np.float64],
    triangle_normals: NDArray[np.float64],
    first: NDArray[np.int64],
    reach: float,
    alike: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """For each point the nearest triangle, and its nearest point.

    Parts that are too far away are passed over at once.

    Args:
        points: (n, 3) [m].
        normals: (n, 3) unit, of the surface at the points.
        corners: of the triangles, (m, 3, 3) [m].
        triangle_normals: (m, 3) unit.
        first: (parts + 1,), the triangles of part i are first[i] to first[i + 1] − 1.
        reach: how far a triangle may be [m].
        alike: least cosine of the angle between the two normals; others don't count.

    Returns:
        Numbers (n,), −1 where there is none, and points (n, 3) [m].
    """
    centers, radii = _spheres(corners, first)
    found, at = np.full(len(points), -1, np.int64), np.zeros((len(points), 3))
    _search(
        np.ascontiguousarray(points),
        np.ascontiguousarray(normals),
        np.ascontiguousarray(corners),
        np.ascontiguousarray(triangle_normals),
        first,
        centers,
        radii,
        reach,
        alike,
        found,
        at,
    )
    return found, at


def _spheres(corners: NDArray[np.float64], first: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """A ball around the corners of each part: centres (parts, 3) and radii (parts,) [m], −∞ for a part of none."""
    centers, radii = np.zeros((len(first) - 1, 3)), np.full(len(first) - 1, -np.inf)
    for i in np.flatnonzero(first[1:] > first[:-1]):
        own = corners[first[i] : first[i + 1]].reshape(-1, 3)
        centers[i] = 0.5 * (own.min(axis=0) + own.max(axis=0))
        radii[i] = np.linalg.norm(own - centers[i], axis=1).max()
    return centers, radii


@njit()
def _search(points, normals, corners, triangle_normals, first, centers, radii, reach, alike, found, at):
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        best = reach * reach
        for part in range(centers.shape[0]):
            dx, dy, dz = px - centers[part, 0], py - centers[part, 1], pz - centers[part, 2]
            gap = math.sqrt(dx * dx + dy * dy + dz * dz) - radii[part]
            if gap > 0.0 and gap * gap >= best:
                continue
            for t in range(first[part], first[part + 1]):
                n = triangle_normals[t]
                if n[0] * normals[i, 0] + n[1] * normals[i, 1] + n[2] * normals[i, 2] < alike:
                    continue
                # no point of a triangle is nearer than its plane
                height = (
                    n[0] * (px - corners[t, 0, 0]) + n[1] * (py - corners[t, 0, 1]) + n[2] * (pz - corners[t, 0, 2])
                )
                if height * height >= best:
                    continue
                x, y, z = _on_triangle(px, py, pz, corners[t])
                away = (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2
                if away < best:
                    best = away
                    found[i] = t
                    at[i, 0], at[i, 1], at[i, 2] = x, y, z


@njit()
def _on_triangle(px, py, pz, corners):
    """The nearest point of a triangle, by the regions around it.

    Ericson, *Real-Time Collision Detection*, 2005, §5.1.5.
    """
    ax, ay, az = corners[0, 0], corners[0, 1], corners[0, 2]
    abx, aby, abz = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    acx, acy, acz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    apx, apy, apz = px - ax, py - ay, pz - az
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    if d1 <= 0.0 and d2 <= 0.0:
        return ax, ay, az
    bpx, bpy, bpz = px - corners[1, 0], py - corners[1, 1], pz - corners[1, 2]
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    if d3 >= 0.0 and d4 <= d3:
        return corners[1, 0], corners[1, 1], corners[1, 2]
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return ax + v * abx, ay + v * aby, az + v * abz
    cpx, cpy, cpz = px - corners[2, 0], py - corners[2, 1], pz - corners[2, 2]
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
    if d6 >= 0.0 and d5 <= d6:
        return corners[2, 0], corners[2, 1], corners[2, 2]
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return ax + w * acx, ay + w * acy, az + w * acz
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return (
            corners[1, 0] + w * (corners[2, 0] - corners[1, 0]),
            corners[1, 1] + w * (corners[2, 1] - corners[1, 1]),
            corners[1, 2] + w * (corners[2, 2] - corners[1, 2]),
        )
    share = 1.0 / (va + vb + vc)
    v, w = vb * share, vc * share
    return ax + abx * v + acx * w, ay + aby * v + acy * w, az + abz * v + acz * w
