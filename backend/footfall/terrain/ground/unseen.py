"""Ground that nobody saw, taken for what it may be: a collision check must not find it free.

Unknown cells near the leg are filled, each as high as its highest known neighbour, ring by ring, and so is everything
beyond the map's edge. Where a wheel stands the ground is known to be no higher than the wheel.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem

FOOT_DISC = 0.15
"""Radius around a standing wheel's contact in which unknown cells take the contact's height [m]."""


@dataclass(frozen=True)
class Whole:
    """dem: a crop with every cell filled. filled: (rows, cols), the cells that were unknown."""

    dem: Dem
    filled: NDArray[np.bool_]


def without_holes(dem: Dem, center_xy: Array, radius: float, contacts: Array) -> Whole | None:
    """The ground around a place with its holes filled.

    Args:
        dem: the ground, in site.
        center_xy: (2,) in site [m].
        radius: how far around [m].
        contacts: (k, 3) where wheels stand, in site [m].

    Returns:
        That ground, and which cells were filled; None where nothing is known there.
    """
    return without_holes_between(dem, center_xy - radius, center_xy + radius, contacts)


def without_holes_between(dem: Dem, low_xy: Array, high_xy: Array, contacts: Array) -> Whole | None:
    """The ground between two corners with its holes filled.

    Args:
        dem: the ground, in site.
        low_xy: south-west corner, (2,) in site [m].
        high_xy: north-east corner, (2,) in site [m].
        contacts: (k, 3) where wheels stand, in site [m].

    Returns:
        That ground, and which cells were filled; None where nothing is known there.
    """
    grid = dem.geometry
    low = np.floor((low_xy - (grid.x0, grid.y0)) / grid.resolution).astype(int)
    high = np.ceil((high_xy - (grid.x0, grid.y0)) / grid.resolution).astype(int) + 1
    heights = np.full((high[1] - low[1], high[0] - low[0]), np.nan, np.float32)
    rows, cols = slice(max(low[1], 0), min(high[1], grid.rows)), slice(max(low[0], 0), min(high[0], grid.cols))
    if rows.start < rows.stop and cols.start < cols.stop:
        heights[rows.start - low[1] : rows.stop - low[1], cols.start - low[0] : cols.stop - low[0]] = dem.heights[
            rows, cols
        ]
    geometry = GridGeometry(
        grid.x0 + float(low[0]) * grid.resolution,
        grid.y0 + float(low[1]) * grid.resolution,
        grid.resolution,
        *heights.shape,
    )
    unknown = np.isnan(heights)
    if unknown.any():
        _put_contacts(heights, unknown, geometry, contacts)
        if np.isnan(heights).all():
            return None
        _fill(heights)
    return Whole(Dem(heights, geometry, dem.name, Provenance({})), unknown)


def filled(heights: NDArray[np.float32]) -> NDArray[np.float32]:
    """The heights (rows, cols), each unknown one as high as its highest known neighbour; one at least is known."""
    out = heights.copy()
    _fill(out)
    return out


def _put_contacts(heights: NDArray, unknown: NDArray, geometry: GridGeometry, contacts: Array) -> None:
    for contact in contacts:
        near = np.hypot(geometry.xs - contact[0], (geometry.ys - contact[1])[:, None]) <= FOOT_DISC
        heights[near & unknown] = contact[2]


def _fill(heights: NDArray[np.float32]) -> None:
    """Fill NaN ring by ring with the highest of the eight neighbours known so far, in place."""
    missing = np.isnan(heights)
    neighbours = np.ones((3, 3), np.uint8)
    while missing.any():
        known = np.where(missing, np.float32(-np.inf), heights)
        # replicated: a border of OpenCV's default is the lowest finite number, which would count as known
        highest = cv2.dilate(known, neighbours, borderType=cv2.BORDER_REPLICATE)
        ring = missing & np.isfinite(highest)
        heights[ring] = highest[ring]
        missing &= ~ring
