"""Which leg is worth lifting to look: what of the ground around its wheel images would show only then."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from footfall.core.frames import apply
from footfall.maps.support_outlines import bearing
from footfall.planning.looking.how_to_see import LIFTED, unknown_around, with_leg_up
from footfall.planning.looking.in_view import in_view
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

AROUND = 0.5
"""So far around a wheel ground counts as hidden by its leg [m]."""
WORTH = 0.3
"""A leg is lifted to look where at least this share of the unknown ground around its wheel comes into view."""


class Hidden(NamedTuple):
    """leg: that hides ground; share: of the unknown ground around its wheel that images show once it is lifted."""

    leg: int
    share: float

    def __str__(self) -> str:
        return f"images with leg {self.leg} {LIFTED:g} m up show {self.share:.0%} of the unknown ground at its wheel"


def leg_to_lift(robot: Robot, dem: Dem, state: RobotState, but: Collection[int] = ()) -> Hidden | None:
    """The leg whose lifting shows most.

    Nothing is asked of the balance of a rover with a leg lifted: planning that says so.

    Args:
        robot: the rover; it has closed-form legs.
        dem: the ground, in site.
        state: how the rover stands.
        but: legs that are not asked.

    Returns:
        The leg, and what share of the ground it shows; None where no leg is worth it.
    """
    best: Hidden | None = None
    wheels = apply(np.asarray(state.T_site_base, float), wheel_centers(robot, state.posture))
    for leg in bearing(robot, state):
        unknown = np.zeros((0, 3)) if leg in but else unknown_around(dem, wheels[leg, :2], AROUND)
        lifted = with_leg_up(robot, state, leg) if len(unknown) else None
        if lifted is None:
            continue
        newly = in_view(robot, dem, lifted, unknown) & ~in_view(robot, dem, state, unknown)
        found = Hidden(leg, float(newly.mean()))
        if found.share >= WORTH and (best is None or found.share > best.share):
            best = found
    return best
