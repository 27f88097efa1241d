"""The gate of one session: the state machine behind a lock, with a clock and secret tokens.

No input or output; its lock is held for moments only, so a stop never waits for a disk or a listener.
"""

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import cast

from footfall.sequence.commands import Sequence
from footfall.session.access.acting import acts_by_itself
from footfall.session.access.identity import Identity
from footfall.session.answers.commands import ConnAnswer, GateAnswer
from footfall.session.gate import machine
from footfall.session.gate.lease import Conn, Done
from footfall.session.gate.machine import Latch, State
from footfall.session.gate.runs import Run


class Gate:
    """:mod:`footfall.session.gate.machine`, thread-safe; its methods raise CommandRefused as the functions there.

    stops, runs, conn, epoch: the latest stop's, run's, conn's and epoch's numbers that the session knows; all go on
    from there.
    notify: is called, with the lock free, with whatever became of the conn.
    """

    def __init__(
        self,
        *,
        stopped: bool = False,
        acknowledged: bool = False,
        stops: int = 0,
        runs: int = 0,
        conn: int = 0,
        epoch: int = 0,
        clock: Callable[[], float] = time.monotonic,
        notify: Callable[[Done], None] = lambda done: None,
    ) -> None:
        self._clock, self._notify = clock, notify
        self._guard = threading.Lock()
        self._state = State(Conn(conn), runs, epoch, stop=Latch(stopped, acknowledged, stops, stops))
        # ids of another process must not look like ours: its acknowledgements may still be on their way
        self._stop_prefix = f"stop-{secrets.token_hex(4)}"

    # -- the conn ------------------------------------------------------------------------------

    def act(self, act: str, who: Identity) -> None:
        """Take, release, request, grant, deny or renew ("heartbeat") the conn."""
        self._become(lambda state, now: machine.conn(state, act, who, now))

    def pass_time(self) -> None:
        """Let requests be granted and the lease run out where it is time."""
        self._become(machine.passed)

    def conn(self) -> ConnAnswer:
        """Who holds the conn, as plain JSON."""
        return self._state.conn.as_dict(self._clock())

    @property
    def conn_holder(self) -> Identity | None:
        """Who holds the conn; None: nobody."""
        return self._state.conn.holder

    @property
    def conn_number(self) -> int:
        """Number of the latest holding of the conn."""
        return self._state.conn.number

    def holds_conn(self, who: Identity) -> bool:
        """Whether ``who`` holds the conn; one whose time ran out a moment ago counts."""
        return self._state.conn.held_by(who)

    # -- arming and runs -----------------------------------------------------------------------

    def admit(self, who: Identity) -> None:
        """Take the conn where nobody holds it; nothing must be in the way of arming."""
        self._become(lambda state, now: machine.admitted(state, who, now))

    def arm(self, digest: str, who: Identity) -> str:
        """Arm a sequence that was found fit; the token that sends it, once, within ARMED_FOR."""
        token = secrets.token_hex(16)
        self._become(lambda state, now: machine.arm(state, who, digest, token, now))
        return token

    def armed_sequence(self, token: str) -> str:
        """Digest of the sequence that ``token`` sends."""
        with self._guard:
            return machine.armed_sequence(self._state, token, self._clock())

    def begin(self, token: str, sequence: Sequence, who: Identity, step_by_step: bool = False) -> Run:
        """Use up a token and begin a run; nothing is released yet."""
        mark = secrets.token_hex(4)
        return _run(
            self._become(lambda state, now: machine.begin(state, who, token, sequence, mark, now, step_by_step))
        )

    def claim(self, number: int, fresh: bool) -> tuple[Run | None, str]:
        """The row of run ``number`` that is due, for whoever will release it; or None and what hinders it, if anything.

        fresh: of the telemetry. Hindrances: "conn", "epoch" (then the run waits), "telemetry", "stop".
        """
        with self._guard:
            self._state, run, hindered = machine.claim(self._state, number, self._clock(), fresh)
            return run, hindered

    def release(self, run: Run, transmit: Callable[[], None], fresh: bool) -> bool:
        """Let the claimed row of ``run`` go to the rover, unless something came between. Whether it went.

        ``transmit`` is called with the lock held, so that a stop is either before it or after it on the wire.
        """
        with self._guard:
            state = machine.release(self._state, run, self._clock(), fresh)
            if state is None:
                return False
            self._state = state
            transmit()
            return True

    def heard(self, command_id: str) -> Run | None:
        """The rover said something of a command: the present run if the command is the row that is out, else None."""
        return self._become_if(lambda state: machine.heard(state, command_id))

    def row_done(self, run: Run) -> Run | None:
        """The row of ``run`` is done: the run after it, or None where that row is not out."""
        return self._become_if(lambda state: machine.row_done(state, run))

    def steer(self, who: Identity) -> Run:
        """The run that ``who`` may steer: as holder of the conn, which is taken where nobody holds it."""
        return _run(self._become(lambda state, now: machine.steered(state, who, now)[0]))

    def hold(self, who: Identity) -> Run:
        """The run waits after its present row."""
        return _run(self._become(lambda state, now: machine.hold(state, who, now)))

    def hold_for(self, run: Run, why: str) -> Run | None:
        """``run`` waits before the row that is due; None where it is not there any more."""
        return self._become_if(lambda state: machine.held_for(state, run, why))

    def go_on(self, who: Identity, going: bool, looked_at: Run | None = None) -> Run:
        """The run goes on: with all rows (``going``), or with one. looked_at: as it was when the rover was."""
        return _run(self._become(lambda state, now: machine.go_on(state, who, now, going, looked_at)))

    def abort(self, who: Identity) -> Run:
        """Nothing more is sent; the run as it is then, over unless a row is out."""
        return _run(self._become(lambda state, now: machine.abort(state, who, now)))

    def end(self, number: int | None = None) -> Run | None:
        """End the present run (``number``: only that one); the run as it was, or None."""
        with self._guard:
            before, self._state = self._state, machine.end(self._state, number)
            return before.run if self._state.run is None else None

    def overdue(self, light: float = 0.0) -> str | None:
        """Why the row that is out takes too long, or None. light: how long command and answer are on their way [s]."""
        run = self._state.run
        return None if run is None else run.overdue(self._clock(), light)

    @property
    def run(self) -> Run | None:
        """The run that is being sent."""
        return self._state.run

    # -- the stop ------------------------------------------------------------------------------

    def latch(self) -> tuple[int, bool, Run | None]:
        """Set the stop: its number, whether it was not set before, and the run that it ended."""
        with self._guard:
            before, self._state = self._state, machine.latch(self._state)
            return self._state.stop.count, not before.stop.stopped, before.run

    def remind(self, transmit: Callable[[], object]) -> None:
        """Call ``transmit`` where a stop is in force that the rover has not acknowledged.

        With the lock held: no clearing comes between, and is undone by a stop that was already cleared.
        """
        with self._guard:
            if self._state.stop.stopped and not self._state.stop.acknowledged:
                transmit()

    def remind_of_clearing(self, transmit: Callable[[], object]) -> None:
        """Call ``transmit`` where no stop is in force; with the lock held: no stop comes between, and is undone."""
        with self._guard:
            if not self._state.stop.stopped:
                transmit()

    def require_conn_or_free(self, who: Identity) -> None:
        """The holder of the conn may clear a stop, or leave the session; where nobody holds it, any commander."""
        self._become(lambda state, now: machine.require_conn_or_free(state, who, now))

    def unlatch(self, stops: int | None = None, transmit: Callable[[], None] = lambda: None) -> bool:
        """Clear the stop, unless there were more than ``stops`` stops by now. Whether it was cleared.

        ``transmit`` is called with the lock held: a later stop comes later on the wire too, and wins.
        """
        with self._guard:
            state = machine.unlatch(self._state, stops)
            if state is None:
                return False
            self._state = state
            transmit()
            return True

    def rover_changed(self, beyond: int = 0, hears_epochs: bool = True) -> bool:
        """A rover has come to the link, which has acknowledged no stop yet. Whether a stop is in force.

        beyond: the epoch that begins with it is a later one than this. hears_epochs: it has to confirm it.
        """
        with self._guard:
            self._state = machine.rover_came(self._state, beyond, hears_epochs)
            return self._state.stop.stopped

    def new_epoch(self) -> None:
        """Whatever is on its way to the rover becomes outdated."""
        with self._guard:
            self._state = machine.new_epoch(self._state)

    def epoch_heard(self, epoch: int, confirms: bool) -> bool:
        """The rover knows of ``epoch`` (confirms: as it was told): whether that was later, and a new one began."""
        with self._guard:
            before, self._state = self._state, machine.epoch_heard(self._state, epoch, confirms)
            return self._state.epoch > before.epoch

    @property
    def epoch(self) -> int:
        """In which commands are released now."""
        return self._state.epoch

    @property
    def epoch_known(self) -> bool:
        """Whether the rover on the link has confirmed the present epoch, or is not told of it."""
        return machine.epoch_known(self._state)

    def stop_acknowledged(self, stop_id: str | None = None) -> int | None:
        """The rover stands: up to which stop, None where that is no news.

        stop_id: the stop that it tells of; one that was cleared since is none.
        """
        with self._guard:
            stop = self._state.stop
            if stop_id is not None and stop_id not in (self._named(n) for n in range(stop.cleared, stop.count + 1)):
                return None
            self._state = machine.acknowledged(self._state, True)
            return stop.count if stop.stopped and not stop.acknowledged else None

    @property
    def stop_id(self) -> str:
        """Name of the latest stop, for the message that tells the rover."""
        return self._named(self._state.stop.count)

    def stops(self) -> int:
        """How often a stop was asked for; see :meth:`unlatch`."""
        return self._state.stop.count

    @property
    def stopped(self) -> bool:
        """Whether a stop is in force."""
        return self._state.stop.stopped

    @property
    def acknowledged(self) -> bool:
        """Whether the rover has acknowledged the stop that is latched."""
        return self._state.stop.acknowledged

    def as_dict(self) -> GateAnswer:
        """Plain JSON for the interface."""
        return machine.as_dict(self._state, self._clock())

    def _become(self, change: Callable[[State, float], State]) -> State:
        with self._guard:
            state = change(self._state, self._clock())
            if acts_by_itself():
                state = machine.unrenewed(self._state, state)
            self._state = replace(state, done=())
        for done in state.done:
            self._notify(done)
        return state

    def _become_if(self, change: Callable[[State], State | None]) -> Run | None:
        """The run after a change; None where it changes nothing."""
        with self._guard:
            state = change(self._state)
            if state is None:
                return None
            self._state = state
            return state.run

    def _named(self, number: int) -> str:
        return f"{self._stop_prefix}-{number}"


def _run(state: State) -> Run:
    return cast(Run, state.run)  # those who ask have just made or steered it
