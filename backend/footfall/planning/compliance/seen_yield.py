"""Whether telemetry shows that a rover's joints give way, as its description says, or that they hold as told."""

import numpy as np
from numpy.typing import NDArray

from footfall.telemetry.state import RobotState

LEAST_YIELD = 0.25
"""A rover whose joints yield less than this share of what is expected holds them by other means than springs."""


def gives_way(state: RobotState, set_points: NDArray[np.float64], stiffness: NDArray[np.float64]) -> bool | None:
    """Whether a rover at rest shows that its joints give way.

    The medians over all joints are compared: a single bad encoder says nothing.

    Args:
        state: as telemetry has it.
        set_points: (legs × 6,) [rad].
        stiffness: of the joints, (legs × 6,) [N·m/rad].

    Returns:
        None where that can't be told.
    """
    seen = float(np.median(np.abs(set_points - state.posture)))
    expected = float(np.median(np.abs(state.joint_torques / stiffness)))
    if expected == 0.0:
        return True if seen > 0.0 else None
    return seen > LEAST_YIELD * expected
