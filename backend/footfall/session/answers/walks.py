"""What is told of a walk on its way."""

from typing import TypedDict

import numpy as np
from numpy.typing import NDArray


class WalkingAnswer(TypedDict):
    """How far the latest walk is.

    of: its foot moves and the chassis' last way; foot_moves: without that; done: how many parts were carried out. next:
    number of the one that is next, counted from 0; leg: whose foot it moves, null: the chassis alone goes. against: why
    it can't begin where the rover stands now, "" where nothing speaks against it. commanded: of how many parts, from
    the next on, the session's commands are; 0: they are of something else.
    """

    walk: str
    of: int
    foot_moves: int
    done: int
    next: int | None
    leg: int | None
    against: str
    text: str
    commanded: int


class PartSpareAnswer(TypedDict):
    """One phase of one foot move: its first and last waypoint, and what it leaves to spare beyond clearances [m].

    spare: proven, at least, at most 0.2; null: nobody knows, for the reason in `between`. waypoint: where that is.
    between: what comes nearest there.
    """

    first: int
    last: int
    spare: float | None
    waypoint: int
    between: str


class AlongWalkAnswer(TypedDict):
    """What there is to say all along a walk beside its margins and torques.

    parts: phases of foot moves, in their order. newest: when the newest images of its map came [s since 1970], as
    ``seen`` of the terrain; null where the map does not say when its ground was seen. seen_before: how much earlier the
    oldest ground under each placed foot was, one for each foot move [s].
    """

    digest: str
    parts: list[PartSpareAnswer]
    newest: float | None
    seen_before: NDArray[np.float64]
