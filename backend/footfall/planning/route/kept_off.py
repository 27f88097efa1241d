"""How far places lie where the operator keeps the chassis off: inside a no-go area, or beside all corridors."""

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.route.problem import Corridor, RouteSettings

LOOKED_AT = 0.05
"""A straight way is looked at in places so far apart [m]."""


def kept_off(places: Array, settings: RouteSettings) -> Array:
    """How deep places (n, 2) [m] lie in no-go areas, or outside of all corridors: (n,) [m], 0 where in neither."""
    deepest = np.zeros(len(places))
    for area in settings.no_go:
        deepest = np.maximum(deepest, area.radius - np.hypot(*(places - (area.x, area.y)).T))
    if settings.corridors:
        deepest = np.maximum(deepest, outside(places, settings.corridors))
    return deepest


def kept_off_between(begin: Array, ends: Array, settings: RouteSettings) -> Array:
    """How deep straight ways come in such ground.

    Args:
        begin: where they begin, (2,) [m].
        ends: where they end, (n, 2) [m].
        settings: of the route.

    Returns:
        (n,) [m], 0 where they do not.
    """
    found = np.zeros(len(ends))
    for number, end in enumerate(ends):
        count = 2 + int(np.linalg.norm(end - begin) / LOOKED_AT)
        found[number] = kept_off(np.linspace(begin, end, count), settings).max()
    return found


def outside(places: Array, corridors: tuple[Corridor, ...]) -> Array:
    """How far places (n, 2) [m] are from the nearest edge of one or more corridors: (n,) [m], below 0 inside one."""
    nearest = np.full(len(places), np.inf)
    for one in corridors:
        begin, along = np.array([one.x, one.y]), np.array([one.to_x - one.x, one.to_y - one.y])
        share = np.clip((places - begin) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(places - begin - share[:, None] * along).T) - one.beside)
    return nearest
