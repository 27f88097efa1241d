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

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Value, value
from footfall.maps.layers import MapSettings
from footfall.maps.plane_fit import TILE_ROWS, fit_rows
from footfall.terrain.dem import Dem

LEAST_CERTAINTY = 0.25
"""With a smaller share of its window known, a cell's plane is unknown."""

LEAST_SPREAD = 0.25
"""Least standard deviation of the known cells in any direction, as a share of the full window's:
less is a strip narrower than a quarter of the window, which leaves the tilt across it open."""

WIDEST = 101
"""Largest window in cells; the exact step costs its square, and moments up to it are exact in float32."""

_CELLS_AT_ONCE = 1 << 20
"""About as many between two reports of progress: starting the threads is not free on a busy machine."""


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
    resolution, (rows, cols) = dem.geometry.resolution, dem.geometry.shape
    half = window_cells(settings.window, resolution) // 2
    least = (LEAST_CERTAINTY, LEAST_SPREAD)
    limits = (settings.slope_limit, settings.roughness_limit, settings.step_limit)
    slope, roughness, step, goodness, certainty = (np.empty((rows, cols), np.float32) for _ in range(5))
    layers = (slope, roughness, step, goodness, certainty, np.empty((rows, cols, 2)))
    rows_at_once = TILE_ROWS * max(1, _CELLS_AT_ONCE // cols // TILE_ROWS)
    for first in range(0, rows, rows_at_once):
        last = min(first + rows_at_once, rows)
        fit_rows(dem.heights, first, last, half, resolution, least, limits, layers)
        progress(last / rows, "planes fitted")
    for layer in layers:
        # nothing else holds them, so the value need not copy them
        layer.setflags(write=False)
    return Traversability(*layers)
