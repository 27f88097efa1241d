"""What the log says of commands, runs, the stop and the conn: their records, and what each event changes of them.

How far a command came: sent (released to the rover), received (acknowledged), started, then done, refused (failed) or
unknown. Unknown may still become done or refused when the rover is heard again. A run that has ended has no row that
goes on, whichever record comes first: what the rover says late of its beginning is a time, no state. Rows of a run
without a record were not sent.
"""

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any, Protocol

from footfall.core.value import LATER, Value, value
from footfall.session.log.event import Event

OPEN_STATES = ("sent", "received", "started")
"""States of a command whose end is not known yet; the others are "done", "refused", "unknown"."""

MOST_ROWS = 100_000
"""Of one run: every one of them is told to whoever looks at the session."""

Payload = Mapping[str, Any]


@value
class CommandRecord(Value):
    """One command sent to the rover and how far it came. time: of the latest change; times: state → when it came."""

    id: str
    sequence: str
    run: int
    row: int
    state: str
    reason: str
    time: float
    times: Mapping[str, float] | None = field(default=None, metadata=LATER)


@value
class StopRecord(Value):
    """The stop. latched: nothing is sent until it is cleared; acknowledged: the rover said that it stands.

    number: of the latest stop, which counts up for ever; heard, cleared: up to which one the rover on the link said
    that it stands, and up to which one they were cleared. What is in force goes by them: the record of a stop may come
    after those of what answers it. untold: it was cleared, and nothing since shows that the rover was told of that.
    """

    latched: bool = False
    acknowledged: bool = False
    reason: str = ""
    time: float | None = None
    number: int = field(default=0, metadata=LATER)
    heard: int = field(default=0, metadata=LATER)
    cleared: int = field(default=0, metadata=LATER)
    untold: bool = field(default=False, metadata=LATER)


@value
class RunRecord(Value):
    """The latest run. state: "going", "held", "aborting" or "ended"; outcome: of one that ended.

    mode: "whole", or "steps" where every row waits. mark: in the names of its commands. by: name of who sent it;
    queued: since when its rows waited.
    """

    number: int
    sequence: str
    rows: int
    mode: str
    by: str
    queued: float
    state: str = "going"
    reason: str = ""
    outcome: str = ""
    ended: float | None = None
    mark: str = field(default="", metadata=LATER)


@value
class ConnRecord(Value):
    """The conn. number: of the latest holding, which counts up for ever; holder: the name, None: nobody."""

    number: int = 0
    holder: str | None = None


class Commanded(Protocol):
    """What of a session's state these events change."""

    @property
    def commands(self) -> tuple[CommandRecord, ...]: ...
    @property
    def stop(self) -> StopRecord: ...
    @property
    def runs(self) -> int: ...
    @property
    def run(self) -> RunRecord | None: ...
    @property
    def conn(self) -> ConnRecord | None: ...
    @property
    def epoch(self) -> int: ...


Changes = dict[str, Any]
"""Fields of the state and their new content."""


def closed_without_an_end(state: Commanded, event: Event) -> Changes:
    """Whoever closed without hearing the end of a command can't know it any more; a run does not go on by itself."""
    reason = "the session was closed before the rover said how it ended"
    run = state.run
    if run is not None and run.state != "ended":
        run = replace(run, state="ended", outcome="closed", reason="the session was closed", ended=float(event.time))
    conn = None if state.conn is None else ConnRecord(state.conn.number)
    return {"commands": _settled(state, event, reason), "run": run, "conn": conn}


def _run_started(state: Commanded, event: Event, payload: Payload) -> Changes:
    rows = payload.get("rows", 0)
    if not 0 <= rows <= MOST_ROWS:
        raise ValueError(f"a run has at most {MOST_ROWS} rows")
    run = RunRecord(
        number=payload["run"],
        sequence=payload.get("sequence", ""),
        rows=rows,
        mode=payload.get("mode", "whole"),
        by=payload.get("by", {}).get("name", ""),
        queued=float(event.time),
        mark=payload.get("mark", ""),
    )
    known = state.run
    if known is not None and known.number == run.number and known.state == "ended":
        # a stop came before the beginning was written
        run = replace(run, state="ended", reason=known.reason, outcome=known.outcome, ended=known.ended)
    return {"runs": run.number, "run": run}


def _run_held(state: Commanded, event: Event, payload: Payload) -> Changes:
    return _run_is(state, payload, state="held", reason=payload["reason"])


def _run_resumed(state: Commanded, event: Event, payload: Payload) -> Changes:
    return _run_is(state, payload, state="going", mode=payload["mode"], reason="")


def _run_aborted(state: Commanded, event: Event, payload: Payload) -> Changes:
    return _run_is(state, payload, state="aborting", reason="aborted")


def _run_ended(state: Commanded, event: Event, payload: Payload) -> Changes:
    changes = {"outcome": payload.get("outcome", ""), "reason": payload["reason"], "ended": float(event.time)}
    number = payload.get("run")
    if number is not None and number > state.runs:
        run = RunRecord(number, "", 0, "whole", "", float(event.time), state="ended", **changes)
        return {"runs": number, "run": run}
    settled = _settled(state, event, payload["reason"], number)
    return {"commands": settled, **_run_is(state, payload, state="ended", **changes)}


def _run_is(state: Commanded, payload: Payload, /, **changes: Any) -> Changes:
    run = state.run
    if run is None or payload.get("run", run.number) != run.number:
        return {}
    return {"run": replace(run, **changes)}


def _command_sent(state: Commanded, event: Event, payload: Payload) -> Changes:
    at = float(event.time)
    where = (payload["id"], payload["sequence"], payload["run"], payload["row"])
    sent = CommandRecord(*where, "sent", "", at, {"sent": at})
    if _has_ended(state, sent.run):
        reason = "" if state.run is None else state.run.reason
        sent = _with_nobody_waiting(sent, at, reason or "its run had ended when it was sent")
    return {"commands": (*state.commands, sent)}


def _command_changed(state: Commanded, event: Event, payload: Payload) -> Changes:
    new, at = event.type.removeprefix("command_"), float(event.time)

    def changed(record: CommandRecord) -> CommandRecord:
        ended = record.state in ("done", "refused")
        if record.id != payload["id"] or (ended and new in ("received", "started", "unknown")):
            return record
        times = {**(record.times or {}), new: at}
        if new in OPEN_STATES and _has_ended(state, record.run):
            return replace(record, times=times)
        return replace(record, state=new, reason=payload.get("reason", ""), time=at, times=times)

    return {"commands": tuple(changed(record) for record in state.commands)}


def _settled(state: Commanded, event: Event, reason: str, run: int | None = None) -> tuple[CommandRecord, ...]:
    """Nobody waits any more for the ends of the commands (``run``: of that run)."""
    at = float(event.time)
    return tuple(
        _with_nobody_waiting(c, at, reason) if c.state in OPEN_STATES and run in (None, c.run) else c
        for c in state.commands
    )


def _with_nobody_waiting(command: CommandRecord, at: float, reason: str) -> CommandRecord:
    return replace(command, state="unknown", reason=reason, time=at, times={**(command.times or {}), "unknown": at})


def _has_ended(state: Commanded, run: int) -> bool:
    """A run begins only once the one before has ended."""
    known = state.run
    return run < state.runs or (known is not None and known.number == run and known.state == "ended")


def _stop_requested(state: Commanded, event: Event, payload: Payload) -> Changes:
    stop, number = state.stop, _number_of_stop(payload, state.stop.number + 1)
    if number <= stop.cleared or number < stop.number:
        return {}
    stopped = StopRecord(True, stop.heard >= number, payload["reason"], float(payload["at"]))
    return {"stop": replace(stopped, number=number, heard=stop.heard, cleared=stop.cleared)}


def _stop_acknowledged(state: Commanded, event: Event, payload: Payload) -> Changes:
    stop, number = state.stop, _number_of_stop(payload, state.stop.number)
    heard = stop.latched and number >= stop.number
    return {"stop": replace(stop, acknowledged=stop.acknowledged or heard, heard=max(stop.heard, number))}


def _stop_cleared(state: Commanded, event: Event, payload: Payload) -> Changes:
    stop, number = state.stop, _number_of_stop(payload, state.stop.number)
    still = stop if number < stop.number else StopRecord(number=stop.number, heard=stop.heard, untold=True)
    return {"stop": replace(still, cleared=max(stop.cleared, number))}


def _armed(state: Commanded, event: Event, payload: Payload) -> Changes:
    # the rover said that it is idle, or it would have been refused
    return {"stop": replace(state.stop, untold=False)} if state.stop.untold else {}


def _number_of_stop(payload: Payload, otherwise: int) -> int:
    """``otherwise``: as it was before stops were numbered, when the order of the events told."""
    number = payload.get("stop", otherwise)
    if type(number) is not int or not 0 <= number < 2**53:
        raise ValueError(f"{number!r} is no number of a stop")
    return number


def _link_connected(state: Commanded, event: Event, payload: Payload) -> Changes:
    # whoever is there now has acknowledged nothing yet
    return {"stop": replace(state.stop, acknowledged=False, heard=0)}


def _conn_changed(state: Commanded, event: Event, payload: Payload) -> Changes:
    holder = payload["holder"]
    conn = ConnRecord(payload["conn"], None if holder is None else holder["name"])
    # kept for later while the disk was full, it may come after newer ones
    return {} if state.conn is not None and conn.number < state.conn.number else {"conn": conn}


def _nothing(state: Commanded, event: Event, payload: Payload) -> Changes:
    return {}


Change = Callable[[Commanded, Event, Payload], Changes]


def _in_its_epoch(change: Change) -> Change:
    """Whatever goes to the rover says in which epoch; the newest counts, whichever event was kept for later."""

    def changed(state: Commanded, event: Event, payload: Payload) -> Changes:
        epoch = payload.get("epoch", 0)
        if type(epoch) is not int or not 0 <= epoch < 2**53:
            raise ValueError(f"{epoch!r} is no epoch")
        return {**change(state, event, payload), "epoch": max(state.epoch, epoch)}

    return changed


_CHANGES: Mapping[str, Change] = {
    "link_connected": _link_connected,
    "conn_changed": _conn_changed,
    "act_refused": _nothing,
    "epoch_begun": _nothing,
    "armed": _armed,
    "run_started": _run_started,
    "run_held": _run_held,
    "run_resumed": _run_resumed,
    "run_aborted": _run_aborted,
    "run_ended": _run_ended,
    "command_sent": _command_sent,
    "command_received": _command_changed,
    "command_started": _command_changed,
    "command_done": _command_changed,
    "command_refused": _command_changed,
    "command_unknown": _command_changed,
    "stop_requested": _stop_requested,
    "stop_repeated": _nothing,
    "stop_acknowledged": _stop_acknowledged,
    "stop_cleared": _stop_cleared,
}

CHANGES: Mapping[str, Change] = {type: _in_its_epoch(change) for type, change in _CHANGES.items()}
"""Event type → what it changes."""
