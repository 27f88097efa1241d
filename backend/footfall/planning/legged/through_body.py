"""The way of a foot that passes through the body: around its own stack, on the side of the other one."""

from collections.abc import Iterator

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.foot_move import FootLine, raised, step_length
from footfall.planning.legged.stacks import Stack
from footfall.planning.legged.stance import Ground

DRAWN_IN = np.pi / 3
"""The foot is drawn in over this turn, and let out over as much [rad]."""
SPARE = 0.01
"""Drawn in, a foot is this much farther from its stack than its leg gets [m]."""
FINE = 400
"""Places by which the way is measured before it is divided evenly."""


def through_body(stack: Stack, other: Stack, T_site_base: Array) -> FootLine:
    """Line of a foot of a stack that passes through the body, the chassis still at a level pose.

    Args:
        stack: of the foot.
        other: the other stack.
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        What makes the line from where the foot starts and ends.
    """
    axes = [apply(T_site_base, np.array([*one.axis, 0.0]))[:2] for one in (stack, other)]

    def line(ground: Ground, leg: int, start: Array, end: Array) -> Iterator[tuple[str, Array]]:
        between = around(axes[0], axes[1], start[:2], end[:2], stack.nearest + SPARE, step_length(ground))
        yield from raised(ground, leg, start, end, between)

    return line


def around(axis: Array, toward: Array, start: Array, end: Array, nearest: float, step: float) -> Array:
    """Places around an axis, from start to end.

    Args:
        axis: (2,) in site [m].
        toward: place (2,) in site on whose side of the axis they are [m].
        start: (2,) in site [m].
        end: (2,) in site [m].
        nearest: how near to the axis the foot is drawn in [m].
        step: two places are at most so far apart [m].

    Returns:
        (n, 2) in site [m].
    """
    ways = np.array([start, end, toward]) - axis
    first, last, inward = np.arctan2(ways[:, 1], ways[:, 0])
    (r_first, r_last), turn = np.linalg.norm(ways[:2], axis=1), 2 * np.pi
    sign = 1.0 if (inward - first) % turn < (last - first) % turn else -1.0
    whole = (sign * (last - first)) % turn
    gone = np.linspace(0.0, whole, FINE)
    ramp = min(DRAWN_IN, whole / 2)
    radius = nearest + (r_first - nearest) * np.clip(1 - gone / ramp, 0, 1)
    radius += (r_last - nearest) * np.clip(1 - (whole - gone) / ramp, 0, 1)
    angle = first + sign * gone
    fine = axis + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    far = np.concatenate([[0.0], np.linalg.norm(np.diff(fine, axis=0), axis=1).cumsum()])
    even = np.linspace(0.0, far[-1], max(int(np.ceil(far[-1] / step)), 1) + 1)
    return np.column_stack([np.interp(even, far, fine[:, k]) for k in range(2)])
