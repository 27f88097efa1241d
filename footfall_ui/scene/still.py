"""Whether the rover moved so much that what is drawn of it must be drawn anew."""

import numpy as np

from footfall.telemetry.state import RobotState

TURN = 2e-3
"""Of a joint [rad], and of an entry of the chassis' rotation."""
SHIFT = 2e-3
"""Of the chassis [m]."""


def stands_still(before: RobotState, now: RobotState) -> bool:
    """Whether no joint and not the chassis moved by more than an eye sees; noise of sensors is less."""
    if before.posture.shape != now.posture.shape:
        return False
    moved = np.abs(before.T_site_base - now.T_site_base)
    turned = max(float(np.abs(before.posture - now.posture).max()), float(moved[:3, :3].max()))
    return turned <= TURN and float(moved[:3, 3].max()) <= SHIFT
