"""Where a ball that comes straight down meets the ground: a wheel's rim stands on the highest bump under it.

And how near it then is to touching the ground on another side too.
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.planning.compliance.ball_contact_kernel import stopped_at
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

COARSE = 12
"""The ground is looked at in at least so many steps from below the centre to the rim, at least once a cell."""
ROUNDS, FINER = 3, 4
"""Around the best place it is looked at so often again, each time in steps so many times finer."""
APART = np.radians(20.0)
"""Directions from the centre of a ball that are nearer to each other lead to one contact: on a plane, ground that far
from where it touches is 6 % of the radius away from the ball."""
KNOWN = 0.35
"""All ground nearer to the point below the centre than this share of the radius must be known."""


def ball_contacts(dem: Dem, centers: Array, radius: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Contacts of balls after they came down, or up, to the ground.

    Args:
        dem: the ground, in site.
        centers: of the balls, (k, 3) in site [m].
        radius: of the balls [m].

    Returns:
        Contacts (k, 3) [m], normals (k, 3), and whether the ground below their middles is known, (k,); where it is not,
        the other two are NaN.
    """
    steps = max(COARSE, int(np.ceil(radius / dem.geometry.resolution)))
    spacing = radius / steps
    grid = dem.geometry
    places, known = stopped_at(
        dem.heights,
        (grid.x0, grid.y0),
        grid.resolution,
        np.ascontiguousarray(centers, float),
        radius**2,
        steps,
        spacing,
        ROUNDS,
        FINER,
        KNOWN * radius,
    )
    down = np.sqrt(np.maximum(radius**2 - np.sum(places**2, axis=1), 0.0))
    points = np.full((len(centers), 3), np.nan)
    normals = np.full((len(centers), 3), np.nan)
    points[known, :2] = (centers[:, :2] + places)[known]
    points[known, 2] = height_at(dem, points[known, 0], points[known, 1])
    normals[known] = np.column_stack([-places, down])[known] / radius
    return points, normals, known


def second_gaps(dem: Dem, centers: Array, points: Array, radius: float) -> Array:
    """How much farther the ground is from balls on any other side than the one on which they touch it.

    Another side is seen from the centre more than APART away from the point. A ball may be off the ground, or in it, as
    a whole. Unknown ground is left out.

    Args:
        dem: the ground, in site.
        centers: of the balls, (k, 3) in site [m].
        points: near which they touch the ground, (k, 3) in site [m].
        radius: of the balls [m].

    Returns:
        (k,) [m]. Negative: it is nearer there, so that the ball can't stand where it is said to; infinite where no
        ground is known on one of the two.
    """
    steps = FINER * max(COARSE, int(np.ceil(radius / dem.geometry.resolution)))
    dx, dy = _square(steps, 1.2 * radius / steps)
    below = height_at(dem, centers[:, :1] + dx, centers[:, 1:2] + dy) - centers[:, 2:]
    away = np.sqrt(dx * dx + dy * dy + below * below)
    toward = (points - centers) / np.linalg.norm(points - centers, axis=1, keepdims=True)
    along = (toward[:, :1] * dx + toward[:, 1:2] * dy + toward[:, 2:] * below) / np.maximum(away, 1e-9)
    known, other = np.isfinite(away), along < np.cos(APART)
    own = np.min(np.where(known & ~other, away, np.inf), axis=1)
    return np.where(np.isfinite(own), np.min(np.where(known & other, away, np.inf), axis=1) - own, np.inf)


def _square(steps: int, spacing: float) -> tuple[Array, Array]:
    offsets = spacing * np.arange(-steps, steps + 1, dtype=float)
    dx, dy = np.meshgrid(offsets, offsets)
    return dx.ravel(), dy.ravel()
