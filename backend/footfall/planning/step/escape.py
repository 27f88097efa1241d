"""The smallest ways out of a posture that is not allowed: straight up, or by turning joints.

Both are postures to begin from, not motions: how the leg gets there from where it can't be is for a person to decide.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.scene.lift import vertical
from footfall.planning.step.situation import TRUE, Situation
from footfall.robot.model import Robot

HIGHEST = 0.4
"""Largest lift that is looked at [m]."""
LIFTS = 0.01
"""Lifts are looked at in steps of this [m]."""
SIZES = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
"""Largest changes of a joint that are looked at, smallest first [rad]."""
DIRECTIONS = 250
"""Directions of joint space that are looked at for each size, besides those along single joints."""
ROUNDS, BESIDE = 6, 30
"""Then so many directions beside the best one so far are looked at, so often, each time nearer to it."""
FARTHEST, NEARER = 0.5, 0.6
"""How far beside it at first, of its largest component, and this share of that in each further round."""
FINEST = 0.001
"""A change is shortened until this much less of a joint's turn would not do [rad]."""


_Test = Callable[[Array], bool]


@dataclass(frozen=True)
class Escape:
    """lift: how far straight up [m]; alone, change: turns of the leg's joints (6,) [rad], of one joint and of several.

    None where none was found; change also where it is no smaller than ``alone``.
    """

    lift: float | None
    alone: Array | None
    change: Array | None

    def in_words(self, robot: Robot, leg: int) -> str:
        """For a person; empty where there is none."""
        names = robot.joint_names[6 * leg : 6 * leg + 6]
        ways = [] if self.lift is None else [f"lift the wheel straight up by {self.lift:z.2f} m"]
        for turns in (self.alone, self.change):
            if turns is not None:
                turned = [f"{name} by {q:+z.3f}" for name, q in zip(names, turns, strict=True) if abs(q) >= FINEST / 2]
                ways.append(f"turn {', '.join(turned)} rad")
        return ", or ".join(ways)


def find_escape(situation: Situation, q: Array, pulse: Callable[[], None] = lambda: None) -> Escape:
    """Find the smallest move out of a leg posture that the situation forbids on the ground as it is.

    The changes are the smallest that were found, by their largest joint: among single joints, which are all looked at,
    and among seeded directions and others beside the best of these. A smaller change of several joints may exist.

    Args:
        situation: what the leg may do.
        q: its posture, inside its limits, (6,) [rad].
        pulse: called at every posture that is looked at.

    Returns:
        How far up, the turn of one joint, and that of several; None for what was not found.
    """

    def is_free(q: Array) -> bool:
        pulse()
        return bool((q >= situation.lower).all() and (q <= situation.upper).all() and situation.free(q, TRUE))

    rng = np.random.default_rng(0)
    alone = _change(is_free, q, np.concatenate([np.eye(6), -np.eye(6)]))
    change = _change(is_free, q, _unit(rng.uniform(-1.0, 1.0, (DIRECTIONS, 6))))
    if change is not None:
        for i in range(ROUNDS):
            spread = FARTHEST * NEARER**i
            change = _shorter(is_free, q, change, _unit(_unit(change) + spread * rng.standard_normal((BESIDE, 6))))
    if alone is not None and change is not None and np.abs(change).max() >= np.abs(alone).max():
        change = None
    return Escape(_lift(situation, q), alone, change)


def _lift(situation: Situation, q: Array) -> float | None:
    for i in range(1, round(HIGHEST / LIFTS) + 1):
        up = vertical(situation.robot, situation.leg, situation.T_site_base, q, i * LIFTS)
        if isinstance(up, str):
            return None
        if situation.free(up[-1], TRUE):
            return i * LIFTS
    return None


def _unit(directions: Array) -> Array:
    """With a largest component of 1."""
    return directions / np.abs(directions).max(axis=-1, keepdims=True)


def _change(is_free: _Test, q: Array, directions: Array) -> Array | None:
    """The smallest change (6,) along one of n directions (n, 6) of largest component 1."""
    for size in SIZES:
        free = [one for one in directions if is_free(q + size * one)]
        if free:
            change = _shortened(is_free, q, free[0], size) * free[0]
            return _shorter(is_free, q, change, free[1:])
    return None


def _shorter(is_free: _Test, q: Array, change: Array, directions: Iterable[Array]) -> Array:
    """A change (6,), or one along one of the directions, each (6,) of largest component 1, that is smaller."""
    for one in directions:
        # most directions are no shorter way, and one look says so
        length = float(np.abs(change).max()) - FINEST
        if length > 0 and is_free(q + length * one):
            change = _shortened(is_free, q, one, length) * one
    return change


def _shortened(is_free: _Test, q: Array, direction: Array, size: float) -> float:
    """How far along a direction, of which ``size`` is enough, is enough."""
    low, high = 0.0, size
    while high - low > FINEST:
        middle = 0.5 * (low + high)
        if is_free(q + middle * direction):
            high = middle
        else:
            low = middle
    return high
