"""Terrain with fewer triangles, for collision checks: nowhere below the ground, and above it by no more than it says.

Edges are collapsed by quadric error (Garland & Heckbert, SIGGRAPH 1997), as the library fast-simplification does it.
Quadrics bound nothing, so the height error is measured afterwards, exactly: over both triangulations laid upon each
other the difference of heights is linear in each piece, so it is largest at a corner of one: a vertex of either mesh,
or a crossing of their edges.
"""

import math
from collections.abc import Iterator

import fast_simplification
import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.core.value import Value, value
from footfall.terrain.dem import Dem
from footfall.terrain.ground.rasterise import extremes
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate

KEPT_SHARES = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
"""Shares of the triangles that are tried, until the error holds."""

AGGRESSIVENESS = 3.0
"""Of fast-simplification: lower keeps the shape better and takes longer."""

_POINTS_AT_ONCE = 4_000_000


@value
class SimplifiedMesh(Value):
    """Triangles that lie on the ground or above it. error: largest height above it, measured [m]; tolerance: asked for.

    triangles_before: of the whole triangulation.
    """

    mesh: Mesh
    error: float
    tolerance: float
    triangles_before: int


def simplified(dem: Dem, tolerance: float = 0.01) -> SimplifiedMesh:
    """The coarsest of some simplifications of the surface whose verified height error is at most ``tolerance`` [m].

    Its rim and the rims of its holes stay as they are: it covers neither more nor less ground. Where no simplification
    holds the tolerance it is the whole triangulation. Not to be called by two threads at once: the library keeps the
    mesh in a global. Raises InvalidTerrain for a tolerance that is not above zero, or a terrain without triangles.
    """
    if not 0 < tolerance < math.inf:
        raise InvalidTerrain("a simplification needs a tolerance above zero [m]", tolerance=tolerance)
    whole = triangulate(dem)
    count = len(whole.triangles)
    if not count:
        raise InvalidTerrain("the terrain has no 2 × 2 block of known cells, so it has no triangles to simplify")
    coarsest = 0
    for share in KEPT_SHARES:
        asked = max(1, round(share * count))
        if asked <= coarsest:
            continue  # the rims alone need more than that
        mesh = _collapsed(whole, asked)
        coarsest = max(coarsest, len(mesh.triangles))
        below, above = height_differences(dem, mesh)
        if below + above <= tolerance:
            lifted = mesh.vertices + np.array([0.0, 0.0, below])
            return SimplifiedMesh(Mesh(lifted, mesh.triangles), below + above, tolerance, count)
    return SimplifiedMesh(whole, 0.0, tolerance, count)


def height_differences(dem: Dem, mesh: Mesh) -> tuple[float, float]:
    """How far a mesh dips below the surface of a terrain and rises above it at most, (below, above) ≥ 0 [m].

    Infinite where one of them covers ground that the other does not, or a triangle of the mesh is vertical.
    """
    grid = dem.geometry
    corners = mesh.vertices[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if not len(corners) or (np.abs(normal[:, 2]) <= 1e-9 * np.linalg.norm(normal, axis=1)).any():
        return math.inf, math.inf
    highest, lowest = (layer.reshape(grid.shape) for layer in extremes(corners, normal, grid))
    truth = height_at(dem, grid.xs[None, :], grid.ys[:, None])
    known = np.isfinite(truth)
    if not np.array_equal(known, np.isfinite(highest)):
        return math.inf, math.inf
    below = max(0.0, float((truth - lowest)[known].max()))
    above = max(0.0, float((highest - truth)[known].max()))
    for points in _edge_points(mesh, dem):
        off = points[:, 2] - height_at(dem, points[:, 0], points[:, 1])
        if not np.isfinite(off).all():
            return math.inf, math.inf
        below, above = max(below, float(-off.min())), max(above, float(off.max()))
    return below, above


def _collapsed(mesh: Mesh, count: int) -> Mesh:
    # about the origin, so that its quadrics lose no digits on a large site
    origin = mesh.vertices.mean(axis=0)
    # copies: it takes no read-only arrays
    vertices, triangles, *_ = fast_simplification.simplify(
        mesh.vertices - origin, mesh.triangles.copy(), target_count=count, agg=AGGRESSIVENESS, preserve_border=True
    )
    return Mesh(vertices + origin, np.asarray(triangles, np.int32))


def _edge_points(mesh: Mesh, dem: Dem) -> Iterator[Array]:
    """Points (n, 3) of the mesh's edges: their ends, their crossings of the terrain's edges, and between those."""
    grid = dem.geometry
    ends = np.concatenate([mesh.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    start, way = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]]
    u, du = (start[:, 0] - grid.x0) / grid.resolution, way[:, 0] / grid.resolution
    v, dv = (start[:, 1] - grid.y0) / grid.resolution, way[:, 1] / grid.resolution
    # columns, rows and diagonals of the triangulation
    lines = ((u, du), (v, dv), (u - v, du - dv))
    most = sum(np.ceil(np.abs(rate)).astype(np.int64) + 1 for _, rate in lines) + 2
    done = 0
    for stop in (*(np.flatnonzero(np.diff(np.cumsum(most) // _POINTS_AT_ONCE)) + 1), len(ends)):
        part = slice(done, stop)
        done = stop
        edge = [np.arange(part.start, part.stop)] * 2
        at = [np.zeros(len(edge[0])), np.ones(len(edge[0]))]
        for position, rate in lines:
            first = np.minimum(position[part], position[part] + rate[part])
            last = np.maximum(position[part], position[part] + rate[part])
            low, high = np.ceil(first).astype(np.int64), np.floor(last).astype(np.int64)
            n = np.where(rate[part] != 0, np.maximum(high - low + 1, 0), 0)
            owner = np.repeat(edge[0], n)
            line = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n) + np.repeat(low, n)
            edge.append(owner)
            at.append(np.clip((line - position[owner]) / rate[owner], 0.0, 1.0))
        owner, t = np.concatenate(edge), np.concatenate(at)
        order = np.lexsort((t, owner))
        owner, t = owner[order], t[order]
        same = owner[1:] == owner[:-1]
        between = 0.5 * (t[1:] + t[:-1])[same]
        owner, t = np.concatenate([owner, owner[1:][same]]), np.concatenate([t, between])
        yield start[owner] + t[:, None] * way[owner]
