"""Whether the rover moved so much that what is drawn of it must be drawn anew."""

from collections.abc import Sequence

import numpy as np

from footfall.telemetry.state import RobotState

TURN = 2e-3
"""Of a joint [rad], and of an entry of the chassis' rotation."""
SHIFT = 2e-3
"""Of the chassis [m]."""


def stands_still(before: RobotState, now: RobotState, legs: Sequence[int] | None = None) -> bool:
    """Whether no joint (of some legs, or of all) and not the chassis moved by more than an eye sees.

    Noise of sensors is less.
    """
    if before.posture.shape != now.posture.shape:
        return False
    moved = np.abs(before.T_site_base - now.T_site_base)
    joints = np.abs(before.posture - now.posture).reshape(-1, 6)
    joints = joints if legs is None else joints[list(legs)]
    turned = max(float(joints.max(initial=0.0)), float(moved[:3, :3].max()))
    return turned <= TURN and float(moved[:3, 3].max()) <= SHIFT
