"""Commands on their way: gate, link and log together. Each row goes when the rover is done with the one before.

Every command is in the log before it is on the wire, so nothing is ever sent twice, whatever dies. The stop
alone goes the other way round: first to the rover, then into the log.
"""

import contextlib
import threading
import time
from typing import Any, Protocol

from footfall.core.errors import Conflict
from footfall.sequence.commands import Sequence
from footfall.session.gate import ARMED_FOR, STALE_AFTER, Facts, Gate, Run, require_fit
from footfall.session.link import RoverLink
from footfall.telemetry.link import ClearStopMessage, CommandMessage, StopMessage, encode

WATCH_PERIOD = 0.1
"""How often a run looks for a lost link or an overdue row [s]."""


class Record(Protocol):
    """Writes one event; raises OSError where the disk can't take it."""

    def __call__(self, type: str, payload: dict[str, Any]) -> object: ...


class Commanding:
    """Owns the gate of one session.

    record: writes an event. record_anyway: the same, but keeps it for later where it can't be written now.
    """

    def __init__(self, gate: Gate, link: RoverLink, record: Record, record_anyway: Record) -> None:
        self.gate = gate
        self._link = link
        self._record = record
        self._record_anyway = record_anyway
        self._watch: threading.Thread | None = None
        self._closing = threading.Event()

    def arm(self, digest: str, sequence: Sequence, facts: Facts, joint_names: tuple[str, ...]) -> dict[str, Any]:
        """See :meth:`footfall.session.live.LiveSession.arm`."""
        require_fit(sequence, facts, joint_names)
        token = self.gate.arm(digest)
        self._record("armed", {"sequence": digest})
        return {"token": token, "sequence": digest, "expires_in": ARMED_FOR}

    def send(self, token: str, sequence: Sequence, facts: Facts, joint_names: tuple[str, ...]) -> dict[str, Any]:
        """See :meth:`footfall.session.live.LiveSession.send`."""
        require_fit(sequence, facts, joint_names)
        run = self.gate.begin(token, sequence)
        started = {"run": run.number, "sequence": run.digest, "rows": len(sequence.commands)}
        try:
            self._record("run_started", started)
        except BaseException:
            self.gate.end(run.number)
            raise
        self._send_next(run.number)
        self._start_watch()
        ids = [Run(run.number, run.digest, sequence, row).command_id for row in range(len(sequence.commands))]
        return {"run": run.number, "commands": ids}

    def heard(self, command_id: str, state: str, reason: str) -> None:
        """The rover acknowledged a command."""
        run = self.gate.heard(command_id, state)
        self._record_anyway(f"command_{state}", {"id": command_id, "reason": reason})
        if run is None:
            return
        if state == "refused":
            self._end(run.number, "refused", f"the rover refused row {run.row}: {reason}")
        elif state == "done":
            if run.row + 1 == len(run.sequence.commands):
                self._end(run.number, "done", "")
            else:
                self._send_next(run.number)

    def stop(self, reason: str, at: float) -> None:
        """Stop the rover and send nothing more until the stop is cleared. Needs neither disk nor session lock.

        at: wall clock. Again while stopped: the rover is told again.
        """
        first, run = self.gate.latch()
        reached = self._tell_stop()
        if first:
            self._record_anyway("stop_requested", {"reason": reason, "at": at, "rover_reached": reached})
        if run is not None:
            self._record_ended(run, "stopped", "stopped" if not reason else f"stopped: {reason}")

    def stop_acknowledged(self, stop_id: str | None = None) -> None:
        """The rover stands still, because of the stop ``stop_id`` (None: the latest)."""
        if self.gate.stop_acknowledged(stop_id):
            self._record_anyway("stop_acknowledged", {})

    def clear_stop(self) -> None:
        """Raises Conflict while a connected rover has not acknowledged the stop, or where another stop came."""
        stops = self.gate.stops()
        frame = self._link.frame
        was_stopped = self.gate.stopped
        if was_stopped:
            if self._link.connected and not self.gate.acknowledged:
                raise Conflict("the rover has not acknowledged the stop yet; the stop stays in force")
            self._record("stop_cleared", {})
        elif frame is None or frame.state.mode != "stopped":
            return
        if self.gate.unlatch(stops, self._tell_clear):
            return
        if was_stopped:
            # the log says cleared, and must not stay behind the gate
            again = {"reason": "asked for while a stop was being cleared", "at": time.time(), "rover_reached": True}
            self._record_anyway("stop_requested", again)
        raise Conflict("another stop came while this one was being cleared; it stays in force")

    def connected(self) -> None:
        """A rover came (back): it hears of a stop that it may have missed, and has yet to acknowledge it."""
        if self.gate.rover_changed():
            self._tell_stop()

    def lost(self, reason: str) -> None:
        """The link is gone: what was not sent stays unsent."""
        self._end(None, "link_lost", reason)

    def close(self) -> None:
        """End the run, if there is one, and the thread that watches it."""
        self._end(None, "closed", "the session was closed")
        self._closing.set()
        if self._watch is not None and self._watch is not threading.current_thread():
            self._watch.join()

    def _tell_stop(self) -> bool:
        with contextlib.suppress(Conflict):
            self._link.send(encode(StopMessage(self.gate.stop_id)))
            return True
        return False

    def _tell_clear(self) -> None:
        with contextlib.suppress(Conflict):
            self._link.send(encode(ClearStopMessage("clear-stop")))

    def _send_next(self, number: int) -> None:
        run = self.gate.advance(number)
        if run is None:
            return
        command = run.command
        message = CommandMessage(
            id=run.command_id,
            sequence=run.digest,
            row=run.row,
            name=command.name,
            leg=command.leg,
            joints=command.joints,
            duration=command.duration,
        )
        text = encode(message)
        sent = {"id": run.command_id, "sequence": run.digest, "run": run.number, "row": run.row}
        try:
            self._record("command_sent", sent)
        except OSError as err:
            self._end(number, "not_recorded", f"the log can't be written, so nothing more is sent: {err}")
            return
        try:
            went = self.gate.release(run, lambda: self._link.send(text))
        except Conflict as err:
            self._end(number, "link_lost", err.message)
            return
        if not went:
            # A stop came between the log and the wire.
            self._record_anyway("command_refused", {"id": run.command_id, "reason": "held back: the run had ended"})

    def _end(self, number: int | None, outcome: str, reason: str) -> None:
        run = self.gate.end(number)
        if run is not None:
            self._record_ended(run, outcome, reason)

    def _record_ended(self, run: Run, outcome: str, reason: str) -> None:
        unsent = len(run.sequence.commands) - run.row - 1
        ended = {"run": run.number, "outcome": outcome, "reason": reason, "unsent": unsent}
        self._record_anyway("run_ended", ended)

    def _start_watch(self) -> None:
        if self._watch is None:
            self._watch = threading.Thread(target=self._watch_runs, name="footfall-runs", daemon=True)
            self._watch.start()

    def _watch_runs(self) -> None:
        while not self._closing.wait(WATCH_PERIOD):
            if self.gate.run is None:
                continue
            age = self._link.age
            if age is None or age > STALE_AFTER:
                self.lost(f"the rover has sent no telemetry for {age or 0.0:.1f} s")
            elif late := self.gate.overdue():
                self._end(None, "overdue", late)
