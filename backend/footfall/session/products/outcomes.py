"""What came of each run: compared with its prediction as soon as the rover is at rest after it."""

import math
from dataclasses import dataclass
from typing import Literal

from footfall.core.errors import FootFallError
from footfall.sequence.commands import Sequence
from footfall.sequence.outcome import Difference, Outcome
from footfall.session.answers.commands import ComparedAnswer, DifferenceAnswer
from footfall.session.core import SessionCore
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import OutcomeRequest
from footfall.session.log.fold_commands import RunRecord
from footfall.session.products.kinds import OUTCOME
from footfall.session.products.sequences import Sequences
from footfall.telemetry.command_kinds import WAIT
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import on_map

REST = 1.5
"""So long after commands that end without a pause the chassis still sways [s]."""


@dataclass(frozen=True)
class _Waiting:
    """A run whose rover comes to rest. rows: so many were done; since: rover clock [s]; frame: the latest of it."""

    run: RunRecord
    rows: int
    since: float
    frame: TelemetryFrame


class Outcomes:
    """What came of each run, compared with its prediction; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    _waiting: _Waiting | None = None
    _asked: tuple[int, Job] | None = None
    """A run, and the job that compares it."""
    _refused: tuple[int, str] = (0, "")
    """A run, and why it was not compared."""

    def __init__(self, core: SessionCore, sequences: Sequences) -> None:
        self._core, self._sequences = core, sequences
        self._before = core.state.runs
        """The latest run before the session was opened."""
        self._compared = self._before
        """The latest run that was compared, or can't be."""

    def latest(self) -> ComparedAnswer:
        """What came of the latest run, as plain JSON.

        state: "none" where there is nothing to compare, "waiting" until the rover is at rest and the comparison made,
        "compared". verdict: "as_predicted", "differs" or "not_told"; only the first is good.
        """
        state = self._core.state
        run = state.run
        if run is None or run.state != "ended":
            return _nothing("none", "nothing was carried out yet")
        found = state.newest(OUTCOME)
        made = None if found is None else self._core.typed(Outcome, found)
        if made is not None and made.run == run.number:
            return {
                "state": "compared",
                "verdict": made.verdict,
                "rigid": made.rigid,
                "reason": _reason(made),
                "differences": [_plain(one) for one in made.differences],
            }
        reason = self._not_compared(run)
        if self._asked is not None and self._asked[0] == run.number:
            reason = self._asked[1].error.message if self._asked[1].error is not None else reason
        if self._refused[0] == run.number:
            reason = self._refused[1]
        if reason:
            return _nothing("none", reason)
        return _nothing("waiting", "it is compared when the rover is at rest")

    def look(self, frame: TelemetryFrame) -> None:
        """``frame``: the latest. What is compared is the first at rest after a run, or the last before the next run."""
        waiting, run = self._waiting, self._core.state.run
        if waiting is not None and (run is None or run.number != waiting.run.number):
            self._compare(waiting)
            waiting = self._waiting
        if run is None or run.state != "ended" or run.number <= self._compared or frame.state.mode != "idle":
            return
        if self._not_compared(run):
            self._compared = run.number
            return
        rows = len(self._done(run))
        since = frame.state.time if waiting is None else waiting.since
        self._waiting = waiting = _Waiting(run, rows, since, frame)
        ended = self._core.typed(Sequence, run.sequence).commands[rows - 1]
        if ended.kind is WAIT or frame.state.time - since >= REST:
            self._compare(waiting)

    def _compare(self, waiting: _Waiting) -> None:
        self._waiting, self._compared = None, waiting.run.number
        dem = self._sequences.planned_on(waiting.run.sequence) or self._core.state.dem
        if dem is None:
            return
        try:
            state = self._core.put(on_map(waiting.frame.state, self._core.typed(Dem, dem)))
            parents = {"robot": self._core.robot_digest, "dem": dem, "sequence": waiting.run.sequence, "state": state}
            request = OutcomeRequest(waiting.run.number, waiting.rows, waiting.frame.commanded)
            job = self._core.product_jobs.submit(OUTCOME, parents, request, urgent=True, run=waiting.run.number)
            self._asked = (waiting.run.number, job)
        except (FootFallError, OSError) as err:
            self._refused = (waiting.run.number, f"it could not be compared with its prediction: {err}")

    def _not_compared(self, run: RunRecord) -> str:
        """Why a run that has ended can't be compared with its prediction; empty where it can."""
        sent = [one for one in self._core.state.commands if one.run == run.number]
        open_rows = [one.row for one in sent if one.state != "done"]
        if open_rows:
            return f"row {open_rows[0] + 1} was not carried out to its end: where the rover is now was not predicted"
        if not sent:
            return "no row of it was carried out"
        if run.number <= self._before:
            return "the session was closed before the rover was at rest"
        if self._core.state.dem is None:
            return "there is no terrain to compare it on"
        return ""

    def _done(self, run: RunRecord) -> list[int]:
        return [one.row for one in self._core.state.commands if one.run == run.number and one.state == "done"]


def _nothing(state: Literal["none", "waiting"], reason: str) -> ComparedAnswer:
    return {"state": state, "reason": reason, "verdict": "not_told", "rigid": None, "differences": []}


def _plain(one: Difference) -> DifferenceAnswer:
    return {
        "quantity": one.quantity,
        "leg": one.leg,
        "predicted": _known(one.predicted),
        "measured": _known(one.measured),
        "difference": _known(one.difference),
        "uncertainty": _known(one.uncertainty),
        "unit": one.unit,
        "verdict": one.verdict,
        "text": one.text,
        "advice": one.advice,
    }


def _known(size: float) -> float | None:
    """JSON has no NaN."""
    return None if math.isnan(size) else size


def _reason(made: Outcome) -> str:
    """One line: what came of it."""
    if made.verdict == "as_predicted":
        return "touch-down, loads, drift and sink are as predicted" if not made.rigid else "it moved as commanded"
    if made.verdict == "differs":
        count = sum(one.verdict == "differs" for one in made.differences)
        return f"{count} of {len(made.differences)} differ from the prediction by more than its uncertainty"
    if made.rigid:
        return "these commands took the rover as rigid, and it sags: touch-down and loads were not predicted"
    return "not all that was predicted was measured"
