"""Questions to the surface of a Dem: its height, its normal, and where a ray meets it.

All of them speak of exactly the triangles of :mod:`footfall.terrain.ground.triangulate`. A known cell that no
fully known 2 × 2 block contains carries no surface and counts as unknown here.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.terrain.dem import Dem
from footfall.terrain.ground.height_kernel import EDGE, heights_at
from footfall.terrain.ground.normal_kernel import normals_of_discs


def height_at(dem: Dem, x: ArrayLike, y: ArrayLike) -> Array:
    """Height of the surface at places.

    Args:
        dem: the ground, in site.
        x: east, in site [m]; broadcast with y.
        y: north, in site [m].

    Returns:
        Heights (…) [m]; NaN off the map and where unknown.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    grid = dem.geometry
    u = (x.ravel() - grid.x0) / grid.resolution
    v = (y.ravel() - grid.y0) / grid.resolution
    return heights_at(dem.heights, u, v).reshape(x.shape)


def normal_at(dem: Dem, x: ArrayLike, y: ArrayLike, radius: float) -> Array:
    """Upward unit normal of the least-squares plane through the surface in a disc.

    The surface is sampled on a lattice about the centre, as fine as the grid and never coarser than a quarter of the
    radius, so coarse grids give the slope under the wheel too.

    Args:
        dem: the ground, in site.
        x: east, of the disc's centre in site [m]; broadcast with y.
        y: north, of the disc's centre in site [m].
        radius: of the disc, such as a wheel's [m].

    Returns:
        (…, 3); NaN where less than half of the disc is known, or what is known lies almost on a line.

    Raises:
        InvalidInput: the radius is not above zero.
    """
    if not 0 < radius < np.inf:
        raise InvalidInput(f"a normal needs a positive radius [m], not {radius}")
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    grid = dem.geometry
    corner, disc = (grid.x0, grid.y0, grid.resolution), _disc(float(radius), grid.resolution)
    return normals_of_discs(dem.heights, corner, (x.ravel(), y.ravel()), disc, float(radius)).reshape(*x.shape, 3)


@lru_cache(maxsize=16)
def _disc(radius: float, resolution: float) -> tuple[Array, Array]:
    """A lattice in the disc about the origin, (k,) each [m]."""
    steps = int(np.ceil(radius / min(resolution, radius / 4) - 1e-9))
    offset = np.arange(-steps, steps + 1, dtype=np.float64) * (radius / steps)
    dx, dy = np.tile(offset, len(offset)), np.repeat(offset, len(offset))
    in_disc = np.hypot(dx, dy) <= radius * (1 + 1e-9)
    return dx[in_disc], dy[in_disc]


def pick(dem: Dem, origin: ArrayLike, direction: ArrayLike) -> Array | None:
    """First point where a ray meets the surface, from above or below.

    Between its crossings of the triangles' edges the ray runs over one triangle, where its height above the surface is
    linear; the first change of sign is the hit.

    Args:
        dem: the ground, in site.
        origin: (3,) in site [m].
        direction: (3,), of any length.

    Returns:
        (3,) in site [m]; None where it misses.

    Raises:
        InvalidInput: the ray is not finite, or has no direction.
    """
    origin, direction = np.asarray(origin, float), np.asarray(direction, float)
    if origin.shape != (3,) or direction.shape != (3,) or not np.isfinite([origin, direction]).all():
        raise InvalidInput("a ray needs an origin and a direction of three finite numbers each")
    length = np.linalg.norm(direction)
    if length == 0:
        raise InvalidInput("a ray needs a direction that is not zero")
    direction = direction / length
    direction[np.abs(direction) < 1e-12] = 0.0
    times = _crossing_times(dem, origin, direction)
    if times is None:
        return None

    def above(t: Array) -> Array:
        p = origin + t[:, None] * direction
        return p[:, 2] - height_at(dem, p[:, 0], p[:, 1])

    gap = above(times)
    # two known ends say nothing about a hole between them
    over_ground = np.isfinite(above(0.5 * (times[:-1] + times[1:])))
    before, after = gap[:-1], gap[1:]
    with np.errstate(invalid="ignore"):
        hits = np.flatnonzero(over_ground & (before * after <= 0))
    if not len(hits):
        return None
    i = hits[0]
    step = before[i] - after[i]
    t = times[i] + (times[i + 1] - times[i]) * (before[i] / step if step else 0.0)
    return origin + t * direction


def _crossing_times(dem: Dem, origin: Array, direction: Array) -> Array | None:
    """Sorted ray parameters t ≥ 0 [m] at which a ray enters the map's box, crosses edges and leaves.

    None where it never is in the box, which is a metre higher and deeper than the ground.
    """
    grid = dem.geometry
    start = np.append((origin[:2] - (grid.x0, grid.y0)) / grid.resolution, origin[2])
    speed = np.append(direction[:2] / grid.resolution, direction[2])
    lowest = (-EDGE, -EDGE, float(np.nanmin(dem.heights)) - 1.0)
    highest = (grid.cols - 1 + EDGE, grid.rows - 1 + EDGE, float(np.nanmax(dem.heights)) + 1.0)
    enter, leave = 0.0, np.inf
    for position, rate, low, high in zip(start, speed, lowest, highest, strict=True):
        if rate == 0:
            if not low <= position <= high:
                return None
            continue
        near, far = sorted(((low - position) / rate, (high - position) / rate))
        enter, leave = max(enter, near), min(leave, far)
    if enter >= leave:
        return None
    times = [np.array([enter, leave])]
    # lines east = i, north = j, and the diagonals east − north = d
    for position, rate in ((start[0], speed[0]), (start[1], speed[1]), (start[0] - start[1], speed[0] - speed[1])):
        if rate != 0:
            first, last = sorted((position + rate * enter, position + rate * leave))
            times.append((np.arange(np.ceil(first), np.floor(last) + 1) - position) / rate)
    return np.unique(np.clip(np.concatenate(times), enter, leave))
