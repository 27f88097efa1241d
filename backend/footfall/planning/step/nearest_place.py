"""Where a step that unknown ground refuses could go instead: the nearest place whose ground passes the same check.

A hole is not judged by guess, however small it is. What is offered passes the check that refused; whether the leg gets
there only a plan can tell, unless maps said so.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.problem import NearestPlace
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem

Place = tuple[float, float]

FARTHEST = 2.0
"""Places farther away than this are no place beside the one that was asked for [m]."""
MOST_LOOKS = 400
"""Places that are looked at, nearest first."""
_WINDS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


def nearest_place(robot: Robot, dem: Dem, x: float, y: float, green: Sequence[Place] = ()) -> NearestPlace | None:
    """The nearest good place to a place.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, in site [m].
        y: north, in site [m].
        green: places (x, y) that maps say are good, nearest first [m]: the first whose ground passes is taken. Where
            none does, the middle of a cell of known ground is.

    Returns:
        That place; None where there is none near.
    """
    for of, places in (("maps", iter(green)), ("ground", _known(dem, x, y, robot.wheel_radius))):
        for _, place in zip(range(MOST_LOOKS), places, strict=False):
            if isinstance(footfall_contact(robot, dem, *place), Contact):
                return NearestPlace(*place, math.hypot(place[0] - x, place[1] - y), of)
    return None


def place_in_words(x: float, y: float, found: NearestPlace) -> str:
    """How far, which way and where a place is, for a sentence.

    Args:
        x: east, of where one looks from in site [m].
        y: north, of where one looks from in site [m].
        found: the place.

    Returns:
        The words.
    """
    wind = _WINDS[round(math.atan2(found.y - y, found.x - x) / (math.pi / 4)) % 8]
    good = "green in the maps" if found.of == "maps" else "known ground"
    return f"the nearest good place ({good}) is {found.away:z.3f} m to the {wind}, at ({found.x:z.3f}, {found.y:z.3f})"


def _known(dem: Dem, x: float, y: float, radius: float) -> Iterator[Place]:
    """Middles of cells around which a disc of a wheel's radius may be known, nearest first."""
    grid, reach = dem.geometry, FARTHEST + radius
    cols, rows = _around(grid.xs, x, reach), _around(grid.ys, y, reach)
    known = np.isfinite(dem.heights[rows, cols])
    if not known.any():
        return
    # what is off the map is as unknown as a hole
    to_unknown = np.asarray(distance_transform_edt(np.pad(known, 1)))[1:-1, 1:-1] * grid.resolution
    found_rows, found_cols = np.nonzero(to_unknown > radius)
    xs, ys = grid.xs[cols][found_cols], grid.ys[rows][found_rows]
    away = np.hypot(xs - x, ys - y)
    for i in np.argsort(away, kind="stable"):
        if away[i] > FARTHEST:
            return
        yield float(xs[i]), float(ys[i])


def _around(centers: NDArray[np.float64], middle: float, reach: float) -> slice:
    within = np.flatnonzero(np.abs(centers - middle) <= reach)
    return slice(int(within[0]), int(within[-1]) + 1) if within.size else slice(0, 0)
