"""Which pinned places have had no foot yet, once some foot moves of a walk are made."""

import numpy as np

from footfall.planning.walk.problem import Place, WalkPlan

ON = 0.05
"""How far a foot that is put on a pinned place may be from it [m]: on a slope it is put onto ground that was turned."""


def pins_left(plan: WalkPlan, pinned: tuple[Place, ...], done: int) -> tuple[Place, ...]:
    """The pinned places that the first foot moves of a walk have put no foot on.

    Args:
        plan: the walk.
        pinned: places that it was asked for with, or some of them.
        done: how many of its foot moves are made.

    Returns:
        Those of ``pinned`` that are still to have a foot.
    """
    return tuple(pin for pin in pinned if not 0 <= _put_by(plan, pin) < done)


def _put_by(plan: WalkPlan, pin: Place) -> int:
    """Number of the foot move that puts a foot nearest to a pinned place; −1 where none puts one on it."""
    away = [
        float(np.hypot(*(stance.contacts[leg, :2] - (pin.x, pin.y)))) if pin.leg in (None, leg) else np.inf
        for leg, stance in zip(plan.legs, plan.stances[1:], strict=True)
    ]
    return int(np.argmin(away)) if away and min(away) <= ON else -1
