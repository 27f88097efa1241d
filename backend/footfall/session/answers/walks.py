"""What is told of a walk on its way."""

from typing import TypedDict


class WalkingAnswer(TypedDict):
    """How far the latest walk is.

    of: its foot moves and the chassis' last way; done: how many were carried out. next: number of the one that is next,
    counted from 0; leg: whose foot it moves, null: the chassis alone goes. against: why it can't begin where the rover
    stands now, "" where nothing speaks against it. commanded: of how many parts, from the next on, the session's
    commands are; 0: they are of something else.
    """

    walk: str
    of: int
    done: int
    next: int | None
    leg: int | None
    against: str
    text: str
    commanded: int
