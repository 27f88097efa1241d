"""A mesh seen from above becomes a Dem: the highest point over each cell centre."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.ground.resample import grid_over

MAX_LAYERED_SHARE = 0.1
"""A mesh is a surface while at most this share of its cells has ground above ground."""

MOST_NATURAL_CELLS = 4_000_000
"""A mesh with finer edges than so many cells over it gets this many."""

_VERTICAL = 1e-9
"""Triangles whose area seen from above is under this share of their own are walls: they cover no cell."""

_SPANS_AT_ONCE = 500_000
_CELLS_AT_ONCE = 4_000_000


def rasterise(mesh: Mesh, resolution: float | None = None, name: str = "mesh") -> Dem:
    """The highest surface of a mesh as a terrain.

    The grid starts at the mesh's south-west corner. A few overhangs, such as rocks, are cut to their upper side.

    Args:
        mesh: z up [m].
        resolution: side of the cells [m]; None: a short edge of those seen from above, fitted to the extent.
        name: what the map is called.

    Returns:
        The ground; NaN where no triangle covers the cell's centre.

    Raises:
        InvalidTerrain: the mesh is no surface seen from above: it has no triangles, only walls, or more than
            MAX_LAYERED_SHARE of its cells lie under another part of it (a closed solid, a roof).
    """
    if not len(mesh.triangles):
        raise InvalidTerrain("the mesh has no triangles; a terrain needs a surface, not points")
    corners = mesh.vertices[mesh.triangles]
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge_1, edge_2)
    faces_sky = np.abs(normal[:, 2]) > _VERTICAL * np.linalg.norm(normal, axis=1)
    if not faces_sky.any():
        raise InvalidTerrain(
            "every triangle of the mesh is vertical or has no area; a terrain is seen from above, z up"
        )
    corners, normal = corners[faces_sky], normal[faces_sky]
    flat = corners[..., :2].reshape(-1, 2)
    (west, south), (east, north) = flat.min(axis=0), flat.max(axis=0)
    if resolution is None:
        resolution = _natural_resolution(corners, east - west, north - south)
    grid = grid_over((west, south, east, north), resolution)

    highest, lowest = extremes(corners, normal, grid)
    covered = np.isfinite(highest)
    if not covered.any():
        raise InvalidTerrain(
            f"the mesh covers no cell centre at a resolution of {resolution:g} m; choose a finer resolution"
        )
    layered = _layered_share(corners, highest, lowest)
    if layered > MAX_LAYERED_SHARE:
        # centres on top of vertical steps have two heights too: look again off any pattern of the mesh
        aside = GridGeometry(west + 0.382 * resolution, south + 0.276 * resolution, resolution, grid.rows, grid.cols)
        layered = _layered_share(corners, *extremes(corners, normal, aside))
    if layered > MAX_LAYERED_SHARE:
        raise InvalidTerrain(
            f"the mesh is not a surface: {layered:.0%} of its cells lie under another part of it "
            f"(up to {MAX_LAYERED_SHARE:.0%} is accepted); keep only the upper side, z up",
            layered_share=layered,
            limit=MAX_LAYERED_SHARE,
        )
    heights = np.where(covered, highest, np.nan).reshape(grid.shape).astype(np.float32)
    return Dem(heights, grid, name, Provenance(parents={}))


def extremes(corners: Array, normal: Array, grid: GridGeometry) -> tuple[Array, Array]:
    """Highest and lowest point of a mesh over each cell centre.

    Args:
        corners: of its triangles, (m, 3, 3) [m].
        normal: of each, (m, 3).
        grid: the cells.

    Returns:
        Heights (rows · cols,) each [m]; −inf and inf where there is none.
    """
    highest, lowest = np.full(grid.rows * grid.cols, -np.inf), np.full(grid.rows * grid.cols, np.inf)
    for cells, z in _covered_cells(corners, normal, grid):
        np.maximum.at(highest, cells, z)
        np.minimum.at(lowest, cells, z)
    return highest, lowest


def _layered_share(corners: Array, highest: Array, lowest: Array) -> float:
    """Share of the covered cells whose highest and lowest point differ."""
    same = 1e-6 * max(float(np.ptp(corners.reshape(-1, 3), axis=0).max()), 1.0)
    covered = np.isfinite(highest)
    return float(np.mean((highest - lowest)[covered] > same)) if covered.any() else 0.0


def _natural_resolution(corners: Array, width: float, depth: float) -> float:
    """An edge that nine tenths are longer than, seen from above, adjusted by under 1 % to divide the longer side."""
    edges = np.linalg.norm((corners - np.roll(corners, 1, axis=1))[..., :2], axis=-1)
    side = max(width, depth)
    edge = max(float(np.percentile(edges[edges > 0], 10)), math.sqrt(width * depth / MOST_NATURAL_CELLS))
    fitted = side / max(round(side / edge), 1)
    return fitted if abs(fitted - edge) < 0.01 * edge else edge


def _covered_cells(corners: Array, normal: Array, grid: GridGeometry) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Flat cell indices whose centre a triangle covers, with the triangle's height there.

    Row by row: a line of cell centres meets a triangle in one span. Work grows with the cells that are
    covered, not with the triangles' bounding boxes.
    """
    # in cells, so that centres are whole numbers
    u = (corners[..., 0] - grid.x0) / grid.resolution
    v = (corners[..., 1] - grid.y0) / grid.resolution
    slack = 1e-6
    first = np.maximum(np.ceil(v.min(axis=1) - slack), 0).astype(np.int64)
    last = np.minimum(np.floor(v.max(axis=1) + slack), grid.rows - 1).astype(np.int64)
    for tri, row in _ranges(np.arange(len(u)), first, last, _SPANS_AT_ONCE):
        west, east = _span(u[tri], v[tri], row)
        begin = np.maximum(np.ceil(west - slack), 0)
        end = np.minimum(np.floor(east + slack), grid.cols - 1)
        met = np.flatnonzero(end >= begin)
        spans = _ranges(met, begin[met].astype(np.int64), end[met].astype(np.int64), _CELLS_AT_ONCE)
        for span, col in spans:
            t, r = tri[span], row[span]
            corner, n = corners[t, 0], normal[t]
            dx = (col - u[t, 0]) * grid.resolution
            dy = (r - v[t, 0]) * grid.resolution
            z = corner[:, 2] - (n[:, 0] * dx + n[:, 1] * dy) / n[:, 2]
            # steep triangles magnify the slack; their own corners bound them
            z = np.clip(z, corners[t, :, 2].min(axis=1), corners[t, :, 2].max(axis=1))
            yield r * grid.cols + col, z


def _span(u: Array, v: Array, row: NDArray[np.int64]) -> tuple[Array, Array]:
    """West and east end (n,) of triangles (n, 3) along the lines v = row; (inf, −inf) where they miss."""
    west, east = np.full(len(u), np.inf), np.full(len(u), -np.inf)
    line = np.clip(row, v.min(axis=1), v.max(axis=1))
    for i in range(3):
        j = (i + 1) % 3
        rise = v[:, j] - v[:, i]
        level = rise == 0
        with np.errstate(over="ignore"):
            share = (line - v[:, i]) / np.where(level, 1.0, rise)
        crosses = ((share >= 0) & (share <= 1)) & ~(level & (line != v[:, i]))
        at_i = u[:, i] + np.where(crosses & ~level, share, 0.0) * (u[:, j] - u[:, i])
        at_j = np.where(level, u[:, j], at_i)
        west = np.where(crosses, np.minimum(west, np.minimum(at_i, at_j)), west)
        east = np.where(crosses, np.maximum(east, np.maximum(at_i, at_j)), east)
    return west, east


def _ranges(
    owner: NDArray[np.int64], first: NDArray[np.int64], last: NDArray[np.int64], limit: int
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """(owner, i) for every i from first to last of every owner, in pieces of about ``limit``."""
    count = np.maximum(last - first + 1, 0)
    ends = np.cumsum(count)
    start = 0
    while start < len(owner):
        done = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, done + limit, side="right")), start + 1)
        n = count[start:stop]
        before = np.repeat(np.cumsum(n) - n, n)
        yield np.repeat(owner[start:stop], n), np.repeat(first[start:stop], n) + np.arange(n.sum()) - before
        start = stop
