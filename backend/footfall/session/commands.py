"""Commanding the rover of a session: the conn, arming, sending, steering what is sent, and the stop.

``who`` asks is part of every act; a script that holds the session in its own process is LOCAL.
"""

import time

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.errors import CommandRefused
from footfall.sequence.commands import Sequence
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.answers.commands import ArmedAnswer, ConnAnswer, GateAnswer, RowAnswer, RunAnswer, SentAnswer
from footfall.session.carried_out import carried_out
from footfall.session.core import SessionCore
from footfall.session.gate.checks import Facts
from footfall.session.gate.runs import command_id
from footfall.session.jobs.requests import WalkRequest
from footfall.session.least_clearances import LeastClearances
from footfall.session.log.event import next_event
from footfall.session.log.fold import SessionState, fold
from footfall.session.log.fold_commands import CommandRecord, RunRecord
from footfall.session.products.compared import UpToDate
from footfall.session.products.executions import Executions
from footfall.session.products.outcomes import Outcomes
from footfall.session.products.sequences import Sequences
from footfall.session.rover.linked import LinkedRover


class Commands:
    """What the rover is told to do, and who may; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(
        self,
        core: SessionCore,
        rover: LinkedRover,
        fits: UpToDate,
        executions: Executions,
        sequences: Sequences,
        outcomes: Outcomes,
        least_clearances: LeastClearances,
    ) -> None:
        self._core, self._rover, self._fits = core, rover, fits
        self._executions, self._sequences, self._outcomes = executions, sequences, outcomes
        self._least_clearances = least_clearances

    @property
    def gate(self) -> GateAnswer:
        """The command gate, as plain JSON."""
        return self._rover.commanding.gate.as_dict()

    @property
    def conn(self) -> ConnAnswer:
        """Who holds the conn, for how long, and who asks for it, as plain JSON."""
        return self._rover.commanding.gate.conn()

    def holds_conn(self, who: Identity) -> bool:
        """Whether ``who``, as that page or program, holds the conn."""
        return self._rover.commanding.gate.holds_conn(who)

    def conn_act(self, act: str, who: Identity = LOCAL) -> ConnAnswer:
        """Take, release, request, grant, deny or renew ("heartbeat") the conn; who holds it then.

        Raises CommandRefused where it is another's, or the role does not allow it.
        """
        return self._rover.commanding.conn(act, who)

    def arm(self, sequence_digest: str | None = None, who: Identity = LOCAL) -> ArmedAnswer:
        """Check that a sequence may be sent now; the token of the answer sends it once, for a short time.

        Takes the conn where nobody holds it. Raises CommandRefused; its details name the check that failed and by how
        much.
        """
        begun = time.monotonic()
        digest = self._sequences.named(sequence_digest)
        sequence, names = self._core.typed(Sequence, digest), self._core.layout.joint_names
        token = self._rover.commanding.arm(digest, sequence, self._facts(digest), names, who)
        took, left = time.monotonic() - begun, self.gate["expires_in"] or 0.0
        return {"token": token, "sequence": digest, "took": took, "expires_in": left, "conn": self.conn}

    def send(
        self, token: str, expected: str | None = None, who: Identity = LOCAL, step_by_step: bool = False
    ) -> SentAnswer:
        """Begin to send the armed sequence; everything is checked again. Raises CommandRefused.

        expected: digest of the sequence that the sender means; where another one was armed, nothing is sent.
        step_by_step: the run waits after every row until :meth:`next_row`.
        """
        digest = self._rover.commanding.gate.armed_sequence(token)
        if expected is not None and expected != digest:
            raise CommandRefused(
                "the token was armed for another version of the sequence; arm this one",
                check="arming",
                armed=digest,
                asked=expected,
            )
        sequence, names = self._core.typed(Sequence, digest), self._core.layout.joint_names

        def facts() -> Facts:
            return self._facts(digest)

        return self._rover.commanding.send(token, sequence, facts(), names, who, step_by_step, facts)

    def hold(self, who: Identity = LOCAL) -> None:
        """Nothing more goes to the rover by itself; the present row is carried out. Raises CommandRefused."""
        self._rover.commanding.hold(who)

    def resume(self, who: Identity = LOCAL) -> None:
        """The rows that are left go one after another. Raises CommandRefused, naming the check."""
        self._go_on(who, going=True)

    def next_row(self, who: Identity = LOCAL) -> None:
        """The next row goes, and the run waits again after it. Raises CommandRefused, naming the check."""
        self._go_on(who, going=False)

    def abort(self, who: Identity = LOCAL) -> None:
        """Nothing more is sent; the present row is carried out (to break it off, stop). Raises CommandRefused."""
        self._rover.commanding.abort(who)

    @property
    def run(self) -> RunAnswer | None:
        """The latest run as plain JSON, None before the first: its record, and of every row how far it came and when;
        compared: what came of it, see :meth:`.Outcomes.latest`; least_clearances: see :meth:`.LeastClearances.of`.

        State of a row: "queued", as its command's record says, or "unsent" where the run ended before it. A run that
        has ended is told so also while the log can't be written.
        """
        state = self._with_the_latest_end()
        run = state.run
        if run is None:
            return None
        sent = {one.row: one for one in state.commands if one.run == run.number}
        return {
            "number": run.number,
            "sequence": run.sequence,
            "rows": [_row(run, row, sent.get(row)) for row in range(run.rows)],
            "mode": run.mode,
            "by": run.by,
            "queued": run.queued,
            "state": run.state,
            "reason": run.reason,
            "outcome": run.outcome,
            "ended": run.ended,
            "compared": self._outcomes.latest(),
            "least_clearances": self._least_clearances.of(run.number),
        }

    def end_of_run(self, number: int | None) -> tuple[str, str] | None:
        """Outcome of a run, and the reason; None while it goes on, and of one that never began."""
        run = self._core.state.run
        if run is not None and run.number == number:
            return (run.outcome, run.reason) if run.state == "ended" else None
        # another has begun since: the log has how this one ended
        ends = (event.payload for event in reversed(self._core.events()) if event.type == "run_ended")
        return next(((end["outcome"], end["reason"]) for end in ends if end.get("run") == number), None)

    def _with_the_latest_end(self) -> SessionState:
        state, latest = self._core.state, self._rover.commanding.latest_end
        if state.run is None or state.run.state == "ended" or latest is None or latest[1]["run"] != state.run.number:
            return state
        at, ended = latest
        return fold(state, next_event(None, at, "run_ended", ended))

    def stop(self, reason: str = "", who: Identity = LOCAL) -> GateAnswer:
        """Stop the rover, now; stays in force until cleared. Anybody may; works without rover, disk or free lock."""
        self._rover.commanding.stop(reason, time.time(), who)
        return self.gate

    def clear_stop(self, who: Identity = LOCAL) -> GateAnswer:
        """Raises Conflict while a connected rover has not acknowledged the stop, CommandRefused without the conn."""
        self._rover.commanding.clear_stop(who)
        return self.gate

    def require_may_leave(self, who: Identity) -> None:
        """What concerns the rover of whoever holds the conn, as handing it to another session, is for them; where
        nobody holds it, for any commander.

        Raises CommandRefused that names the holder.
        """
        self._rover.commanding.gate.require_conn_or_free(who)

    def _go_on(self, who: Identity, going: bool) -> None:
        run = self._rover.commanding.gate.steer(who)
        self._rover.commanding.go_on(who, self._facts(run.digest), self._core.layout.joint_names, going)

    def _facts(self, sequence: str) -> Facts:
        link, dem = self._rover.link, self._core.state.dem
        done = sequence in carried_out(self._core.state, self._sequences.rows_of)
        ground, weight = self._sequences.planned_on(sequence), self._weight(sequence)
        frame = self._rover.frame
        on_map = None if frame is None else self._fits.place_on_map(frame.state)
        robot = None if self._core.described is not None else self._core.robot
        reach, sliding = self._core.reach, self._core.layout.sliding
        age = link.age_since_connected
        return Facts(link.connected, frame, age, dem, ground, weight, done, robot, on_map, reach, sliding)

    def _weight(self, sequence: str) -> float:
        """Weight of rover and payload that a sequence was planned with [N]; of a rigid step, that of its robot."""
        from footfall.balance.payload import loaded

        if self._core.described is not None:
            return self._core.any_robot.mass * BalanceSettings().gravity
        executed, behind = self._executions.executed_with(sequence), self._core.state.plan_behind(sequence)
        balance = BalanceSettings()
        if executed is not None:
            balance = executed.compliance.balance
        elif behind is not None and behind.settings is not None:
            asked = self._core.get(behind.settings)
            balance = asked.settings.balance if isinstance(asked, WalkRequest) else balance
        mass, _ = loaded(self._core.robot, np.zeros(3), balance)
        return mass * balance.gravity


def _row(run: RunRecord, row: int, record: CommandRecord | None) -> RowAnswer:
    state, reason, times = "queued", "", {"queued": run.queued}
    if record is not None:
        state, reason, times = record.state, record.reason, {**times, **(record.times or {})}
    elif run.state == "ended":
        state, reason = "unsent", run.reason
        times |= {} if run.ended is None else {"unsent": run.ended}
    number = command_id(run.sequence, run.number, run.mark, row)
    return {"row": row, "id": number, "state": state, "reason": reason, "times": times}
