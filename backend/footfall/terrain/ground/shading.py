"""How light falls on the ground: which way it faces, and how much of the sky its hollows see.

For pictures alone; nothing is decided by it. No frame of the rover says where the sun stands, so the light is an
assumed one, from the north-west, as maps are drawn: lit from elsewhere, hills are taken for hollows (E. Imhof,
Cartographic Relief Presentation, 1982).
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.terrain.dem import Dem

AZIMUTH, ELEVATION = np.deg2rad(315.0), np.deg2rad(50.0)
"""Of the assumed light [rad]: clockwise from north (y), and over the horizon."""
LIGHT = np.array([np.sin(AZIMUTH) * np.cos(ELEVATION), np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)])
"""Unit vector toward the assumed light, site frame."""
LEVEL = 0.9
"""Brightness of level open ground: what faces the light is up to 1."""
DARKEST = 0.4
"""Least brightness: colours must still be told apart in the deepest hollow."""
NEAR, FAR = 0.05, 1.0
"""Between which distances the ground around may hide the sky [m]."""
GROWTH = 1.5
"""Each distance that is looked at is so many times the one before."""
_AROUND = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))


def relief(dem: Dem) -> Array:
    """Brightness of each cell, (rows, cols), DARKEST to 1; LEVEL where it is level and open."""
    return np.clip(LEVEL * facing(dem) * sky_seen(dem), DARKEST, 1.0)


def facing(dem: Dem, light: Array = LIGHT) -> Array:
    """How much light a cell takes beside level ground, (rows, cols), 0 and more: Lambert's cosine law.

    light: unit vector toward it, site frame (3,). Next to unknown cells the slope is that of the known side.
    """
    slope_y, slope_x = (_slope(dem.heights, axis) / dem.geometry.resolution for axis in (0, 1))
    cosine = (light[2] - light[0] * slope_x - light[1] * slope_y) / np.sqrt(1 + slope_x**2 + slope_y**2)
    return np.maximum(cosine, 0.0) / light[2]


def sky_seen(dem: Dem) -> Array:
    """Share of an even sky that the ground around leaves to a cell, (rows, cols), 1 in the open: ambient occlusion.

    The mean over eight directions of cos² of the horizon's elevation (T. Oke, Boundary Layer Climates, 1987). Unknown
    cells hide nothing.
    """
    heights, resolution = dem.heights, dem.geometry.resolution
    seen = np.zeros(heights.shape)
    for row, col in _AROUND:
        steep = np.zeros(heights.shape, np.float32)
        stride = resolution * float(np.hypot(row, col))
        for cells in _distances(stride):
            here, there = _shifted(heights.shape, cells * row, cells * col)
            away = np.float32(cells * stride)
            steep[here] = np.fmax(steep[here], (heights[there] - heights[here]) / away)
        seen += 1.0 / (1.0 + steep.astype(np.float64) ** 2)
    return seen / len(_AROUND)


def _slope(heights: NDArray[np.float32], axis: int) -> Array:
    """Rise from cell to cell along an axis [m]: the mean of both sides, of one where the other is unknown, else 0."""
    edge = np.full_like(heights.take([0], axis), np.nan)
    rise = np.diff(heights.astype(np.float64), axis=axis)
    sides = np.stack([np.concatenate(pair, axis) for pair in ((edge, rise), (rise, edge))])
    return np.nansum(sides, axis=0) / np.maximum(np.isfinite(sides).sum(axis=0), 1)


def _distances(stride: float) -> list[int]:
    """From NEAR to FAR, in strides of that length [m]; one at least."""
    count = int(np.log(FAR / NEAR) / np.log(GROWTH)) + 1
    return sorted({max(1, round(NEAR * GROWTH**i / stride)) for i in range(count)})


def _shifted(shape: tuple[int, ...], rows: int, cols: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """The cells that have a neighbour so many cells away, and those neighbours."""
    spans = [(_span(size, by), _span(size, -by)) for size, by in zip(shape, (rows, cols), strict=True)]
    return (spans[0][0], spans[1][0]), (spans[0][1], spans[1][1])


def _span(size: int, by: int) -> slice:
    return slice(min(max(-by, 0), size), max(min(size - by, size), 0))
