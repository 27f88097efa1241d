"""Many views of one grid cell made into one height."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.terrain.fusion.fuse_kernel import by_cell, fuse_cells, median_around
from footfall.terrain.fusion.grid_depth import CellSamples

OUTLYING = 3 * 1.4826
"""Three standard deviations of a normal distribution, in median distances from its median."""


class Fused(NamedTuple):
    """Cells of a grid after fusion, each (rows, cols).

    heights: float32 [m], NaN where nobody looked. texture: uint8 grey of the best view, 0 where unknown.
    variance: float32 [m²], NaN where unknown. count: uint16, measurements that agreed. view: int16 index of the best
    view, −1 where none.
    """

    heights: NDArray[np.float32]
    texture: NDArray[np.uint8]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    view: NDArray[np.int16]


def fuse(samples: list[CellSamples], geometry: GridGeometry, gate: float) -> Fused:
    """One height for each cell out of what all views say.

    In each cell: the median of the heights, weighted by inverse variance; then the weighted mean of those within
    ``gate`` of it, so that one view that is wrong (a reflection, a leg that moved) does not pull the others. The mean
    is the gated Kalman update of a height that stands still, in its information form (Maybeck, Stochastic Models,
    Estimation and Control, 1979, §5.7): the inverse variances add up, in whatever order.

    Args:
        samples: of each view.
        geometry: the grid.
        gate: how far a height may be from the median [m].

    Returns:
        Heights, variances and what else is known of each cell.

    Raises:
        InvalidTerrain: samples are of cells that the grid does not have.
    """
    cell = np.concatenate([s.cell for s in samples])
    height = np.concatenate([s.height for s in samples])
    weight = 1.0 / np.concatenate([s.variance for s in samples])
    grey = np.concatenate([s.grey for s in samples])
    view = np.repeat(np.arange(len(samples), dtype=np.int16), [len(s.cell) for s in samples])
    if len(cell) and not (cell.min() >= 0 and cell.max() < geometry.rows * geometry.cols):
        raise InvalidTerrain(
            f"samples name cells {cell.min()} to {cell.max()} of a grid that has {geometry.rows * geometry.cols}"
        )
    heights, information, count, best = fuse_cells(
        *by_cell(cell, geometry.rows * geometry.cols), height, weight, grey, gate
    )
    known = best >= 0
    texture, best_view = np.zeros(known.shape, np.uint8), np.full(known.shape, -1, np.int16)
    texture[known] = np.clip(np.rint(grey[best[known]]), 1, 255)
    best_view[known] = view[best[known]]
    variance = np.full(known.shape, np.nan, np.float32)
    variance[known] = 1.0 / information[known]
    shape = geometry.shape
    return Fused(
        heights.astype(np.float32).reshape(shape),
        texture.reshape(shape),
        variance.reshape(shape),
        np.minimum(count, np.iinfo(np.uint16).max).astype(np.uint16).reshape(shape),
        best_view.reshape(shape),
    )


def despike(
    heights: NDArray[np.float32], limit: float, min_neighbours: int, where: NDArray[np.bool_] | None = None
) -> NDArray[np.float32]:
    """Put spikes at the median of their 5 × 5 neighbours.

    A spike is a cell further from that median than ``limit`` and than OUTLYING times the neighbours' median distance
    from it (Hampel's identifier: Davies & Gather, JASA 1993): on level ground a step of ``limit`` is one, the top of a
    rock among its own flanks is none.

    Args:
        heights: (rows, cols) [m], NaN where unknown.
        limit: see above [m].
        min_neighbours: cells with fewer known ones among those 25, themselves included, become unknown.
        where: (rows, cols) the cells that are looked at, the others stay; None: all.

    Returns:
        Heights (rows, cols) [m]; unknown cells stay so.
    """
    where = np.isfinite(heights) if where is None else where
    median, spread, known = median_around(heights, 2, where)
    most = np.maximum(np.float32(limit), np.float32(OUTLYING) * spread)
    cleaned = np.where(np.abs(heights - median) > most, median, heights)
    cleaned[where & (known < min_neighbours)] = np.nan
    return cleaned
