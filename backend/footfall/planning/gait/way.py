"""The chassis' way in a gait: straight or on an arc, measured by the foot that goes farthest."""

import math

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.planning.walk.footprint import Footprint
from footfall.planning.walk.guide import Guide, guide
from footfall.terrain.dem import Dem

_CHORDS = 64
"""That an arc is made of."""


def way_to(dem: Dem, begin: Array, goal: Array, yaw: float | None, ease: Footprint, arc: bool) -> Guide:
    """A way of the chassis, straight or on an arc.

    How far along is how far the foot has gone that goes farthest, of feet that stay where the rover at ease has them:
    so a turn in place has a length.

    Args:
        dem: the ground without holes, in site.
        begin: x, y [m] and yaw [rad], (3,).
        goal: x, y, (2,) [m].
        yaw: there [rad]; None: as it comes.
        ease: where feet are at ease, and how high the chassis is over them.
        arc: whether the way is an arc.

    Returns:
        The way.

    Raises:
        InvalidInput: no arc of less than half a circle leads there, or it ends with another heading.
    """
    if arc:
        end, through = _arc(begin, goal, yaw)
        way = guide(dem, begin, end, ease, through)
    else:
        way = guide(dem, begin, np.array([*goal, begin[2] if yaw is None else yaw]), ease)
    feet = np.array([ease.at(x, y, heading) for x, y, heading in way.vectors[:, [0, 1, 5]]])
    gone = np.linalg.norm(np.diff(feet, axis=0), axis=2).max(axis=1)
    return Guide(way.vectors, np.concatenate([[0.0], np.cumsum(gone)]))


def corners_of(begin: Array, goal: Array, yaw: float | None, arc: bool) -> tuple[Array, Array]:
    """South-west and north-east corner, (2,) each [m], of the box that such a way lies in: an arc leaves its chord's.

    Args:
        begin: x, y [m] and yaw [rad], (3,).
        goal: x, y, (2,) [m].
        yaw: there [rad]; None: as it comes.
        arc: whether the way is an arc.

    Returns:
        The corners.

    Raises:
        InvalidInput: no arc of less than half a circle leads there, or it ends with another heading.
    """
    points = _arc(begin, goal, yaw)[1] if arc else np.array([begin[:2], goal])
    return points.min(axis=0), points.max(axis=0)


def _arc(begin: Array, goal: Array, yaw: float | None) -> tuple[Array, Array]:
    """The end (3,) of the arc that leaves along the heading, and points of it (n, 2).

    The chord of an arc turns half as far from the heading as the arc itself.
    """
    chord = goal - begin[:2]
    aside = math.remainder(math.atan2(chord[1], chord[0]) - begin[2], 2.0 * math.pi)
    if yaw is not None or not abs(aside) < 0.5 * math.pi or not chord.any():
        raise InvalidInput("an arc leads ahead, and ends with a heading of its own: give x and y of such a goal alone")
    share = np.linspace(0.0, 1.0, _CHORDS + 1)
    # points of a circle seen from one of them: as far away as the sine of the angle turned by half
    away = np.hypot(*chord) * (np.sin(share * aside) / np.sin(aside) if abs(aside) > 1e-9 else share)
    bearing = begin[2] + share * aside
    points = begin[:2] + away[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
    return np.array([*goal, begin[2] + 2.0 * aside]), points
