"""What a list of commands asks of the joints, posture by posture. What the ground makes of it is in ``passage``."""

import numpy as np

from footfall.core.arrays import Array
from footfall.sequence.commands import Command

FARTHEST = 4.0 * np.pi
"""An angle beyond two turns [rad] is no posture's, such as one in degrees: what such a move meets is not asked."""


def target(command: Command, leg_count: int) -> tuple[slice, Array] | None:
    """Which joints of a posture a command moves, and the angles that it moves them to [rad].

    Six joints for the moves of one leg, all for POSTURE_MOVE. None where it moves nothing: a WAIT, or not well enough
    formed (unknown name or leg, another number of joints, joints that are not finite or beyond FARTHEST).
    """
    moved = addressed(command, leg_count)
    return None if moved is None or np.abs(moved[1]).max() > FARTHEST else moved


def addressed(command: Command, leg_count: int) -> tuple[slice, Array] | None:
    """As :func:`target`, however far the angles are."""
    kind, leg, joints = command.kind, command.leg, command.joints
    if not kind.moves or joints is None or joints.shape != (kind.joint_count(leg_count),):
        return None
    if not np.isfinite(joints).all() or (kind.names_leg and (leg is None or not 0 <= leg < leg_count)):
        return None
    return kind.joints_of(leg, leg_count), joints


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
