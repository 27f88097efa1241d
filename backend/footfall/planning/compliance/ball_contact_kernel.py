"""Where a ball that comes straight down meets the ground: compiled."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.terrain.ground.height_kernel import height_in_cells


@njit()
def stopped_at(
    heights: NDArray[np.float32],
    corner: tuple[float, float],
    resolution: float,
    centers: Array,
    square: float,
    steps: int,
    spacing: float,
    rounds: int,
    finer: int,
    known_within: float,
) -> tuple[Array, NDArray[np.bool_]]:
    """Offsets (k, 2) [m] from the middles of balls, centers (k, 3), to where the ground stops them first.

    … and whether all ground nearer than ``known_within`` to the point below each middle is known, (k,).
    heights: of the map; corner: x, y of the middle of its first cell; square: of the radius [m²]. The ground is looked
    at every ``spacing``, up to ``steps`` of them to each side, then ``rounds`` times around the best, each time
    ``finer`` times as finely.
    """
    places, known = np.zeros((len(centers), 2)), np.ones(len(centers), np.bool_)
    for k in range(len(centers)):
        count, step = steps, spacing
        for turn in range(rounds + 1):
            if turn > 0:
                count, step = finer, step / finer
            x, y = centers[k, 0] + places[k, 0], centers[k, 1] + places[k, 1]
            best, best_x, best_y = -np.inf, places[k, 0] - step * count, places[k, 1] - step * count
            for j in range(-count, count + 1):
                for i in range(-count, count + 1):
                    dx, dy = step * i, step * j
                    away_x, away_y = places[k, 0] + dx, places[k, 1] + dy
                    room = square - away_x * away_x - away_y * away_y
                    below = turn == 0 and np.hypot(dx, dy) <= known_within
                    if not (below or room > 0.0):
                        continue
                    height = height_in_cells(
                        heights, (x + dx - corner[0]) / resolution, (y + dy - corner[1]) / resolution
                    )
                    if np.isnan(height):
                        known[k] = known[k] and not below
                    elif room > 0.0 and height + np.sqrt(room) > best:
                        best, best_x, best_y = height + np.sqrt(room), away_x, away_y
            places[k] = best_x, best_y
    return places, known
