"""Traversability as in Morphin: a plane is fitted in a window around every cell.

Slope is the tilt of the plane, roughness the RMS distance of the cells from it, step the largest less
the least height over it (exact, over every known cell of the window). *Goodness* takes the worst of the
three; *certainty* says how much of the window is known, and is kept apart, so that unknown ground never
looks bad or good.

References:
----------
R. Simmons, E. Krotkov, L. Chrisman, F. Cozman, R. Goodwin, M. Hebert, L. Katragadda, S. Koenig,
G. Krishnaswamy, Y. Shinoda, W. Whittaker, P. Klarer, "Experience with rover navigation for lunar-like
terrains", IROS 1995.
S. Singh, R. Simmons, T. Smith, A. Stentz, V. Verma, A. Yahja, K. Schwehr, "Recent progress in local and
global traversability for planetary rovers", ICRA 2000.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Value, value
from footfall.maps.layers import MapSettings
from footfall.maps.plane_fit import TILE_COLS, TILE_ROWS, fit_tiles
from footfall.terrain.dem import Dem

LEAST_CERTAINTY = 0.25
"""With a smaller share of its window known, a cell's plane is unknown."""

LEAST_SPREAD = 0.25
"""Least standard deviation of the known cells in any direction, as a share of the full window's:
less is a strip narrower than a quarter of the window, which leaves the tilt across it open."""

WIDEST = 101
"""Largest window in cells; the exact step costs its square, and moments up to it are exact in float32."""

_TILES_AT_ONCE = (1 << 20) // (TILE_ROWS * TILE_COLS)
"""As many between two reports of progress: starting the threads is not free on a busy machine."""


@value
class Traversability(Value):
    """Layers (rows, cols); NaN = unknown, except certainty, which is always known.

    slope [rad], roughness [m], step [m], goodness 0…1, certainty 0…1: float32.
    gradient: rise to the east and to the north of the fitted plane, (rows, cols, 2) float64.
    """

    slope: NDArray[np.float32]
    roughness: NDArray[np.float32]
    step: NDArray[np.float32]
    goodness: NDArray[np.float32]
    certainty: NDArray[np.float32]
    gradient: NDArray[np.float64]


def window_cells(window: float, resolution: float) -> int:
    """Odd number of cells, at least three, across a window of ``window`` metres.

    Raises InvalidInput where that is more than WIDEST.
    """
    cells = 2 * round(window / resolution / 2) + 1
    if cells > WIDEST:
        raise InvalidInput(
            f"a window of {window:g} m is {cells} cells of {resolution:g} m; at most {WIDEST} are possible",
            window=window,
            resolution=resolution,
        )
    return max(cells, 3)


def traversability(dem: Dem, settings: MapSettings, progress: Progress = no_progress) -> Traversability:
    """Fit a plane in the window of every cell, holes and the map's edge left out as unknown.

    A cell is unknown where its own height is, or where its window holds too few cells, or cells that
    lie nearly on a line (LEAST_CERTAINTY, LEAST_SPREAD).
    """
    rows, cols = dem.geometry.shape
    slope, roughness, step, goodness, certainty = (np.empty((rows, cols), np.float32) for _ in range(5))
    layers = (slope, roughness, step, goodness, certainty, np.empty((rows, cols, 2)))
    return _fitted(dem, settings, np.argwhere(np.ones(_tiles_of(dem), bool)), layers, progress)


def updated_traversability(
    dem: Dem, settings: MapSettings, before: Traversability, seen: NDArray[np.float32], progress: Progress = no_progress
) -> Traversability:
    """Fit the planes of a newer map with the same cells again, only in tiles within a window of what changed.

    Args:
        dem: the newer map.
        settings: those that ``before`` was made with.
        before: of the older map.
        seen: heights of the older map, (rows, cols) [m].
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        What ``traversability`` says of the newer map, to the digest; that is asked where the shapes differ.
    """
    if seen.shape != dem.heights.shape:
        return traversability(dem, settings, progress)
    half = window_cells(settings.window, dem.geometry.resolution) // 2
    changed = ~((dem.heights == seen) | (np.isnan(dem.heights) & np.isnan(seen)))
    near = np.zeros(_tiles_of(dem), bool)
    rows, cols = np.nonzero(changed)
    # no two steps on are farther apart than a tile, so none is skipped
    for down in (*range(-half, half, TILE_ROWS), half):
        for across in (*range(-half, half, TILE_COLS), half):
            at = np.clip(rows + down, 0, dem.geometry.rows - 1), np.clip(cols + across, 0, dem.geometry.cols - 1)
            near[at[0] // TILE_ROWS, at[1] // TILE_COLS] = True
    layers = (before.slope, before.roughness, before.step, before.goodness, before.certainty, before.gradient)
    return _fitted(dem, settings, np.argwhere(near), tuple(layer.copy() for layer in layers), progress)


def _tiles_of(dem: Dem) -> tuple[int, int]:
    """How many tiles there are down and across."""
    rows, cols = dem.geometry.shape
    return -(-rows // TILE_ROWS), -(-cols // TILE_COLS)


def _fitted(
    dem: Dem,
    settings: MapSettings,
    tiles: NDArray[np.int64],
    layers: tuple[NDArray[Any], ...],
    progress: Progress,
) -> Traversability:
    """Fits the tiles, (n, 2) by number down and across, into layers in the order of Traversability's."""
    resolution = dem.geometry.resolution
    half = window_cells(settings.window, resolution) // 2
    least = (LEAST_CERTAINTY, LEAST_SPREAD)
    limits = (settings.slope_limit, settings.roughness_limit, settings.step_limit)
    corners = tiles * np.array([TILE_ROWS, TILE_COLS])
    for first in range(0, len(tiles), _TILES_AT_ONCE):
        some = corners[first : first + _TILES_AT_ONCE]
        fit_tiles(dem.heights, some, half, resolution, least, limits, layers)
        progress((first + len(some)) / len(tiles), "planes fitted")
    for layer in layers:
        # nothing else holds them, so the value need not copy them
        layer.setflags(write=False)
    return Traversability(*layers)
