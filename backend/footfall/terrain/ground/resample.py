"""The same ground on other cells."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_cell_count, from_heights
from footfall.terrain.ground.surface import height_at


def resample(dem: Dem, resolution: float) -> Dem:
    """The map's surface at cells of another ``resolution`` [m], from the same south-west cell centre.

    New heights are points of the triangulated surface, not averages. A texture is not kept.
    """
    grid = grid_over(dem.geometry.bounds, resolution)
    heights = np.full(grid.shape, np.nan, np.float32)
    for row, y in enumerate(grid.ys):
        heights[row] = height_at(dem, grid.xs, y)
    if not np.isfinite(heights).any():
        raise InvalidTerrain(f"at cells of {resolution} m no known height is left; choose a finer resolution")
    sampled = from_heights(heights, resolution, grid.x0, grid.y0, dem.name, provenance=dem.provenance)
    return replace(sampled, true_north=dem.true_north)


def square_cells(heights: NDArray, spacing_x: float, spacing_y: float, resolution: float) -> NDArray[np.float64]:
    """Heights of a grid with oblong cells on square ones, by bilinear interpolation, from the same cell (0, 0).

    Args:
        heights: (rows, cols) [m].
        spacing_x: between columns [m].
        spacing_y: between rows [m].
        resolution: side of the square cells [m].

    Returns:
        Heights (rows, cols) of those [m].
    """
    rows, cols = heights.shape
    grid = grid_over((0.0, 0.0, (cols - 1) * spacing_x, (rows - 1) * spacing_y), resolution)
    along_x = np.empty((rows, grid.cols))
    for row in range(rows):
        along_x[row] = np.interp(grid.xs / spacing_x, np.arange(cols), heights[row])
    position = np.clip(grid.ys / spacing_y, 0, rows - 1)
    below = np.minimum(position.astype(int), max(rows - 2, 0))
    above = np.minimum(below + 1, rows - 1)
    share = (position - below)[:, None]
    return (1 - share) * along_x[below] + share * along_x[above]


def grid_over(bounds: tuple[float, float, float, float], resolution: float) -> GridGeometry:
    """Cells of ``resolution`` [m] with centres from (west, south) to at most (east, north)."""
    if not 0 < resolution < np.inf:
        raise InvalidTerrain(f"a resolution must be positive [m], not {resolution}")
    west, south, east, north = bounds
    # a hair of slack, so that 8 m / 0.02 m is 400 cells whatever the rounding
    cols, rows = np.floor((east - west) / resolution + 1e-4) + 1, np.floor((north - south) / resolution + 1e-4) + 1
    check_cell_count(rows, cols)
    return GridGeometry(float(west), float(south), float(resolution), int(rows), int(cols))
