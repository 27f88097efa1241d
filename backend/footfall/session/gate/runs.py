"""A run: one sequence on its way to the rover, row by row. Pure.

::

    due ──▶ claimed ──released──▶ out ──done──▶ due (going) or waiting (step by step, held) … ──▶ over
     ▲                                             │
     └──────────────── next, resume ───────────────┘
"""

from dataclasses import dataclass, replace

from footfall.sequence.commands import Command, Sequence
from footfall.session.access.identity import Identity

RECEIVED_WITHIN = 3.0
"""A command that the rover has not acknowledged after this ends the run [s]."""
DONE_FACTOR, DONE_EXTRA = 3.0, 30.0
"""A command that takes longer than factor × duration + extra [s] ends the run."""
STEP_BY_STEP = "step by step"


def command_id(digest: str, number: int, mark: str, row: int) -> str:
    """Unique for ever: a sequence's content, the how-manieth run of its session, and which row of it.

    mark: drawn for each run. Another session may send the same content in a run of the same number, and so may this one
    after its log was lost; the rover would take that for a repetition, and not move. "" in logs from before there was
    one.
    """
    return "-".join((digest[:12], str(number), *([mark] if mark else []), str(row)))


@dataclass(frozen=True)
class Run:
    """A sequence on its way to the rover.

    mark: see :func:`command_id`. by, fence: who sends it, under which number of the conn. row: the one that is due, out
    or waited before.
    phase: "due", "claimed" (by whoever writes it down and releases it), "out", "waiting" or "over".
    going: whether the next row goes by itself. why: it waits, or is to wait. aborted: nothing goes after the row that
    is out. received, released_at: of the row that is out.
    """

    number: int
    mark: str
    digest: str
    sequence: Sequence
    by: Identity
    fence: int
    going: bool = True
    row: int = 0
    phase: str = "due"
    why: str = ""
    aborted: bool = False
    received: bool = False
    released_at: float | None = None

    @property
    def command(self) -> Command:
        """The command of the present row."""
        return self.sequence.commands[self.row]

    @property
    def command_id(self) -> str:
        """Name of the present row's command."""
        return self.command_ids[self.row]

    @property
    def command_ids(self) -> list[str]:
        """Names of the commands of all rows."""
        return [command_id(self.digest, self.number, self.mark, row) for row in range(len(self.sequence.commands))]

    @property
    def unsent(self) -> int:
        """Rows that the rover was not told."""
        return len(self.sequence.commands) - self.row - (self.phase in ("out", "over"))

    @property
    def mode(self) -> str:
        """For people and programs: "whole" or "steps"."""
        return "whole" if self.going else "steps"

    def is_at(self, other: "Run") -> bool:
        """Whether both are the same run at the same row."""
        return (self.number, self.row) == (other.number, other.row)

    def released(self, now: float) -> "Run":
        """The row is on its way."""
        return replace(self, phase="out", received=False, released_at=now)

    def row_done(self) -> "Run":
        """The rover is done with the row that is out: the next is due, waited before, or there is none."""
        if self.row + 1 == len(self.sequence.commands) or self.aborted:
            return replace(self, phase="over")
        return replace(self, row=self.row + 1, phase="due" if self.going else "waiting", released_at=None)

    def held(self, why: str) -> "Run":
        """Nothing goes by itself any more; a row that is out is carried out."""
        return replace(self, going=False, why=why, phase="waiting" if self.phase == "due" else self.phase)

    def gone_on(self, by: Identity, fence: int, going: bool) -> "Run":
        """Go on: with all rows (``going``), or one."""
        why = "" if going else STEP_BY_STEP
        phase = "due" if self.phase == "waiting" else self.phase
        return replace(self, by=by, fence=fence, going=going, why=why, phase=phase)

    def abandoned(self) -> "Run":
        """Nothing more goes; over at once unless a row is out."""
        phase = self.phase if self.phase in ("claimed", "out") else "waiting"
        return replace(self, aborted=True, going=False, why="aborted", phase=phase)

    @property
    def over(self) -> bool:
        """Whether nothing is out any more and nothing will go."""
        return self.phase == "over" or (self.aborted and self.phase == "waiting")

    def overdue(self, now: float, light: float = 0.0) -> str | None:
        """Why the row that is out takes too long, or None. light: how long command and answer are on their way [s]."""
        if self.phase != "out" or self.released_at is None:
            return None
        waited = now - self.released_at - light
        if not self.received and waited > RECEIVED_WITHIN:
            return f"the rover did not acknowledge row {self.row + 1} within {RECEIVED_WITHIN:g} s"
        longest = DONE_FACTOR * self.command.duration + DONE_EXTRA
        return f"row {self.row + 1} was not done within {longest:z.0f} s" if waited > longest else None
