"""Which leg each row of a sequence is about: a step with the pose held moves all joints, and one leg steps."""

import numpy as np

from footfall.sequence.commands import Sequence
from footfall.telemetry.command_kinds import WAIT

STEP_PHASES = ("unload", "lift", "swing", "lower", "load")
"""Phases of a step in their order."""


def moved_legs(sequence: Sequence) -> list[int | None]:
    """The leg that each row is about, None where it is about none.

    Args:
        sequence: of any robot; whole postures are looked at for those of ATHLETE's build.

    Returns:
        One entry for each row: the leg that it names; of whole postures and pauses in a step, the one that steps.
    """
    legs = [command.leg if command.kind.names_leg else None for command in sequence.commands]
    for rows in _steps(sequence):
        named = {legs[row] for row in rows} - {None}
        leg = named.pop() if named else _moved_most(sequence, rows)
        for row in rows:
            legs[row] = leg if legs[row] is None else legs[row]
    return legs


def _steps(sequence: Sequence) -> list[range]:
    """The rows of each step, pauses included: its phases never go back to an earlier one."""
    steps: list[range] = []
    reached: int | None = None
    for row, command in enumerate(sequence.commands):
        phase = STEP_PHASES.index(command.phase) if command.phase in STEP_PHASES else None
        if phase is None and command.kind is not WAIT:
            reached = None
        elif phase is not None and (reached is None or phase < reached):
            steps.append(range(row, row + 1))
            reached = phase
        elif reached is not None:
            steps[-1] = range(steps[-1].start, row + 1)
            reached = reached if phase is None else phase
    return steps


def _moved_most(sequence: Sequence, rows: range) -> int | None:
    if sequence.described is not None:
        return None
    postures = [joints for row in rows if (joints := sequence.commands[row].joints) is not None]
    if not postures:
        return None
    before = sequence.predicted[rows[0] - 1] if rows[0] else sequence.start
    return int(np.argmax(np.abs(np.array(postures) - before).max(axis=0).reshape(-1, 6).max(axis=1)))
