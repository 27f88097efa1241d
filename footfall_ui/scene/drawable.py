"""The ground as it is drawn: of a large map every n-th cell, as no page holds more. Nothing is decided by it."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights

MOST_CELLS = 1 << 20
"""That are drawn: 13 MB for a page."""


def every(cells: int) -> int:
    """Of so many cells, which are drawn: 1 = each, 2 = each second one of a row, of each second row."""
    return max(1, math.ceil(math.sqrt(cells / MOST_CELLS)))


@lru_cache(maxsize=2)
def drawable(dem: Dem) -> Dem:
    """The terrain, or its every n-th cell where it has more than MOST_CELLS and any of these is known."""
    step = every(dem.heights.size)
    if step == 1:
        return dem
    cells, texture = dem.geometry, None if dem.texture is None else dem.texture[::step, ::step]
    heights = dem.heights[::step, ::step]
    if not np.isfinite(heights).any():
        return dem
    thin = from_heights(heights, cells.resolution * step, cells.x0, cells.y0, dem.name, texture=texture)
    return replace(thin, true_north=dem.true_north)


def picked(rgb: NDArray[np.uint8], cells: GridGeometry, wanted: GridGeometry) -> NDArray[np.uint8]:
    """Colours of ``cells`` (rows, cols, 3) at the middles of other cells; outside, those at the edge."""
    row = np.clip(np.round((wanted.ys - cells.y0) / cells.resolution).astype(int), 0, cells.rows - 1)
    col = np.clip(np.round((wanted.xs - cells.x0) / cells.resolution).astype(int), 0, cells.cols - 1)
    return rgb[np.ix_(row, col)]
