"""The command gate as a state machine: what each input makes of each state. Pure; tokens and times are handed in.

::

    idle ──arm──▶ armed ──begin──▶ running ──last row done──▶ idle
      ▲             │                 │
      └── expired ──┴── refused row, lost link, overdue row, abort, stop

Arming takes the conn (:mod:`footfall.session.gate.lease`) where nobody holds it. An arming and a run stand under the
number of the conn that they began with: under another one nothing goes. Beside that stands the latch of the stop: while
it is set nothing is armed, begun or released. Every refusal is a CommandRefused that names its ``check``.

Every row goes in the epoch of its moment. A stop, a rover that comes, and a row that is given up begin a new one; the
rover carries nothing out that is of an older one than it has heard of. Epochs only grow. Nothing is armed, begun, gone
on with or released before the rover has confirmed the present one: it would refuse what it is sent.
"""

import secrets
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

from footfall.core.errors import CommandRefused
from footfall.sequence.commands import Sequence
from footfall.session.access.identity import Identity
from footfall.session.answers.commands import GateAnswer
from footfall.session.gate import lease
from footfall.session.gate.lease import Conn, Done
from footfall.session.gate.runs import STEP_BY_STEP, Run

ARMED_FOR = 10.0
"""An arming that is not used expires after this [s]."""


@dataclass(frozen=True)
class Armed:
    """A sequence that may be sent once. fence: number of the conn that it was armed under."""

    token: str
    digest: str
    until: float
    fence: int


@dataclass(frozen=True)
class Latch:
    """The stop. count: how often it was asked for; cleared: how many of those were before it was cleared last."""

    stopped: bool = False
    acknowledged: bool = False
    count: int = 0
    cleared: int = 0


@dataclass(frozen=True)
class State:
    """runs: number of the latest run. done: what became of the conn in the latest input.

    epoch: of what goes to the rover now. heard: the newest that the rover on the link has confirmed; None where it is
    not told of epochs.
    """

    conn: Conn = field(default_factory=Conn)
    runs: int = 0
    epoch: int = 0
    heard: int | None = 0
    stop: Latch = field(default_factory=Latch)
    armed: Armed | None = None
    run: Run | None = None
    done: tuple[Done, ...] = field(default=(), compare=False)


def passed(state: State, now: float) -> State:
    """What time alone does to the conn."""
    return _with_conn(state, lease.passed(state.conn, now))


def conn(state: State, act: str, who: Identity, now: float) -> State:
    """An act on the conn: one of CONN_ACTS."""
    return _with_conn(state, CONN_ACTS[act](state.conn, who, now))


def unrenewed(before: State, after: State) -> State:
    """``after``, where something acted for the holder of the conn: that is no sign of the holder."""
    if after.conn.number != before.conn.number or after.conn.holder is None:
        return after
    return replace(after, conn=replace(after.conn, renewed=before.conn.renewed))


CONN_ACTS = {
    "take": lease.take,
    "release": lease.release,
    "request": lease.ask,
    "grant": lease.grant,
    "deny": lease.deny,
    "heartbeat": lease.renew,
}


def admitted(state: State, who: Identity, now: float) -> State:
    """Nothing is in the way of arming, and ``who`` holds the conn, or takes it where nobody does."""
    _require_open(state)
    return conn(state, "take", who, now)


def arm(state: State, who: Identity, digest: str, token: str, now: float) -> State:
    """Arm a sequence that was found fit; a newer arming replaces an older one."""
    state = admitted(state, who, now)
    _require_epoch_known(state)
    return replace(state, armed=Armed(token, digest, now + ARMED_FOR, state.conn.number))


def armed_sequence(state: State, token: str, now: float) -> str:
    """Digest of the sequence that ``token`` sends."""
    armed = state.armed
    if armed is None or not secrets.compare_digest(armed.token.encode(), token.encode()):
        _refuse("arming", "nothing is armed with this token; a token sends once")
    if now > armed.until:
        _refuse("arming", f"the arming expired; a token is good for {ARMED_FOR:g} s")
    present, _ = lease.passed(state.conn, now)
    if present.holder is None or present.number != armed.fence:
        _refuse("conn", "the conn was lost after arming; take it and arm again", number=present.number)
    return armed.digest


def begin(
    state: State, who: Identity, token: str, sequence: Sequence, mark: str, now: float, step_by_step: bool = False
) -> State:
    """Use up a token and begin a run, whose first row is due. mark: of the run, such as none had before."""
    state = passed(state, now)
    _require_open(state)
    digest = armed_sequence(state, token, now)
    state = conn(state, "heartbeat", who, now)
    _require_epoch_known(state)
    run = Run(state.runs + 1, mark, digest, sequence, who, state.conn.number)
    if step_by_step:
        run = replace(run, going=False, why=STEP_BY_STEP)
    return replace(state, runs=run.number, run=run, armed=None)


def hindrance(state: State, now: float, fresh: bool) -> str:
    """What keeps rows from going: "stop", "conn", "telemetry", "epoch", or ""."""
    run = state.run
    if state.stop.stopped or run is None or run.aborted:
        return "stop"
    present, _ = lease.passed(state.conn, now)
    if present.holder is None or present.number != run.fence:
        return "conn"
    if not fresh:
        return "telemetry"
    return "" if epoch_known(state) else "epoch"


HOLDS = {
    "conn": "the conn was lost or changed hands; whoever holds it may go on or abort",
    "epoch": "another epoch has begun, which the rover has not confirmed yet; go on once it has",
}
"""Hindrances over which a run waits, and what it says then."""


def claim(state: State, number: int, now: float, fresh: bool) -> tuple[State, Run | None, str]:
    """Whoever will release the row that is due claims it: nobody else gets it. The run, or None and what hinders it.

    Without the conn the run waits for a holder, and in an epoch that the rover has not confirmed for whoever goes on.
    """
    run = state.run
    if run is None or run.number != number or run.phase != "due":
        return state, None, ""
    hindered = hindrance(state, now, fresh)
    if hindered in HOLDS:
        return replace(state, run=run.held(HOLDS[hindered])), None, hindered
    if hindered:
        return state, None, hindered
    claimed = replace(run, phase="claimed")
    return replace(state, run=claimed), claimed, ""


def release(state: State, run: Run, now: float, fresh: bool) -> State | None:
    """The claimed row of ``run`` goes; None where it may not any more."""
    present = state.run
    if present is None or not present.is_at(run) or present.phase != "claimed" or hindrance(state, now, fresh):
        return None
    return replace(state, run=present.released(now))


def heard(state: State, command_id: str) -> State | None:
    """The rover acknowledged a command: None unless it is the row that is out."""
    run = state.run
    if run is None or run.phase != "out" or run.command_id != command_id:
        return None
    return replace(state, run=replace(run, received=True))


def row_done(state: State, run: Run) -> State | None:
    """The row of ``run`` that is out is done; None where it is none."""
    present = state.run
    if present is None or present.phase != "out" or not present.is_at(run):
        return None
    return replace(state, run=present.row_done())


def steered(state: State, who: Identity, now: float) -> tuple[State, Run]:
    """The holder of the conn steers the run; where nobody holds it, ``who`` takes it. Raises CommandRefused."""
    state = conn(state, "take", who, now)
    if state.run is None:
        _refuse("run", "nothing is being sent to the rover")
    return state, state.run


def hold(state: State, who: Identity, now: float) -> State:
    """The run waits after its present row."""
    state, run = steered(state, who, now)
    return state if run.aborted else replace(state, run=run.held(f"held by {who.name}"))


def held_for(state: State, run: Run, why: str) -> State | None:
    """The run waits before the row that is due, as nobody asked but the rover's stance; None where it is elsewhere."""
    present = state.run
    if present is None or not present.is_at(run) or present.phase != "due":
        return None
    return replace(state, run=present.held(why))


def go_on(state: State, who: Identity, now: float, going: bool, looked_at: Run | None = None) -> State:
    """The run that waits goes on: with all rows (``going``), or with one. Asked of one that goes: it goes on so.

    looked_at: the run as it was when it was asked whether it may go on; one that came to wait since may not.
    """
    state, run = steered(state, who, now)
    if state.stop.stopped:
        _refuse("stop", "a stop is in force; clear it first")
    if run.aborted:
        _refuse("run", f"run {run.number} was aborted; it does not go on", run=run.number)
    if not going and run.phase != "waiting":
        _refuse("run", f"row {run.row + 1} is still under way; ask for the next one once it waits", row=run.row)
    if run.phase == "waiting":
        if looked_at is not None and not (looked_at.phase == "waiting" and run.is_at(looked_at)):
            _refuse("run", f"row {run.row} has ended just now, the rover was looked at before that; ask again")
        _require_epoch_known(state)
    return replace(state, run=run.gone_on(who, state.conn.number, going))


def abort(state: State, who: Identity, now: float) -> State:
    """Nothing more is sent; the row that is out is carried out."""
    state, run = steered(state, who, now)
    return replace(state, run=run.abandoned())


def end(state: State, number: int | None = None) -> State:
    """No run any more (``number``: only that one is ended)."""
    run = state.run
    return state if run is None or (number is not None and run.number != number) else replace(state, run=None)


def latch(state: State) -> State:
    """Set the stop: whatever is armed or running ends, and what is on its way becomes outdated."""
    stop = state.stop
    latched = Latch(True, stop.stopped and stop.acknowledged, stop.count + 1, stop.cleared)
    state = state if stop.stopped else new_epoch(state)
    return replace(state, stop=latched, armed=None, run=None)


def require_conn_or_free(state: State, who: Identity, now: float) -> State:
    """``who`` holds the conn, or is a commander and nobody does: what clearing a stop takes."""
    lease.require_commander(who)
    state = passed(state, now)
    if state.conn.holder is not None:
        lease.require_holder(state.conn, who)
    return state


def unlatch(state: State, count: int | None = None) -> State | None:
    """Clear the stop, unless there were more than ``count`` by now: then None."""
    stop = state.stop
    if count is not None and stop.count != count:
        return None
    return replace(state, stop=Latch(False, False, stop.count, stop.count + 1))


def acknowledged(state: State, yes: bool) -> State:
    """The rover stands because of the stop, or (another rover came) does not say so any more."""
    return replace(state, stop=replace(state.stop, acknowledged=yes and state.stop.stopped))


def new_epoch(state: State, beyond: int = 0) -> State:
    """What is on its way to the rover is outdated once it hears of this. beyond: the new epoch is a later one."""
    return replace(state, epoch=max(state.epoch, beyond) + 1)


def rover_came(state: State, beyond: int, hears_epochs: bool) -> State:
    """A rover is on the link, or has come back: what went down before is outdated. hears_epochs: it confirms them."""
    return replace(new_epoch(acknowledged(state, False), beyond), heard=0 if hears_epochs else None)


def epoch_heard(state: State, epoch: int, confirms: bool) -> State:
    """The rover knows of ``epoch``; where that is later than any of this session, another session told it.

    confirms: it says so because this session told it.
    """
    if confirms and state.heard is not None:
        state = replace(state, heard=max(state.heard, epoch))
    return new_epoch(state, epoch) if epoch > state.epoch else state


def epoch_known(state: State) -> bool:
    """Whether the rover on the link has confirmed the present epoch, or is not told of it."""
    return state.heard is None or state.heard >= state.epoch


def as_dict(state: State, now: float) -> GateAnswer:
    """Plain JSON for the interface."""
    run, armed = state.run, state.armed
    left = None if armed is None else armed.until - now
    is_armed = left is not None and left > 0
    return {
        "state": "sending" if run else "armed" if is_armed else "idle",
        "stopped": state.stop.stopped,
        "stop_acknowledged": state.stop.acknowledged,
        "epoch": state.epoch,
        "epoch_known": epoch_known(state),
        "run": run.number if run else None,
        "row": run.row if run else None,
        "sequence": run.digest if run else armed.digest if armed and is_armed else None,
        "expires_in": left if is_armed else None,
        "mode": run.mode if run else None,
        "waiting": bool(run and run.phase == "waiting"),
        "why": run.why if run else "",
        "aborted": bool(run and run.aborted),
    }


def _require_open(state: State) -> None:
    if state.stop.stopped:
        _refuse("stop", "a stop is in force; clear it first")
    if state.run is not None:
        _refuse("busy", f"run {state.run.number} is still being sent", run=state.run.number)


def _require_epoch_known(state: State) -> None:
    if not epoch_known(state):
        _refuse(
            "epoch",
            f"the rover has not confirmed epoch {state.epoch} yet, and would take what is sent for something that was "
            "held back on the way; it is told again every second (and the light time): arm once it has answered",
            epoch=state.epoch,
            confirmed=state.heard,
        )


def _with_conn(state: State, step: lease.Step) -> State:
    present, done = step
    return replace(state, conn=present, done=state.done + done)


def _refuse(check: str, message: str, **details: Any) -> NoReturn:
    raise CommandRefused(message, check=check, **details)
