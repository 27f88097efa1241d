"""Whether the rover moved so much that what is drawn of it must be drawn anew."""

from collections.abc import Sequence

import numpy as np

from footfall.telemetry.state import RobotState

TURN = 2e-3
"""Of a joint [rad or m], and of an entry of the chassis' rotation."""
SHIFT = 2e-3
"""Of the chassis [m]."""


def stands_still(before: RobotState, now: RobotState, legs: Sequence[int] | None = None) -> bool:
    """Whether no joint (of some legs, or of all) and not the chassis moved by more than an eye sees.

    Noise of sensors is less.
    """
    if before.posture.shape != now.posture.shape:
        return False
    moved = np.abs(before.T_site_base - now.T_site_base)
    own = range(now.leg_count) if legs is None else legs
    joints = [float(np.abs(before.leg(leg) - now.leg(leg)).max()) for leg in own]
    turned = max([*joints, float(moved[:3, :3].max())])
    return turned <= TURN and float(moved[:3, 3].max()) <= SHIFT
