"""Traversability as in Morphin: a plane is fitted in a window around every cell.

Slope is the tilt of the plane, roughness the RMS distance of the cells from it, step the largest less
the least height over it (exact, over every known cell of the window). *Goodness* takes the worst of the
three; *certainty* says how much of the window is known, and is kept apart, so that unknown ground never
looks bad or good.

References
----------
R. Simmons, E. Krotkov, L. Chrisman, F. Cozman, R. Goodwin, M. Hebert, L. Katragadda, S. Koenig,
G. Krishnaswamy, Y. Shinoda, W. Whittaker, P. Klarer, "Experience with rover navigation for lunar-like
terrains", IROS 1995.
S. Singh, R. Simmons, T. Smith, A. Stentz, V. Verma, A. Yahja, K. Schwehr, "Recent progress in local and
global traversability for planetary rovers", ICRA 2000.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Value, value
from footfall.maps.layers import MapSettings
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

LEAST_CERTAINTY = 0.25
"""With a smaller share of its window known, a cell's plane is unknown."""

LEAST_SPREAD = 0.25
"""Least standard deviation of the known cells in any direction, as a share of the full window's:
less is a strip narrower than a quarter of the window, which leaves the tilt across it open."""

WIDEST = 101
"""Largest window in cells; the exact step costs its square."""

_BLOCK = 64


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
    resolution = dem.geometry.resolution
    half = window_cells(settings.window, resolution) // 2
    known = np.isfinite(dem.heights)
    level = float(np.mean(dem.heights[known], dtype=np.float64))
    heights = np.where(known, dem.heights.astype(np.float64) - level, 0.0)
    gradient, center, variance, share, usable = _planes(heights, known, half)
    usable &= known
    progress(0.4, "planes fitted")
    step = _steps(heights, known, gradient, center, half, progress)
    slope = np.arctan(np.hypot(gradient[..., 0], gradient[..., 1]) / resolution)
    roughness = np.sqrt(np.maximum(variance, 0.0))
    goodness = 1.0 - np.maximum.reduce(
        [slope / settings.slope_limit, roughness / settings.roughness_limit, step / settings.step_limit]
    )
    goodness = np.clip(goodness, 0.0, 1.0)

    def layer(numbers: Array) -> NDArray[np.float32]:
        return np.where(usable, numbers, np.nan).astype(np.float32)

    return Traversability(
        slope=layer(slope),
        roughness=layer(roughness),
        step=layer(step),
        goodness=layer(goodness),
        certainty=share.astype(np.float32),
        gradient=np.where(usable[..., None], gradient / resolution, np.nan),
    )


def _planes(
    heights: Array, known: NDArray[np.bool_], half: int
) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    """Least-squares planes from windowed moments; lengths in cells, heights in metres.

    Returns gradient (…, 2) [m per cell], height over the window's centre, residual variance, share of
    known cells, and where the fit is determined. Offsets count from each window's own centre, so the
    moments stay exact however far the map lies from its origin.
    """
    offsets = np.arange(-half, half + 1, dtype=np.float64)
    powers = [np.ones_like(offsets), offsets, offsets**2]

    def north(field: Array, power: int) -> Array:
        return correlate1d(field, powers[power], axis=0, mode="constant")

    def east(field: Array, power: int) -> Array:
        return correlate1d(field, powers[power], axis=1, mode="constant")

    mask = known.astype(np.float64)
    mask_n = [north(mask, power) for power in range(3)]
    n, sx, sxx = (east(mask_n[0], power) for power in range(3))
    sy, sxy = (east(mask_n[1], power) for power in range(2))
    syy = east(mask_n[2], 0)
    heights_n = north(heights, 0)
    sz, sxz = (east(heights_n, power) for power in range(2))
    syz = east(north(heights, 1), 0)
    szz = east(north(heights**2, 0), 0)

    count = np.maximum(n, 1.0)
    cxx, cyy, cxy = sxx - sx * sx / count, syy - sy * sy / count, sxy - sx * sy / count
    cxz, cyz, czz = sxz - sx * sz / count, syz - sy * sz / count, szz - sz * sz / count
    narrow = (cxx + cyy) / 2 - np.hypot((cxx - cyy) / 2, cxy)
    full = float(np.mean(offsets**2))
    share = n / len(offsets) ** 2
    usable = (share >= LEAST_CERTAINTY) & (narrow / count >= LEAST_SPREAD**2 * full)
    determinant = np.where(usable, cxx * cyy - cxy * cxy, 1.0)
    a = np.where(usable, (cxz * cyy - cyz * cxy) / determinant, 0.0)
    b = np.where(usable, (cyz * cxx - cxz * cxy) / determinant, 0.0)
    center = (sz - a * sx - b * sy) / count
    variance = (czz - a * cxz - b * cyz) / count
    return np.stack([a, b], axis=-1), center, variance, share, usable


def _steps(
    heights: Array, known: NDArray[np.bool_], gradient: Array, center: Array, half: int, progress: Progress
) -> Array:
    """Largest less least residual in every window, visiting each of its cells once.

    float32 inside, on heights about the map's mean: exact to about 1e-6 of the map's relief.
    """
    rows, cols = heights.shape
    padded = np.pad(heights, half).astype(np.float32)
    seen = np.pad(known, half)
    above = np.where(seen, padded, np.float32(-np.inf))
    below = np.where(seen, padded, np.float32(np.inf))
    out = np.zeros((rows, cols))
    # blocks of rows stay in the processor's cache through the many passes
    for top in range(0, rows, _BLOCK):
        end = min(top + _BLOCK, rows)
        east = np.ascontiguousarray(gradient[top:end, :, 0], np.float32)
        north = np.ascontiguousarray(gradient[top:end, :, 1], np.float32)
        middle = center[top:end].astype(np.float32)
        highest = np.full(east.shape, -np.inf, np.float32)
        lowest = np.full(east.shape, np.inf, np.float32)
        residual = np.empty_like(east)
        plane = np.empty_like(east)
        for dy in range(-half, half + 1):
            np.multiply(north, np.float32(dy), out=plane)
            plane += middle
            plane -= half * east
            window = slice(top + half + dy, end + half + dy)
            for dx in range(2 * half + 1):
                np.subtract(above[window, dx : dx + cols], plane, out=residual)
                np.maximum(highest, residual, out=highest)
                np.subtract(below[window, dx : dx + cols], plane, out=residual)
                np.minimum(lowest, residual, out=lowest)
                plane += east
        seen_any = highest >= lowest
        out[top:end] = np.subtract(highest, lowest, out=np.zeros_like(highest), where=seen_any)
        progress(0.4 + 0.6 * end / rows, "steps measured")
    return out
