"""Grids of one lattice: cells laid from one map onto another by whole cells, never resampled."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry

_OFF = 1e-3
"""Cells: two lattices whose centres differ by more than this are two."""


def offset(grid: GridGeometry, other: GridGeometry) -> tuple[int, int]:
    """Row and column of ``grid`` at which cell (0, 0) of ``other`` lies.

    Raises InvalidTerrain where the resolutions differ or the cell centres don't coincide.
    """
    if abs(grid.resolution - other.resolution) > 1e-9 * grid.resolution:
        raise InvalidTerrain(
            f"cells of {other.resolution:g} m can't be laid onto a map of {grid.resolution:g} m; use one resolution"
        )
    row, col = (other.y0 - grid.y0) / grid.resolution, (other.x0 - grid.x0) / grid.resolution
    if max(abs(row - round(row)), abs(col - round(col))) > _OFF:
        raise InvalidTerrain(
            f"the cell centres of the two maps lie {abs(col - round(col)):z.2f}, {abs(row - round(row)):z.2f} cells "
            "apart; resample one of them to the cells of the other"
        )
    return round(row), round(col)


def union(grid: GridGeometry, other: GridGeometry) -> GridGeometry:
    """The smallest grid of the same lattice that holds both."""
    row, col = offset(grid, other)
    first_row, first_col = min(row, 0), min(col, 0)
    last_row = max(row + other.rows, grid.rows)
    last_col = max(col + other.cols, grid.cols)
    return _window(grid, first_row, first_col, last_row - first_row, last_col - first_col)


def window(grid: GridGeometry, x: float, y: float, half_size: float) -> GridGeometry:
    """The part of a grid around a place.

    Args:
        grid: the whole.
        x: east, in site [m].
        y: north, in site [m].
        half_size: how far it goes from the cell at that place, east-west and north-south [m].

    Returns:
        The grid of that part.

    Raises:
        InvalidTerrain: nothing of the map lies there.
    """
    half = int(half_size / grid.resolution + 1e-6)
    row, col = (int(i) for i in grid.cell(x, y))
    first_row, last_row = max(row - half, 0), min(row + half, grid.rows - 1)
    first_col, last_col = max(col - half, 0), min(col + half, grid.cols - 1)
    if first_row > last_row or first_col > last_col:
        raise InvalidTerrain(f"nothing of the map lies within {half_size:g} m of ({x:z.1f}, {y:z.1f})")
    return _window(grid, first_row, first_col, last_row - first_row + 1, last_col - first_col + 1)


def laid_onto(grid: GridGeometry, layer: NDArray, of: GridGeometry, empty: float) -> NDArray:
    """A layer of one grid on the cells of another.

    Args:
        grid: the other.
        layer: (rows, cols) of ``of``.
        of: the layer's grid, with cells on the same lattice.
        empty: stands where the layer has no cell.

    Returns:
        (rows, cols) of ``grid``.
    """
    row, col = offset(grid, of)
    out = np.full(grid.shape, empty, layer.dtype)
    low_row, high_row = max(row, 0), min(row + of.rows, grid.rows)
    low_col, high_col = max(col, 0), min(col + of.cols, grid.cols)
    if low_row < high_row and low_col < high_col:
        out[low_row:high_row, low_col:high_col] = layer[low_row - row : high_row - row, low_col - col : high_col - col]
    return out


def _window(grid: GridGeometry, row: int, col: int, rows: int, cols: int) -> GridGeometry:
    """Its origin is computed from whole multiples of the resolution where it lies on one, so that no error adds up."""
    return GridGeometry(
        _moved(grid.x0, col, grid.resolution), _moved(grid.y0, row, grid.resolution), grid.resolution, rows, cols
    )


def _moved(start: float, cells: int, resolution: float) -> float:
    multiple = start / resolution
    if abs(multiple - round(multiple)) < _OFF:
        return (round(multiple) + cells) * resolution
    return start + cells * resolution
