"""Commands on their way: gate, link and log together. Each row goes when the rover is done with the one before.

Every command is in the log before it is on the wire, so nothing is ever sent twice, whatever dies. The stop
alone goes the other way round: first to the rover, then into the log. Every act, and every refusal of one, is in the
log with who, from where and under which number of the conn.
"""

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from footfall.core.errors import Conflict
from footfall.sequence.commands import Sequence
from footfall.session.access.identity import Identity
from footfall.session.answers.commands import ActedBy, ConnAnswer, RunEnded, SentAnswer
from footfall.session.gate.between import Between
from footfall.session.gate.checks import STALE_AFTER, Facts, require_fit, require_fit_to_go_on
from footfall.session.gate.gate import Gate
from footfall.session.gate.lease import Done
from footfall.session.gate.machine import HOLDS
from footfall.session.gate.runs import Run
from footfall.session.gate_notices import GateNotices, message_of
from footfall.session.log.fold import SessionState
from footfall.session.rover.heard import ENDED, HeardStates
from footfall.session.rover.link import RoverLink
from footfall.session.stop_log import StopLog
from footfall.telemetry.link import HelloMessage, encode

WATCH_PERIOD = 0.1
"""How often a run looks for a lost link or an overdue row, and the conn for the end of its time [s]."""


class EventWriter(Protocol):
    """Writes one event; raises OSError where the disk can't take it."""

    def __call__(self, type: str, payload: Mapping[str, object]) -> object: ...


class Commanding:
    """Owns the gate of one session.

    record: writes an event. record_anyway: the same, but keeps it for later where it can't be written now: it is then
    written before the next one. state: what the log folds to. clock: one that never jumps [s].
    """

    def __init__(
        self,
        link: RoverLink,
        record: EventWriter,
        record_anyway: EventWriter,
        state: Callable[[], SessionState],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        known = state()
        self.gate = Gate(
            stopped=known.stop.latched,
            acknowledged=known.stop.acknowledged,
            stops=max(known.stop.number, known.stop.heard, known.stop.cleared),
            runs=known.runs,
            conn=0 if known.conn is None else known.conn.number,
            epoch=known.epoch,
            clock=clock,
            notify=self._conn_changed,
        )
        self._link = link
        self._tell = GateNotices(link, self.gate, clock)
        self._record = record
        self._record_anyway = record_anyway
        self._state = state
        self._watching = threading.Lock()
        self._watch: threading.Thread | None = None
        self._stop_log = StopLog()
        self._heard = HeardStates()
        self._between: Between | None = None
        self._closing = threading.Event()
        self.latest_end: tuple[float, RunEnded] | None = None
        """When the latest run ended [s since 1970] and how, as its record says, whether or not that is written."""

    # -- the conn ------------------------------------------------------------------------------

    def conn(self, act: str, who: Identity) -> ConnAnswer:
        """See :meth:`footfall.session.commands.Commands.conn_act`."""
        if act == "heartbeat":
            self.gate.act(act, who)
            return self.gate.conn()
        with self._audited(act, who):
            self.gate.act(act, who)
        return self.gate.conn()

    def _conn_changed(self, done: Done) -> None:
        holder = None if done.holder is None else done.holder.as_dict()
        by = None if done.by is None else done.by.as_dict()
        self._record_anyway("conn_changed", {"act": done.act, "by": by, "conn": done.number, "holder": holder})
        self._start_watch()

    # -- arming and runs -----------------------------------------------------------------------

    def arm(self, digest: str, sequence: Sequence, facts: Facts, joint_names: tuple[str, ...], who: Identity) -> str:
        """The token; see :meth:`footfall.session.commands.Commands.arm`."""
        with self._audited("arm", who, sequence=digest):
            self.gate.admit(who)
            require_fit(sequence, facts, joint_names)
            token = self.gate.arm(digest, who)
        self._record("armed", {"sequence": digest, **self._by(who)})
        return token

    def send(
        self,
        token: str,
        sequence: Sequence,
        facts: Facts,
        joint_names: tuple[str, ...],
        who: Identity,
        step_by_step: bool = False,
        facts_later: Callable[[], Facts] | None = None,
    ) -> SentAnswer:
        """See :meth:`footfall.session.commands.Commands.send`. facts_later: as ``facts``, asked in the run."""
        with self._audited("send", who):
            require_fit(sequence, facts, joint_names)
            run = self.gate.begin(token, sequence, who, step_by_step)
        self._between = None if facts_later is None else Between(facts_later, joint_names)
        rows = len(sequence.commands)
        started = {"run": run.number, "mark": run.mark, "sequence": run.digest, "rows": rows, "mode": run.mode}
        try:
            self._record("run_started", {**started, **self._by(who)})
        except BaseException:
            self.gate.end(run.number)
            raise
        self._send_next(run.number)
        self._start_watch()
        return {"run": run.number, "commands": run.command_ids}

    def hold(self, who: Identity) -> None:
        """Nothing goes by itself after the present row. Raises CommandRefused."""
        with self._audited("hold", who):
            run = self.gate.hold(who)
        self._record_anyway("run_held", {"run": run.number, "row": run.row, "reason": run.why, **self._by(who)})

    def go_on(self, who: Identity, facts: Facts, joint_names: tuple[str, ...], going: bool) -> None:
        """Go on with all rows (``going``), or with the next one. Raises CommandRefused."""
        with self._audited("resume" if going else "next", who):
            run = self.gate.steer(who)
            if run.phase == "waiting":
                require_fit_to_go_on(run.sequence, run.row, facts, joint_names)
                if self._between is not None:
                    self._between.passed()
            run = self.gate.go_on(who, going, looked_at=run)
        self._record_anyway("run_resumed", {"run": run.number, "row": run.row, "mode": run.mode, **self._by(who)})
        self._send_next(run.number)

    def abort(self, who: Identity) -> None:
        """Nothing more is sent; the present row is carried out. Raises CommandRefused."""
        with self._audited("abort", who):
            run = self.gate.abort(who)
        self._record_anyway("run_aborted", {"run": run.number, "row": run.row, **self._by(who)})
        if run.over:
            self._end(run.number, "aborted", f"aborted by {who.name}")

    def heard(self, command_id: str, state: str, reason: str) -> None:
        """The rover acknowledged a command, or answered what became of it. The first end that it tells counts."""
        run = self.gate.heard(command_id)
        known = next((one.state for one in self._state().commands if one.id == command_id), "")
        # an end of the row that is out is one: after it, that row is out no more
        ends = run is not None and state in ENDED
        if not self._heard.is_news(command_id, known, state) and not ends:
            self._link.said_again()
            return
        payload: dict[str, object] = {"id": command_id, "reason": reason}
        frame = self._link.frame
        if state == "done" and run is not None and run.sequence.at_rest is not None and frame is not None:
            # how far it gave way by then tells how stiff it is
            payload["posture"] = frame.state.posture.tolist()
        self._record_anyway(f"command_{state}", payload)
        if run is None:
            return
        if state == "refused":
            self._end(run.number, "refused", f"the rover refused row {run.row + 1}: {reason}")
        elif state == "done" and (after := self.gate.row_done(run)) is not None:
            if not after.over:
                if self._between is not None and after.phase == "due":
                    self._between.row_done(after, self._link.received_at)
                self._send_next(run.number)
            elif after.unsent:
                self._end(run.number, "aborted", "aborted")
            else:
                self._end(run.number, "done", "")

    # -- the stop ------------------------------------------------------------------------------

    def stop(self, reason: str, at: float, who: Identity) -> None:
        """Stop the rover and send nothing more until the stop is cleared. Needs neither disk, conn nor session lock.

        at: wall clock. Again while stopped: the rover is told again, and the log of each page or program that asks. A
        log that hangs is not waited for: it is written once it goes on.
        """
        number, first, run = self.gate.latch()
        reached = self._tell.stop()
        with contextlib.suppress(RuntimeError):  # no thread can be started: the stop goes on without being repeated
            self._start_watch()
        if not self._stop_log.is_news(who, first):
            return
        payload = {"stop": number, "reason": reason, "at": at, "rover_reached": reached, "epoch": self.gate.epoch}
        payload |= self._by(who)

        def write() -> None:
            self._record_anyway("stop_requested" if first else "stop_repeated", payload)
            if run is not None:
                self._record_ended(run, "stopped", "stopped" if not reason else f"stopped: {reason}")

        self._stop_log.write(write)

    def stop_acknowledged(self, stop_id: str | None = None) -> None:
        """The rover stands still, because of the stop ``stop_id`` (None: the latest)."""
        if (number := self.gate.stop_acknowledged(stop_id)) is not None:
            self._record_anyway("stop_acknowledged", {"stop": number})

    def clear_stop(self, who: Identity) -> None:
        """Raises Conflict while a connected rover has not acknowledged the stop, or where another stop came.

        Raises CommandRefused unless ``who`` holds the conn, or may hold it and nobody does.
        """
        with self._audited("clear", who):
            self.gate.require_conn_or_free(who)
            self._clear(who)

    def _clear(self, who: Identity) -> None:
        stops = self.gate.stops()
        frame = self._link.frame
        was_stopped = self.gate.stopped
        if was_stopped:
            if self._link.connected and not self.gate.acknowledged:
                raise Conflict("the rover has not acknowledged the stop yet; the stop stays in force")
            self._record("stop_cleared", {"stop": stops, "epoch": self.gate.epoch, **self._by(who)})
        elif frame is None or frame.state.mode != "stopped":
            return
        if self.gate.unlatch(stops, self._tell.clear):
            return
        if was_stopped:
            # the log says cleared, and must not stay behind the gate
            again = {"reason": "asked for while a stop was being cleared", "at": time.time(), "rover_reached": True}
            self._record_anyway("stop_requested", {"stop": self.gate.stops(), **again, "epoch": self.gate.epoch})
        raise Conflict("another stop came while this one was being cleared; it stays in force")

    # -- the link ------------------------------------------------------------------------------

    def connected(self, hello: HelloMessage | None = None) -> int:
        """A rover came (back): it hears of what it may have missed of stops, and is asked what became of commands.

        hello: what it said of itself, None where it can't be told of epochs. Returns the epoch that begins with it.
        """
        # a rover that has heard of no later epoch was stopped by nobody else since
        known = self._state()
        untold = known.stop.untold and hello is not None and (hello.epoch or 0) <= known.epoch
        if self._tell.rover_came(hello, untold) or hello is not None:
            self._start_watch()
        epoch = self.gate.epoch
        self._ask()
        return epoch

    def epoch_heard(self, about: str, epoch: int) -> None:
        """The rover has heard of ``epoch``, and says so about a message of that id."""
        if self._tell.epoch_heard(about, epoch):
            reason = f"another session has told the rover of epoch {epoch}"
            self._record_anyway("epoch_begun", {"epoch": self.gate.epoch, "reason": reason})

    def lost(self, reason: str) -> None:
        """The link is gone: what was not sent stays unsent. A run that waits is checked anew before it goes on."""
        run = self.gate.run
        if run is not None and run.phase != "waiting":
            self._end(run.number, "link_lost", reason)

    def close(self) -> None:
        """End the run, if there is one, the thread that watches it, and the one that records a stop."""
        self._end(None, "closed", "the session was closed")
        self._closing.set()
        if self._watch is not None and self._watch is not threading.current_thread():
            self._watch.join()
        self._stop_log.close()

    def _ask(self) -> None:
        """Ask the rover what became of the commands of the latest run whose end is not known."""
        known = self._state()
        for command in known.commands:
            if command.run == known.runs and command.state == "unknown":
                self._heard.asked(command.id)
                self._tell.ask(command.id)

    # -- rows ----------------------------------------------------------------------------------

    def _send_next(self, number: int) -> None:
        """The row of run ``number`` that is due goes to the rover, if nothing is in its way."""
        if self._between is not None and self._between.waits:
            return  # until the rover was looked at: :meth:`look`
        run, hindered = self.gate.claim(number, self._fresh)
        if run is None:
            waits = self.gate.run
            if hindered in HOLDS and waits is not None:
                self._record_held(waits)
            elif hindered == "telemetry":
                self._end(number, "link_lost", f"the latest telemetry is {self._link.age or 0.0:z.1f} s old")
            return
        message = message_of(run, self.gate.epoch)
        text, row = encode(message), {"sequence": run.digest, "run": run.number, "row": run.row}
        sent = {"id": message.id, **row, "epoch": message.epoch}
        try:
            self._record("command_sent", sent)
        except OSError as err:
            self._end(number, "not_recorded", f"the log can't be written, so nothing more is sent: {err}")
            return
        try:
            went = self.gate.release(run, lambda: self._link.send(text), self._fresh)
        except Conflict as err:
            self._end(number, "link_lost", err.message)
            return
        if not went:
            # a stop came between the log and the wire, or an abort, or the conn was lost
            self._record_anyway("command_refused", {"id": run.command_id, "reason": "held back: the run had ended"})
            self._end(number, "held_back", "what let the row go had ended when it was to go")

    def _look_between(self, run: Run, between: Between) -> None:
        """Go on with the next foot move where the rover stands as the one before was to leave it, else hold."""
        against = between.look(run, self._link.received_at)
        if against and (held := self.gate.hold_for(run, against)) is not None:
            self._record_held(held)
        elif against == "":
            self._send_next(run.number)

    def _record_held(self, run: Run) -> None:
        """It waits, as nobody asked."""
        held = {"run": run.number, "row": run.row, "reason": run.why, "by": None, "conn": self.gate.conn_number}
        self._record_anyway("run_held", held)

    @property
    def _fresh(self) -> bool:
        age = self._link.age_since_connected
        return self._link.connected and age is not None and age <= STALE_AFTER

    def _end(self, number: int | None, outcome: str, reason: str) -> None:
        run = self.gate.end(number)
        if run is not None:
            given_up = run.phase == "out" and outcome in ("overdue", "link_lost")
            if given_up:
                # the row may be held back on the way: should it come after all, it comes too late
                self.gate.new_epoch()
            self._record_ended(run, outcome, reason)
            if given_up:
                self._tell.epoch()
            if outcome == "overdue":
                self._ask()

    def _record_ended(self, run: Run, outcome: str, reason: str) -> None:
        ended: RunEnded = {"run": run.number, "outcome": outcome, "reason": reason, "unsent": run.unsent}
        self.latest_end = time.time(), ended
        self._record_anyway("run_ended", {**ended, "epoch": self.gate.epoch})

    def _by(self, who: Identity) -> ActedBy:
        return {"by": who.as_dict(), "conn": self.gate.conn_number}

    @contextlib.contextmanager
    def _audited(self, act: str, who: Identity, **about: Any) -> Iterator[None]:
        try:
            yield
        except Conflict as err:
            payload = {"act": act, "check": err.details.get("check", "conflict"), "reason": err.message, **about}
            self._record_anyway("act_refused", {**payload, **self._by(who)})
            raise

    def _start_watch(self) -> None:
        with self._watching:
            if self._watch is None and not self._closing.is_set():
                self._watch = threading.Thread(target=self._watch_runs, name="footfall-runs", daemon=True)
                self._watch.start()

    def _watch_runs(self) -> None:
        while not self._closing.wait(WATCH_PERIOD):
            try:
                self.look()
            except Exception:
                # the next look has to come all the same: a stop may have to be told again
                logging.getLogger(__name__).exception("a look at run and rover failed")

    def look(self) -> None:
        """End what time has ended: the conn, a run whose rover fell silent or whose row is overdue."""
        self.gate.pass_time()
        self._tell.remind()
        run = self.gate.run
        if run is None or run.phase == "waiting":
            return
        age = self._link.age
        if age is None or age > STALE_AFTER:
            self.lost(f"the rover has sent no telemetry for {age or 0.0:z.1f} s")
        elif self._between is not None and run.phase == "due":
            self._look_between(run, self._between)
        elif late := self.gate.overdue(self._link.light_time.round_trip):
            self._end(run.number, "overdue", late)
