"""Rocks on terrain: drawn with the sizes found at landing sites, and stamped onto a map."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem

HEIGHT_PER_DIAMETER = 0.5
"""Assumed: rocks stand about half as high as they are wide."""

MAX_ROCKS = 1_000_000

_TABLE = 4096


def covered_fraction(diameter: ArrayLike, abundance: float) -> Array:
    """Share of the ground under rocks at least ``diameter`` [m] wide: F_k(D) = k exp(−q(k) D).

    q(k) = 1.79 + 0.152 / k. Golombek & Rapp, "Size-frequency distributions of rocks on Mars and Earth
    analog sites", J. Geophys. Res. 102 (E2), 1997.
    """
    return abundance * np.exp(-_decay(abundance) * np.asarray(diameter, float))


def rocks_per_area(smallest: float, largest: float, abundance: float) -> float:
    """Expected number of rocks of some sizes.

    Args:
        smallest: diameter [m].
        largest: diameter [m].
        abundance: share of the ground that rocks of all sizes cover.

    Returns:
        Rocks per m².
    """
    return float(_cumulative(smallest, largest, abundance)[1][-1])


def draw_rocks(
    bounds: tuple[float, float, float, float],
    abundance: float,
    smallest: float,
    largest: float,
    rng: np.random.Generator,
) -> Array:
    """Draw rocks, their centres uniform in a rectangle.

    Their number is Poisson-distributed; sizes follow :func:`covered_fraction`.

    Args:
        bounds: west, south, east, north [m].
        abundance: share of the ground that rocks of all sizes cover.
        smallest: diameter [m].
        largest: diameter [m].
        rng: what draws.

    Returns:
        Rocks (n, 4) as x, y, diameter, height [m].

    Raises:
        InvalidTerrain: the sizes or the abundance are impossible, or more than MAX_ROCKS rocks are expected.
    """
    if not 0 < abundance < 1:
        raise InvalidTerrain(f"a rock abundance is a share between 0 and 1, not {abundance}")
    if not 0 < smallest < largest < np.inf:
        raise InvalidTerrain(f"rocks need diameters 0 < smallest < largest, not {smallest} and {largest}")
    west, south, east, north = bounds
    diameters, cumulative = _cumulative(smallest, largest, abundance)
    expected = cumulative[-1] * (east - west) * (north - south)
    if expected > MAX_ROCKS:
        raise InvalidTerrain(
            f"{expected:z.0f} rocks are more than {MAX_ROCKS}; raise the smallest diameter", limit=MAX_ROCKS
        )
    count = rng.poisson(expected)
    diameter = np.interp(rng.uniform(0.0, cumulative[-1], count), cumulative, diameters)
    x, y = rng.uniform(west, east, count), rng.uniform(south, north, count)
    return np.column_stack([x, y, diameter, HEIGHT_PER_DIAMETER * diameter])


def add_rocks(dem: Dem, rocks: ArrayLike) -> Dem:
    """The map with rocks (n, 4) as x, y, diameter, height [m]: half ellipsoids standing on the ground.

    Where rocks overlap, the higher one shows. Unknown cells stay unknown.
    """
    rocks = np.asarray(rocks, float).reshape(-1, 4)
    if not (np.isfinite(rocks).all() and (rocks[:, 2:] > 0).all()):
        raise InvalidTerrain("rocks need finite x, y and positive diameter and height [m]")
    grid = dem.geometry
    rise = np.zeros(grid.shape)
    xs, ys = grid.xs, grid.ys
    for x, y, diameter, height in rocks:
        cols = slice(*np.searchsorted(xs, (x - diameter / 2, x + diameter / 2)))
        rows = slice(*np.searchsorted(ys, (y - diameter / 2, y + diameter / 2)))
        squared = ((xs[None, cols] - x) ** 2 + (ys[rows, None] - y) ** 2) / (diameter / 2) ** 2
        rise[rows, cols] = np.maximum(rise[rows, cols], height * np.sqrt(np.maximum(1.0 - squared, 0.0)))
    heights = (dem.heights + rise).astype(np.float32)
    return Dem(heights, grid, f"{dem.name} with rocks", Provenance(parents={"dem": dem.digest}), dem.texture)


def _decay(abundance: float) -> float:
    return 1.79 + 0.152 / abundance


def _cumulative(smallest: float, largest: float, abundance: float) -> tuple[Array, Array]:
    """Diameters, and rocks per m² from ``smallest`` up to each.

    Rocks of diameter D cover πD²/4 each, so their number density is −(dF_k/dD) / (πD²/4).
    """
    diameters = np.geomspace(smallest, largest, _TABLE)
    decay = _decay(abundance)
    density = decay * covered_fraction(diameters, abundance) / (np.pi / 4 * diameters**2)
    pieces = 0.5 * (density[1:] + density[:-1]) * np.diff(diameters)
    return diameters, np.concatenate([[0.0], np.cumsum(pieces)])
