"""A grid laid over the ground."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

STEP = 0.04
"""Points of a line lie this far apart, or a cell where that is more [m]."""


def draped_grid(dem: Dem, center: ArrayLike, reach: float, spacing: float = 0.5) -> list[NDArray[np.float64]]:
    """Lines on the ground at whole multiples of a spacing, east and north.

    Args:
        dem: the ground, in site.
        center: (2,) around which lines go, in site [m].
        reach: how far they go to both sides, but no further than the map [m].
        spacing: between neighbouring lines [m].

    Returns:
        Lines (n, 3) in site [m]; NaN where unknown.

    Raises:
        InvalidInput: the spacing or the reach is not above zero.
    """
    if not (spacing > 0 and 0 < reach < np.inf):
        raise InvalidInput("a grid needs a spacing and a reach above zero [m]", spacing=spacing, reach=reach)
    west, south, east, north = dem.geometry.bounds
    x, y = (float(one) for one in np.asarray(center, float)[:2])
    across = _multiples(max(west, x - reach), min(east, x + reach), spacing)
    along = _multiples(max(south, y - reach), min(north, y + reach), spacing)
    step = max(STEP, dem.geometry.resolution)
    xs, ys = (
        np.arange(max(low, middle - reach), min(high, middle + reach), step)
        for low, high, middle in ((west, east, x), (south, north, y))
    )
    lines = [(np.full(len(ys), one), ys) for one in across] + [(xs, np.full(len(xs), one)) for one in along]
    return [np.column_stack([a, b, height_at(dem, a, b)]) for a, b in lines if len(a) > 1]


def _multiples(low: float, high: float, spacing: float) -> NDArray[np.float64]:
    return spacing * np.arange(np.ceil(low / spacing), np.floor(high / spacing) + 1)
