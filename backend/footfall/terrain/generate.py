"""Made terrain for demos and tests: plane, slope, step, fractal. Rocks are in :mod:`footfall.terrain.rocks`.

Every map is centred on (0, 0). ``size`` is its extent between the outermost cell centres [m]: one
number, or (east, north); it is rounded to whole cells. Equal arguments give equal maps.
"""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_cell_count, from_heights
from footfall.terrain.rocks import add_rocks, draw_rocks

Size = float | tuple[float, float]


def plane(size: Size = 20.0, resolution: float = 0.1, height: float = 0.0) -> Dem:
    """Level ground.

    Args:
        size: side, or (east, north) sides, of the map [m].
        resolution: side of the cells [m].
        height: of the ground [m].

    Returns:
        The ground.
    """
    east, _ = _centers(size, resolution)
    return _centered(np.full(east.shape, float(height)), resolution, "plane")


def slope(size: Size = 20.0, resolution: float = 0.1, angle: float = 0.2, uphill: float = 0.0) -> Dem:
    """Tilted ground through (0, 0, 0).

    Args:
        size: side, or (east, north) sides, of the map [m].
        resolution: side of the cells [m].
        angle: of the rise [rad].
        uphill: azimuth of the rise from x [rad].

    Returns:
        The ground.

    Raises:
        InvalidTerrain: the angle is not within ±π/2.
    """
    if not abs(angle) < np.pi / 2:
        raise InvalidTerrain(f"a slope needs an angle within ±π/2, not {angle}")
    east, north = _centers(size, resolution)
    return _centered(np.tan(angle) * (np.cos(uphill) * east + np.sin(uphill) * north), resolution, "slope")


def step(size: Size = 20.0, resolution: float = 0.1, height: float = 0.3, edge: float = 0.0) -> Dem:
    """Level ground at 0 with one step up; the riser is one cell wide.

    Args:
        size: side, or (east, north) sides, of the map [m].
        resolution: side of the cells [m].
        height: of the ground beyond the step [m].
        edge: x from which on it is raised [m].

    Returns:
        The ground.
    """
    east, _ = _centers(size, resolution)
    return _centered(np.where(east >= edge - 1e-9, float(height), 0.0), resolution, "step")


def fractal(
    size: Size = 20.0, resolution: float = 0.1, roughness: float = 0.3, hurst: float = 0.8, seed: int = 0
) -> Dem:
    """Fractional Brownian ground with zero mean, by spectral synthesis.

    The amplitude of white noise is shaped as frequency^−(hurst + 1), so that the mean squared height difference over a
    distance d grows as d^(2·hurst): Voss (1985), Saupe in *The Science of Fractal Images* (1988), §2.3. A quarter of a
    twice larger, periodic map is kept, so edges don't match up.

    Args:
        size: side, or (east, north) sides, of the map [m].
        resolution: side of the cells [m].
        roughness: standard deviation of the heights [m].
        hurst: 0 (jagged) … 1 (smooth).
        seed: of the noise.

    Returns:
        The ground.

    Raises:
        InvalidTerrain: hurst or roughness is out of range.
    """
    if not (0 < hurst < 1 and roughness >= 0):
        raise InvalidTerrain(f"fractal ground needs 0 < hurst < 1 and roughness ≥ 0, not {hurst} and {roughness}")
    east, _ = _centers(size, resolution)
    rows, cols = east.shape
    side = 2 * max(rows, cols)
    noise = np.random.default_rng(seed).standard_normal((side, side))
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    frequency[0, 0] = np.inf
    heights = np.fft.irfft2(np.fft.rfft2(noise) * frequency ** -(hurst + 1), s=(side, side))[:rows, :cols]
    heights -= heights.mean()
    spread = heights.std()
    if spread > 0:
        heights *= roughness / spread
    return _centered(heights, resolution, "fractal", seed)


def rock_field(
    size: Size = 20.0,
    resolution: float = 0.05,
    abundance: float = 0.1,
    smallest: float = 0.1,
    largest: float = 2.0,
    seed: int = 0,
) -> Dem:
    """Level ground strewn with rocks of the size–frequency distribution of Golombek & Rapp (1997).

    See :func:`footfall.terrain.rocks.draw_rocks`.

    Args:
        size: side, or (east, north) sides, of the map [m].
        resolution: side of the cells [m].
        abundance: share k of the ground that rocks of all sizes cover.
        smallest: diameter that is drawn [m].
        largest: diameter that is drawn [m].
        seed: of what is drawn.

    Returns:
        The ground.
    """
    level = plane(size, resolution)
    west, south, east, north = level.geometry.bounds
    half = 0.5 * resolution
    bounds = (west - half, south - half, east + half, north + half)
    rocks = draw_rocks(bounds, abundance, smallest, largest, np.random.default_rng(seed))
    strewn = add_rocks(level, rocks)
    return from_heights(
        strewn.heights,
        resolution,
        west,
        south,
        "rock field",
        provenance=Provenance(parents={}, seed=seed),
    )


def _centers(size: Size, resolution: float) -> tuple[Array, Array]:
    """Eastings and northings (rows, cols) of the cell centres."""
    width, depth = size if isinstance(size, (tuple, list)) else (size, size)
    if not (0 < resolution < np.inf and 0 < width < np.inf and 0 < depth < np.inf):
        raise InvalidTerrain(f"a terrain needs a positive size and resolution [m], not {size} and {resolution}")
    rows, cols = round(depth / resolution) + 1, round(width / resolution) + 1
    check_cell_count(rows, cols)
    east, north = ((np.arange(n, dtype=np.float64) - (n - 1) / 2) * resolution for n in (cols, rows))
    return np.broadcast_to(east, (rows, cols)), np.broadcast_to(north[:, None], (rows, cols))


def _centered(heights: Array, resolution: float, name: str, seed: int | None = None) -> Dem:
    rows, cols = heights.shape
    return from_heights(
        heights,
        resolution,
        -(cols - 1) / 2 * resolution,
        -(rows - 1) / 2 * resolution,
        name,
        provenance=Provenance(parents={}, seed=seed),
    )
