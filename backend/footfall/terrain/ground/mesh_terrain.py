"""A mesh becomes a Dem whose cells follow the mesh's own detail, and the Dem says how far it is from the mesh.

The Dem's surface is compared with the mesh along vertical lines: at corners of faces, middles of edges and random
points. At a wall the two differ by up to its height however small the cells are, and corners of stairs lie on walls.
So two numbers decide: what 95 % of random points, which are drawn by area, stay under; and how much higher or lower
than *every* cell around it a point of the mesh is. The first tells that a stair became a ramp, the second that a ridge
or a post lies between the cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem, HeightError
from footfall.terrain.ground.mesh_heights_kernel import highest_at, sorted_into_bins
from footfall.terrain.ground.rasterise import rasterise
from footfall.terrain.ground.surface import height_at

MOST_ERROR = 0.1
"""Height error [m] that is accepted where nobody says another: well under the radius of a wheel."""

_AIM = 0.02
"""Cells are halved until 95 % of the heights are this good [m], while they are few enough."""

_ASIDE, _STEP = 0.05, 0.05
"""And until nothing of the mesh is farther than _STEP from every height that the Dem has within _ASIDE of it [m]: a
stair on a large floor is a small share of its area, and a ramp in place of a riser is wrong where the wheel goes."""

MOST_CELLS = 4_000_000
"""Of a map whose cell size nobody stated, such as 20 × 20 m at 1 cm."""

_SAMPLES = 50_000
"""Of each kind: corners, middles of edges, random points."""

_SEED = 20081
_BINS = 512
"""Most bins along a side."""

_VERTICAL = 1e-9
"""As in rasterise: faces seen as less than this share of their area are walls."""


def terrain_of_mesh(
    mesh: Mesh, resolution: float | None, name: str, unit: float = 1.0, most_error: float = MOST_ERROR
) -> Dem:
    """The highest surface of a mesh, with its height error, in the mesh's own unit.

    Args:
        mesh: z up, in a unit of its own.
        resolution: side of the cells, in that unit; None: that of the mesh's detail.
        name: what the map is called.
        unit: how long the mesh's unit is [m].
        most_error: how far, vertically, the mesh may be from the cells' surface [m].

    Returns:
        The ground.

    Raises:
        InvalidTerrain: the mesh is no surface, see :func:`~footfall.terrain.ground.rasterise.rasterise`, or farther
            from the cells' than is accepted.
    """
    surface = _Surface(mesh)
    dem = rasterise(mesh, resolution, name)
    found = surface.error(dem)
    if resolution is None:
        while 4 * dem.heights.size <= MOST_CELLS and not (
            found.within(_AIM / unit, most_error / unit) and surface.aside(dem, _ASIDE / unit) <= _STEP / unit
        ):
            dem = rasterise(mesh, dem.geometry.resolution / 2, name)
            found = surface.error(dem)
    if not found.within(most_error / unit, most_error / unit):
        raise _refused(surface, mesh, dem, found, unit, most_error)
    return replace(dem, height_error=HeightError(found.p95, found.most))


def height_error(mesh: Mesh, dem: Dem) -> HeightError:
    """How far the Dem's surface is from the mesh, vertically, in the mesh's unit."""
    found = _Surface(mesh).error(dem)
    return HeightError(found.p95, found.most)


@dataclass(frozen=True)
class _Found:
    """p95, most: of the vertical differences. missed: how far the mesh goes beyond all cells around a point.

    at: where most of it is missed, or, where nothing is, the difference is largest, in the mesh's coordinates.
    """

    p95: float
    most: float
    missed: float
    at: tuple[float, float] = (0.0, 0.0)

    def within(self, p95: float, missed: float) -> bool:
        return self.p95 <= p95 and self.missed <= missed


class _Surface:
    """The faces of a mesh that the sky sees, to be asked for heights, and the points to compare at."""

    def __init__(self, mesh: Mesh) -> None:
        corners = np.asarray(mesh.vertices, np.float64)[mesh.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = np.abs(normal[:, 2]) > _VERTICAL * np.linalg.norm(normal, axis=1)
        # about the middle: cross products of northings in the millions would have no digits left
        self._middle = np.append(corners.reshape(-1, 3)[:, :2].mean(axis=0), 0.0) if len(corners) else np.zeros(3)
        self._corners = np.ascontiguousarray(corners[facing] - self._middle)
        if not facing.any():
            return
        low, high = self._corners[..., :2].min(axis=1), self._corners[..., :2].max(axis=1)
        self._low, extent = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
        self._pitch = max(float((high - low).mean()), float(extent.max()) / _BINS)
        self._shape = (int(extent[1] / self._pitch) + 1, int(extent[0] / self._pitch) + 1)
        first, last = self._cells(low), self._cells(high)
        boxes = np.column_stack([first[:, 1], last[:, 1], first[:, 0], last[:, 0]])
        self._begin, self._members = sorted_into_bins(boxes, self._shape)
        points = list(_points(self._corners, np.abs(normal[facing, 2])))
        self._random = len(points[-1])
        self._points = np.concatenate(points)
        self._heights = self._highest(self._points)

    def error(self, dem: Dem) -> _Found:
        x, y = self._points[:, 0] + self._middle[0], self._points[:, 1] + self._middle[1]
        off = np.abs(height_at(dem, x, y) - self._heights)
        known = np.isfinite(off)
        if not known.any():
            return _Found(0.0, 0.0, 0.0)
        by_area = off[-self._random :][known[-self._random :]]
        missed = _beyond_cells(dem, x[known], y[known], self._heights[known])
        worst = int(np.argmax(missed if missed.max() > 0 else off[known]))
        return _Found(
            float(np.percentile(by_area, 95)) if len(by_area) else 0.0,
            float(off[known].max()),
            float(missed.max()),
            (float(x[known][worst]), float(y[known][worst])),
        )

    def aside(self, dem: Dem, distance: float) -> float:
        """By how much the mesh goes at most beyond the Dem's heights that far around, 0 where they are unknown."""
        x, y = self._points[:, 0] + self._middle[0], self._points[:, 1] + self._middle[1]
        here = height_at(dem, x, y)
        low, high = here.copy(), here.copy()
        apart = np.flatnonzero(np.abs(here - self._heights) > 0)
        for angle in np.arange(8) * (np.pi / 4):
            around = height_at(dem, x[apart] + distance * np.cos(angle), y[apart] + distance * np.sin(angle))
            low[apart], high[apart] = np.fmin(low[apart], around), np.fmax(high[apart], around)
        beyond = np.maximum(low - self._heights, self._heights - high)
        return float(np.nanmax(beyond, initial=0.0))

    def _cells(self, xy: Array) -> NDArray[np.int64]:
        cells = np.floor((xy - self._low) / self._pitch).astype(np.int64)
        return np.clip(cells, 0, np.array(self._shape[::-1]) - 1)

    def _highest(self, points: Array) -> Array:
        cells = self._cells(points)
        return highest_at(
            self._corners, self._begin, self._members, cells[:, 1] * self._shape[1] + cells[:, 0], points, 1e-9
        )


def _points(corners: Array, areas: Array) -> Iterator[Array]:
    """Where to compare, (k, 2) each: corners, middles of edges, and last, drawn by area, points of faces."""
    rng = np.random.default_rng(_SEED)
    flat = corners[..., :2]
    for some in (flat, (flat + np.roll(flat, 1, axis=1)) / 2):
        every = some.reshape(-1, 2)
        yield every if len(every) <= _SAMPLES else every[rng.choice(len(every), _SAMPLES, replace=False)]
    face = np.searchsorted(np.cumsum(areas) / areas.sum(), rng.random(_SAMPLES)).clip(0, len(areas) - 1)
    # uniform over a triangle
    root, share = np.sqrt(rng.random((_SAMPLES, 1))), rng.random((_SAMPLES, 1))
    a, b, c = flat[face].transpose(1, 0, 2)
    yield (1 - root) * a + root * (1 - share) * b + root * share * c


def _beyond_cells(dem: Dem, x: Array, y: Array, z: Array) -> Array:
    """By how much heights go beyond all of the 4 × 4 cells around them."""
    grid = dem.geometry
    row = np.floor((y - grid.y0) / grid.resolution).astype(np.int64)
    col = np.floor((x - grid.x0) / grid.resolution).astype(np.int64)
    low, high = np.full(len(z), np.inf), np.full(len(z), -np.inf)
    for dr in range(-1, 3):
        for dc in range(-1, 3):
            around = dem.heights[(row + dr).clip(0, grid.rows - 1), (col + dc).clip(0, grid.cols - 1)]
            low, high = np.fmin(low, around), np.fmax(high, around)
    return np.maximum(np.maximum(low - z, z - high), 0.0)


def _refused(surface: _Surface, mesh: Mesh, dem: Dem, found: _Found, unit: float, most_error: float) -> InvalidTerrain:
    limit, cell = most_error / unit, dem.geometry.resolution
    finer, grid = cell / 2, dem.geometry
    enough = None
    while enough is None and grid.rows * grid.cols * (cell / finer) ** 2 <= 4 * MOST_CELLS:
        again = surface.error(rasterise(mesh, finer, dem.name))
        enough = finer if again.within(limit, limit) else None
        finer /= 2
    hint = (
        f"use --resolution {enough * unit:.3g} or finer"
        if enough is not None
        else f"no cells down to {2 * finer * unit:.3g} m would do: cut out the part that is needed"
    )
    return InvalidTerrain(
        f"with cells of {cell * unit:.3g} m {dem.name} would be up to {found.most * unit:z.2f} m from its own surface "
        f"(5 % of it by more than {found.p95 * unit:z.2f} m, details of {found.missed * unit:z.2f} m are lost), "
        f"worst at ({found.at[0] * unit:z.2f}, {found.at[1] * unit:z.2f}); "
        f"{most_error:g} m is accepted; {hint}, or accept more with --most-error",
        p95=found.p95 * unit,
        most=found.most * unit,
        limit=most_error,
        at=[found.at[0] * unit, found.at[1] * unit],
        resolution=None if enough is None else enough * unit,
    )
