"""What a list of commands asks of the joints, posture by posture. What the ground makes of it is in ``passage``."""

import numpy as np
from numpy.typing import NDArray

from footfall.sequence.commands import ONE_LEG, Command

Array = NDArray[np.float64]


def target(command: Command, leg_count: int) -> tuple[slice, Array] | None:
    """Which joints of a posture a command moves, and the angles that it moves them to [rad].

    Six joints for the moves of one leg, all for POSTURE_MOVE. None where it moves nothing: a WAIT, or not well enough
    formed (unknown name or leg, another number of joints, joints that are not finite).
    """
    leg, joints = command.leg, command.joints
    if joints is None or not np.isfinite(joints).all():
        return None
    if command.name in ONE_LEG and leg is not None and 0 <= leg < leg_count and joints.shape == (6,):
        return slice(6 * leg, 6 * leg + 6), joints
    if command.name == "POSTURE_MOVE" and joints.shape == (6 * leg_count,):
        return slice(0, 6 * leg_count), joints
    return None


def after(posture: Array, command: Command) -> Array:
    """The posture that one command asks for, (legs × 6,) [rad]; unchanged where the command moves nothing."""
    out = posture.copy()
    moved = target(command, len(posture) // 6)
    if moved is not None:
        own, joints = moved
        out[own] = joints
    return out


def predict(start: Array, commands: tuple[Command, ...]) -> Array:
    """The postures asked for by each command, (len(commands), legs × 6) [rad], every one carried out to its end."""
    postures = np.empty((len(commands), len(start)))
    posture = np.asarray(start, float)
    for row, command in enumerate(commands):
        posture = after(posture, command)
        postures[row] = posture
    return postures


def needed_duration(travel: Array, speed_limits: Array) -> float:
    """Least seconds for a coordinated move: max over the joints of |Δq| / speed limit; (n,), (n,)."""
    return float(np.max(np.abs(travel) / speed_limits))
