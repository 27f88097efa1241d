"""One check of a move of the chassis."""

from dataclasses import dataclass

from footfall.planning.answers import Check


@dataclass(frozen=True)
class MoveCheck:
    """A check, and whether it fails already at the start or at the goal."""

    check: Check
    at_start: bool = False
    at_goal: bool = False
