"""Ground known from elsewhere (orbit, photogrammetry) laid under the map that the rover's own cameras made."""

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.fusion import lattice
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import BlendSettings


def blend(local: Dem, external: Dem, settings: BlendSettings | None = None) -> Dem:
    """The local map where it is known, the external terrain elsewhere, without a step between them.

    The difference of the two at the nearest local cell fades out over the seam, by 1 − 3t² + 2t³. In the seam the
    variance goes from the local one to that of the external terrain, its own where it has one. Sources gain the
    external terrain's name. The external terrain is sampled at the local cells, on the surface of its triangles.
    Raises InvalidTerrain where the local map has no memory layers or the two don't overlap.
    """
    settings = settings or BlendSettings()
    if not local.remembers or local.variance is None:
        raise InvalidTerrain(f"{local.name!r} does not say how sure its heights are; only a map made from images does")
    grid = _grid(local.geometry, settings.reach)
    heights = lattice.laid_onto(grid, local.heights, local.geometry, np.nan).astype(np.float64)
    known = np.isfinite(heights)
    under = height_at(external, grid.xs[None, :], grid.ys[:, None])
    common = known & np.isfinite(under)
    if not common.any():
        raise InvalidTerrain(f"{external.name!r} has no known ground under the local map, so there is no seam to fit")
    raised = float(np.median((heights - under)[common])) if settings.level else 0.0
    under += raised
    nearest, share = _seam(common, grid.resolution, settings.seam)
    filled = ~known & np.isfinite(under)
    difference = np.where(known, heights - under, 0.0).ravel()[nearest]
    variance = lattice.laid_onto(grid, local.variance, local.geometry, np.nan).astype(np.float64)
    blended = share * variance.ravel()[nearest] + (1.0 - share) * _variance(external, grid, settings.deviation)
    sources = local.sources if external.name in local.sources else (*local.sources, external.name)

    def layer(name: str, other: NDArray | float) -> NDArray:
        mine = getattr(local, name)
        empty = np.nan if mine.dtype.kind == "f" else 0
        return np.where(filled, other, lattice.laid_onto(grid, mine, local.geometry, empty)).astype(mine.dtype)

    return Dem(
        heights=np.where(filled, under + share * difference, heights).astype(np.float32),
        geometry=grid,
        name=f"{local.name}, over {external.name}" + (f" raised by {raised:z.3f} m" if settings.level else ""),
        provenance=Provenance({"local": local.digest, "external": external.digest}, settings),
        texture=None if local.texture is None else layer("texture", 0),
        variance=np.where(filled, blended, variance).astype(np.float32),
        count=layer("count", 1),
        time=layer("time", settings.time),
        source=layer("source", 1 + sources.index(external.name)),
        sources=sources,
        viewpoint=local.viewpoint,
        correction=local.correction,
    )


def _variance(external: Dem, grid: GridGeometry, deviation: float) -> NDArray[np.float64] | float:
    """Of the external heights [m²], on the cells of the grid: its own where it says so."""
    if external.variance is None:
        return deviation**2
    row, col = external.geometry.cell(*np.meshgrid(grid.xs, grid.ys))
    rows, cols = external.geometry.shape
    found = external.variance[np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)].astype(np.float64)
    # beside a hole the nearest cell may be unknown where the surface is not
    return np.where(np.isfinite(found), found, deviation**2)


def _grid(grid: GridGeometry, reach: float) -> GridGeometry:
    half = int(reach / grid.resolution + 1e-6)
    middle_row, middle_col = grid.rows // 2, grid.cols // 2
    if half <= max(middle_row, middle_col):
        return grid
    x0 = grid.x0 + (middle_col - half) * grid.resolution
    y0 = grid.y0 + (middle_row - half) * grid.resolution
    return GridGeometry(x0, y0, grid.resolution, 2 * half + 1, 2 * half + 1)


def _seam(known: NDArray[np.bool_], resolution: float, width: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """For each cell the flat index of the nearest known one, and how much of its difference counts there, 1…0."""
    distance, label = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    label = np.asarray(label, np.int64)
    index = np.zeros(int(label.max()) + 1, np.int64)
    index[label[known]] = np.flatnonzero(known)
    t = np.clip(distance.astype(np.float64) * resolution / width, 0.0, 1.0)
    return index[label], 1.0 - 3.0 * t**2 + 2.0 * t**3
