"""Which rows of a sequence belong together: those up to and with the placing of a foot."""

from collections.abc import Iterable
from dataclasses import dataclass

from footfall.sequence.commands import Command

PLACES, LOADS = "lower", "load"
"""Phases of rows that put a foot on the ground, and that let it bear then."""


@dataclass(frozen=True)
class Rows:
    """Rows ``first`` … ``first + count - 1`` of a sequence. leg: whose foot they move; None: only the chassis goes."""

    first: int
    count: int
    leg: int | None


def foot_moves(commands: Iterable[Command]) -> tuple[Rows, ...]:
    """The rows of each foot move, in order; what follows the last placing is one more without a leg.

    Rows without a phase, which wait, belong to what is before them.
    """
    found: list[Rows] = []
    placed = True
    for row, command in enumerate(commands):
        if placed and command.phase not in ("", PLACES, LOADS):
            found.append(Rows(row, 0, None))
            placed = False
        if not found:
            found.append(Rows(row, 0, None))
        placed = placed or command.phase == PLACES
        last = found[-1]
        leg = command.leg if last.leg is None else last.leg
        found[-1] = Rows(last.first, last.count + 1, leg)
    return tuple(found)


def begins_a_foot_move(commands: tuple[Command, ...], row: int) -> bool:
    """Whether the rows before ``row`` leave all feet on the ground, one of them placed just before.

    Rows without a phase, which wait, begin nothing.
    """
    before = next((command.phase for command in reversed(commands[:row]) if command.phase), "")
    return commands[row].phase not in ("", PLACES, LOADS) and before in (PLACES, LOADS)
