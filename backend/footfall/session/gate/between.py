"""Between two foot moves of a run nothing goes before the rover was seen to stand as the one before was to leave it."""

from collections.abc import Callable

from footfall.core.errors import CommandRefused, FootFallError
from footfall.sequence.foot_moves import begins_a_foot_move
from footfall.session.gate.checks import Facts, require_fit_to_go_on
from footfall.session.gate.runs import Run

SETTLES = 20
"""Telemetry frames that a rover may still be moving in after it said that it was done."""


class Between:
    """Looks at the rover of one run, by telemetry that came after the foot was placed.

    facts: the present ones. Times are those at which telemetry came.
    """

    def __init__(self, facts: Callable[[], Facts], joint_names: tuple[str, ...]) -> None:
        self._facts, self._joint_names = facts, joint_names
        self._seen: float | None = None
        self._left = 0
        self.waits = False
        """Whether the next row is not to go yet."""

    def row_done(self, run: Run, at: float | None) -> None:
        """``run`` has come to its next row. at: when the latest telemetry came: what came before it tells nothing."""
        self.waits = begins_a_foot_move(run.sequence.commands, run.row)
        self._seen, self._left = at, SETTLES

    def passed(self) -> None:
        """The rover was looked at otherwise: the next row may go."""
        self.waits = False

    def look(self, run: Run, at: float | None) -> str | None:
        """What speaks against going on, "" where nothing does; None: that is not known yet, or nothing waits."""
        if not self.waits or at is None or at == self._seen:
            return None
        try:
            facts = self._facts()
        except (FootFallError, OSError) as err:  # what it is judged by is read from the disk
            self.waits = False
            return f"held between foot moves: nobody can tell how the rover stands: {err}"
        self._seen, self._left = at, self._left - 1
        if facts.frame is not None and facts.frame.state.mode == "moving" and self._left > 0:
            return None
        try:
            require_fit_to_go_on(run.sequence, run.row, facts, self._joint_names)
        except CommandRefused as err:
            self.waits = False
            return f"held between foot moves: {err.message}"
        self.waits = False
        return ""
