"""Session state as a fold over events: ``fold(state, event) -> state``, pure, the same live and in a replay."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from typing import Any

from footfall.core.errors import InvalidBundle
from footfall.core.value import SOFTWARE_VERSION, Value, value
from footfall.planning.step.problem import Footfall
from footfall.session.event import Event

OPEN_STATES = ("sent", "received", "started")
"""States of a command whose end is not known yet; the others are "done", "refused", "unknown"."""

TERRAIN_KINDS = ("terrain", "photographs", "blend", "clear")
"""Products that become the session's terrain."""


@value
class ProductRecord(Value):
    """How a product came to be. parents: name → digest; settings: digest of the request, or None."""

    kind: str
    parents: Mapping[str, str]
    settings: str | None


@value
class ExportRecord(Value):
    """One export: which sequence, as what, and the digest of its bytes."""

    sequence: str
    format: str
    digest: str


@value
class CommandRecord(Value):
    """One command sent to the rover and how far it came. time: of the latest change."""

    id: str
    sequence: str
    run: int
    row: int
    state: str
    reason: str
    time: float


@value
class StopRecord(Value):
    """The stop. latched: nothing is sent until it is cleared; acknowledged: the rover said that it stands."""

    latched: bool = False
    acknowledged: bool = False
    reason: str = ""
    time: float | None = None


@value
class Note(Value):
    """What an operator wrote down."""

    time: float
    text: str


@value
class SessionState(Value):
    """Everything that a session is about, by digest.

    robot, state, snapshot, dem, plan, sequence: digests; None until there is one.
    maps: leg (as text) → digest of its latest map stack.
    told_state: ``state`` as it was told, before it was moved onto the map.
    what_if: the state that ``state`` was shifted from, where that is what would be if the chassis stood elsewhere; None
        where ``state`` is how the rover stands. shift, body_move: the latest answers about moves of the chassis.
    terrain_history: the terrains before ``dem``, oldest first, for undo.
    sequence_history: the sequences before ``sequence``, oldest first, for undo.
    runs: how often a sequence was sent.
    """

    name: str = ""
    robot: str | None = None
    robot_name: str = ""
    state: str | None = None
    snapshot: str | None = None
    dem: str | None = None
    maps: Mapping[str, str] = field(default_factory=dict)
    footfall: Footfall | None = None
    plan: str | None = None
    plan_status: str | None = None
    plan_reason: str = ""
    told_state: str | None = None
    what_if: str | None = None
    shift: str | None = None
    body_move: str | None = None
    terrain_history: tuple[str, ...] = ()
    sequence: str | None = None
    sequence_history: tuple[str, ...] = ()
    exports: tuple[ExportRecord, ...] = ()
    stop: StopRecord = StopRecord()
    commands: tuple[CommandRecord, ...] = ()
    runs: int = 0
    notes: tuple[Note, ...] = ()
    products: Mapping[str, ProductRecord] = field(default_factory=dict)

    def maps_current(self, leg: int) -> bool:
        """Whether the maps of ``leg`` were made from the present terrain and state."""
        made = self.products.get(self.maps.get(str(leg), ""))
        return made is not None and (made.parents["dem"], made.parents["state"]) == (self.dem, self.state)

    def plan_behind(self, sequence: str) -> ProductRecord | None:
        """The record of the plan that a sequence goes back to, through all of its edits."""
        made = self.products.get(sequence)
        while made is not None and "sequence" in made.parents:
            made = self.products.get(made.parents["sequence"])
        return None if made is None else self.products.get(made.parents.get("plan", ""))


def fold(state: SessionState, event: Event) -> SessionState:
    """The state after ``event``.

    Raises InvalidBundle for an event type that this version does not know, or a payload that lacks what
    its type needs.
    """
    if event.type not in _FOLDS:
        raise InvalidBundle(
            f"event {event.seq} is a {event.type!r}, which FootFall {SOFTWARE_VERSION} does not know; "
            "a later version wrote it: update FootFall",
            seq=event.seq,
            type=event.type,
        )
    try:
        return _FOLDS[event.type](state, event, event.payload)
    except (KeyError, TypeError, ValueError) as err:
        raise InvalidBundle(f"event {event.seq} ({event.type}) is incomplete: {err!r}", seq=event.seq) from err


def fold_all(events: Iterable[Event], state: SessionState | None = None) -> SessionState:
    """The state after all events, from an empty one where none is given."""
    state = SessionState() if state is None else state
    for event in events:
        state = fold(state, event)
    return state


Payload = Mapping[str, Any]


def _created(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, name=payload["name"], robot=payload["robot"], robot_name=payload["robot_name"])


def _opened(state: SessionState, event: Event, payload: Payload) -> SessionState:
    # Whoever closed without hearing the end of a command can't know it any more.
    return _settle(state, event, "unknown", "the session was closed before the rover said how it ended")


def _unchanged(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return state


def _state_frozen(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, state=payload["digest"], told_state=payload["digest"], what_if=None)


def _what_if_ended(state: SessionState, event: Event, payload: Payload) -> SessionState:
    if state.what_if is None or state.what_if != payload["digest"]:
        raise ValueError("it ends a what-if that was not there")
    return replace(state, state=state.what_if, what_if=None)


def _snapshot_taken(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, snapshot=payload["digest"], state=payload["state"], told_state=payload["state"], what_if=None)


def _terrain_loaded(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return _on_terrain(state, payload["digest"])


def _footfall_chosen(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, footfall=Footfall(payload["leg"], payload["x"], payload["y"]))


def _product(state: SessionState, event: Event, payload: Payload) -> SessionState:
    kind, digest = payload["kind"], payload["digest"]
    record = ProductRecord(kind, payload["parents"], payload["settings"])
    state = replace(state, products={**state.products, digest: record})
    if kind in TERRAIN_KINDS:
        if state.told_state is not None and payload.get("from_state") == state.told_state:
            # the rover is still planned for from where the images were taken: as that pose is on the map
            state = replace(state, state=payload["state"], what_if=None)
        return _on_terrain(state, digest)
    if kind == "maps":
        return replace(state, maps={**state.maps, str(payload["leg"]): digest})
    if kind == "plan":
        return replace(state, plan=digest, plan_status=payload["status"], plan_reason=payload["reason"])
    if kind == "what_if":
        return replace(state, state=digest, what_if=payload["parents"]["state"])
    if kind == "shift":
        return replace(state, shift=digest)
    if kind == "body_move":
        return replace(state, body_move=digest)
    if kind == "sequence":
        return replace(state, sequence=digest, sequence_history=())
    if kind == "edit":
        history = (*state.sequence_history, payload["parents"]["sequence"])
        return replace(state, sequence=digest, sequence_history=history)
    if kind == "export":
        record = ExportRecord(payload["parents"]["sequence"], payload["format"], digest)
        return replace(state, exports=(*state.exports, record))
    raise ValueError(f"there is no product called {kind!r}")


def _on_terrain(state: SessionState, digest: str) -> SessionState:
    before = () if state.dem is None or state.dem == digest else (state.dem,)
    return replace(state, dem=digest, terrain_history=(*state.terrain_history, *before))


def _terrain_undone(state: SessionState, event: Event, payload: Payload) -> SessionState:
    if not state.terrain_history or state.terrain_history[-1] != payload["digest"]:
        raise ValueError("it goes back to a terrain that was not there before")
    return replace(state, dem=payload["digest"], terrain_history=state.terrain_history[:-1])


def _undone(state: SessionState, event: Event, payload: Payload) -> SessionState:
    if not state.sequence_history or state.sequence_history[-1] != payload["digest"]:
        raise ValueError("it undoes an edit that was not made")
    return replace(state, sequence=payload["digest"], sequence_history=state.sequence_history[:-1])


def _run_started(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, runs=payload["run"])


def _command_sent(state: SessionState, event: Event, payload: Payload) -> SessionState:
    record = CommandRecord(
        payload["id"], payload["sequence"], payload["run"], payload["row"], "sent", "", float(event.time)
    )
    return replace(state, commands=(*state.commands, record))


def _command_changed(state: SessionState, event: Event, payload: Payload) -> SessionState:
    new = event.type.removeprefix("command_")

    def changed(record: CommandRecord) -> CommandRecord:
        late = record.state in ("done", "refused") and new in ("received", "started")
        if record.id != payload["id"] or late:
            return record
        return replace(record, state=new, reason=payload.get("reason", ""), time=float(event.time))

    return replace(state, commands=tuple(changed(record) for record in state.commands))


def _run_ended(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return _settle(state, event, "unknown", payload["reason"])


def _settle(state: SessionState, event: Event, new: str, reason: str) -> SessionState:
    return replace(
        state,
        commands=tuple(
            replace(c, state=new, reason=reason, time=float(event.time)) if c.state in OPEN_STATES else c
            for c in state.commands
        ),
    )


def _stop_requested(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, stop=StopRecord(True, False, payload["reason"], float(payload["at"])))


def _stop_acknowledged(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, stop=replace(state.stop, acknowledged=True))


def _stop_cleared(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, stop=StopRecord())


def _link_connected(state: SessionState, event: Event, payload: Payload) -> SessionState:
    # whoever is there now has acknowledged nothing yet
    return replace(state, stop=replace(state.stop, acknowledged=False))


def _noted(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, notes=(*state.notes, Note(float(event.time), payload["text"])))


_FOLDS: dict[str, Callable[[SessionState, Event, Payload], SessionState]] = {
    "session_created": _created,
    "session_opened": _opened,
    "log_repaired": _unchanged,
    "link_connected": _link_connected,
    "link_fault": _unchanged,
    "link_lost": _unchanged,
    "state_frozen": _state_frozen,
    "what_if_ended": _what_if_ended,
    "snapshot_taken": _snapshot_taken,
    "terrain_loaded": _terrain_loaded,
    "terrain_undone": _terrain_undone,
    "footfall_chosen": _footfall_chosen,
    "product": _product,
    "job_failed": _unchanged,
    "sequence_undone": _undone,
    "armed": _unchanged,
    "run_started": _run_started,
    "run_ended": _run_ended,
    "command_sent": _command_sent,
    "command_received": _command_changed,
    "command_started": _command_changed,
    "command_done": _command_changed,
    "command_refused": _command_changed,
    "stop_requested": _stop_requested,
    "stop_acknowledged": _stop_acknowledged,
    "stop_cleared": _stop_cleared,
    "note": _noted,
}

EVENT_TYPES = frozenset(_FOLDS)
