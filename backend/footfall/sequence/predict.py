"""What a list of commands leads to, posture by posture."""

import numpy as np
from numpy.typing import NDArray

from footfall.sequence.commands import Command

Array = NDArray[np.float64]


def target(command: Command, leg_count: int) -> tuple[int, Array] | None:
    """The leg that a command moves and the angles it moves to, (6,) [rad].

    None where it moves nothing: a WAIT, or not well enough formed (unknown name or leg, not six finite joints).
    """
    leg, joints = command.leg, command.joints
    if command.name != "LEG_MOVE" or leg is None or joints is None:
        return None
    if not 0 <= leg < leg_count or joints.shape != (6,) or not np.isfinite(joints).all():
        return None
    return leg, joints


def after(posture: Array, command: Command) -> Array:
    """The posture after one command, (legs × 6,) [rad]; unchanged where the command moves nothing."""
    out = posture.copy()
    moved = target(command, len(posture) // 6)
    if moved is not None:
        leg, joints = moved
        out[6 * leg : 6 * leg + 6] = joints
    return out


def predict(start: Array, commands: tuple[Command, ...]) -> Array:
    """The postures after each command, (len(commands), legs × 6) [rad]."""
    postures = np.empty((len(commands), len(start)))
    posture = np.asarray(start, float)
    for row, command in enumerate(commands):
        posture = after(posture, command)
        postures[row] = posture
    return postures


def needed_duration(travel: Array, speed_limits: Array) -> float:
    """Least seconds for a coordinated move: max over the joints of |Δq| / speed limit; (6,), (6,)."""
    return float(np.max(np.abs(travel) / speed_limits))
