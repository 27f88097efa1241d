"""How fast rows of set points are gone through, and how long is waited after them."""

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.execution.problem import ends_of
from footfall.robot.model import Robot

SWAY = 0.7
"""Half the period in which the chassis sways after a stop [s]: 1.2 to 1.5 s, mostly about the vertical."""
GENTLE = 0.05
"""Speed of the wheel where it is lowered towards the ground [m/s]."""
NOTHING_GUARDED = slice(0, 0)


def durations(
    robot: Robot,
    commanded: Array,
    phases: tuple[str, ...],
    fraction: float,
    guarded: slice = NOTHING_GUARDED,
    least: float = 0.0,
) -> Array:
    """How long each motion takes at a share of the speed limits, with two exceptions.

    The last SWAY seconds of each phase go at half speed: a stop in two halves, half a period of the chassis' sway
    apart, leaves it still, as the second sway cancels the first (Singer & Seering 1990). And the rows ``guarded`` take
    their time, so that lowering stops close to where the ground was met.

    Args:
        robot: the rover.
        commanded: set points, (n, legs × 6) [rad].
        phases: (n,) the one whose motion ends at each.
        fraction: share of the joints' speed limits.
        guarded: rows that are lowered with guard.
        least: each of those takes at least [s].

    Returns:
        Seconds to each waypoint, (n,); 0 to the first.
    """
    travel = np.abs(np.diff(commanded, axis=0)) / (fraction * robot.speed_limits)
    out = np.append(0.0, travel.max(axis=1))
    out[guarded] = np.maximum(out[guarded], least)
    ends = [i for i in ends_of(phases) if not guarded.start <= i < guarded.stop]
    for end in ends:
        slow, row = 0.0, end
        while row > 0 and phases[row] == phases[end] and slow < SWAY:
            out[row] *= 2
            slow += out[row]
            row -= 1
    return out


def pauses(phases: tuple[str, ...], pause: float) -> Array:
    """Seconds to wait after each waypoint: at the end of each phase."""
    out = np.zeros(len(phases))
    out[ends_of(phases)] = pause
    return out
