"""Which planner's turn it is to look for a way: one after the other, or several in a race.

A race is run in turns on one thread. In each, every planner that is left looks for a way to each goal, but no more
often than the turn allows; one that has found none by then is begun anew in the next turn, with more looks. So the work
is within a constant factor of that of the planner which is the quickest for the problem, whichever that is (B.
Huberman, R. Lukose, T. Hogg, "An economics approach to hard computational problems", Science 275, 1997; C. Gomes, B.
Selman, "Algorithm portfolios", Artificial Intelligence 126, 2001). Looks are counted, not seconds: who wins does not
depend on what else the computer does.
"""

from collections.abc import Iterator
from dataclasses import dataclass

AUTO = ("line", "fast", "astar", "sbl")
RACE = (*AUTO, "rrtconnect", "kpiece", "bitstar")
QUICK = ("line", "fast")
"""Those whose failure is known in a fraction of a second."""
FIRST_LOOKS = 1000
"""For a way to one goal in the first turn of a race: mostly enough for ``fast`` and the shorter paths it looks for."""
GROWTH = 2
"""Times as many looks in each turn as in that before."""


@dataclass(frozen=True)
class Turn:
    """number: 1 for the first. looks: how many a planner may make for a way to one goal."""

    planner: str
    number: int
    looks: float


class Turns:
    """The turns of the planner that was asked for; a planner alone and those of ``auto`` have one each, without end."""

    def __init__(self, asked: str) -> None:
        self._left = list({"auto": AUTO, "race": RACE}.get(asked, (asked,)))
        self._first = FIRST_LOOKS if asked == "race" else float("inf")

    def __iter__(self) -> Iterator[Turn]:
        number, looks = 1, self._first
        while self._left:
            for planner in tuple(self._left):
                yield Turn(planner, number, looks)
            number, looks = number + 1, GROWTH * looks

    def has_failed(self, planner: str) -> None:
        """More looks would not help it."""
        self._left.remove(planner)
