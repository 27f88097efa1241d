"""Layer colours over what the cameras saw, as the scene shows them.

Images and relief only darken a colour: its hue stays the legend's, so that a class is told apart anywhere.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.terrain.dem import Dem

GRAIN = 0.25
"""How much darker the darkest of the images makes a colour than the brightest."""
STRETCHED = (2, 98)
"""Percentiles of the images between which their grey levels are stretched."""
LINE = 0.7
"""Brightness that a line of the ground grid leaves."""
FEWEST_CELLS = 20
"""From one grid line to the next: a line is one cell wide."""


def grain(dem: Dem) -> Array:
    """Brightness by the images, (rows, cols), 1 − GRAIN to 1; 1 everywhere where there are none."""
    seen = None if dem.texture is None else dem.texture[np.isfinite(dem.heights)]
    if dem.texture is None or seen is None or seen.min() == seen.max():
        return np.ones(dem.heights.shape)
    low, high = np.percentile(seen, STRETCHED)
    return 1.0 - GRAIN * (1.0 - np.clip((dem.texture - low) / max(high - low, 1.0), 0.0, 1.0))


def grid_spacing(resolution: float) -> float:
    """From one line of the ground grid to the next [m]: 1, or the first of 10, 100, … that is wide enough for cells."""
    return 10.0 ** max(0, int(np.ceil(np.log10(FEWEST_CELLS * resolution) - 1e-9)))


def grid_lines(cells: GridGeometry) -> NDArray[np.bool_]:
    """Cells on a line of the ground grid, (rows, cols): x or y, site frame, is a multiple of the spacing."""
    spacing = grid_spacing(cells.resolution)
    x, y = (np.floor(along / spacing) != np.floor((along - cells.resolution) / spacing) for along in _edges(cells))
    return x | y[:, None]


def darkened(rgb: NDArray[np.uint8], brightness: Array) -> NDArray[np.uint8]:
    """Colours (rows, cols, 3) at a brightness (rows, cols) of 0 to 1."""
    return np.rint(rgb * brightness[..., None]).astype(np.uint8)


def _edges(cells: GridGeometry) -> tuple[Array, Array]:
    """East and north edges of the cells."""
    return cells.xs + 0.5 * cells.resolution, cells.ys + 0.5 * cells.resolution
