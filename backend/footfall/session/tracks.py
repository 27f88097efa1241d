"""Where wheels were put down in a session, by the commands that the rover said were carried out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from footfall.session.log.fold_commands import CommandRecord

LOWERED = "lower"
"""The phase whose last row puts a wheel down."""


@dataclass(frozen=True)
class Step:
    """posture (legs × 6,) [rad] and T_site_base (4, 4) in which ``leg`` was put down."""

    leg: int
    posture: NDArray[np.float64]
    T_site_base: NDArray[np.float64]


def tracks(commands: Iterable[CommandRecord], sequence_of: Callable[[str], object]) -> tuple[Step, ...]:
    """The footfalls that were carried out, oldest first, as predicted for the row that ended them.

    sequence_of: the commands of a digest; what is no sequence counts for nothing.
    """
    from footfall.sequence.commands import Sequence
    from footfall.sequence.yielding_rules import stepping_legs

    @cache
    def landings(digest: str) -> dict[int, Step]:
        sequence = sequence_of(digest)
        if not isinstance(sequence, Sequence):
            return {}
        phases = [command.phase for command in sequence.commands]
        return {
            row: Step(leg, sequence.predicted[row], sequence.poses[row])
            for row, leg in enumerate(stepping_legs(sequence.commands))
            if leg is not None and phases[row] == LOWERED and LOWERED not in phases[row + 1 : row + 2]
        }

    done = (landings(one.sequence).get(one.row) for one in commands if one.state == "done")
    return tuple(step for step in done if step is not None)
