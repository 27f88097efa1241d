"""Session state as a fold over events: ``fold(state, event) -> state``, pure, the same live and in a replay."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Any

from footfall.core.declared import misfit
from footfall.core.errors import InvalidBundle
from footfall.core.value import LATER, SOFTWARE_VERSION, Value, value
from footfall.planning.step.problem import Footfall
from footfall.session.log.event import RENAMED, Event
from footfall.session.log.fold_choices import Choice, chosen, edit_redone, edit_undone, forgotten, redone, undone
from footfall.session.log.fold_commands import (
    CHANGES,
    CommandRecord,
    ConnRecord,
    Payload,
    RunRecord,
    StopRecord,
    closed_without_an_end,
)
from footfall.session.log.fold_queue import joined, shortened
from footfall.session.log.records import ExportRecord, LeadPoints, Note, PlanRecord, ProductRecord
from footfall.session.products.kinds import COMMANDED, EDIT, IMPORT, KINDS, Becomes, Kind


@value
class SessionState(Value):
    """Everything that a session is about, by digest.

    robot, state, snapshot, dem, plan, sequence: digests; None until there is one.
    maps: leg (as text) → digest of its latest map stack.
    execution: the latest answer of how to execute ``plan``; None after another plan came.
    alternatives: the plans that ``plan`` was chosen from, itself among them; empty where there is nothing to choose.
    queue: the latest answer that has the queue of steps and moves; None where that is empty.
    told_state: ``state`` as it was told, before it was moved onto the map.
    what_if: the state that ``state`` was shifted from, where that is what would be if the chassis stood elsewhere; None
        where ``state`` is how the rover stands.
    latest: name of a kind → digest of its latest product, of kinds that have no place of their own here.
    terrain_history: the terrains before ``dem``, oldest first, for undo.
    sequence_history: the sequences before ``sequence``, oldest first, for undo. sequence_ahead: those that were undone
        since the latest edit, the one undone last at the end, for redo.
    points: for the swing of a leg, None before any were set. choices: what the operator chose and can take back, oldest
        first; choices_ahead: what was taken back since, the latest at the end, for redo.
    runs: how often a sequence was sent; run: the latest of them. conn: None before anybody held it. epoch: the latest
        that the rover was told of.
    joint_scale: times the described stiffness that joints are taken to have, where an order does not say.
    """

    name: str = ""
    robot: str | None = None
    robot_name: str = ""
    state: str | None = None
    snapshot: str | None = None
    dem: str | None = None
    maps: Mapping[str, str] = field(default_factory=dict)
    footfall: Footfall | None = None
    points: LeadPoints | None = field(default=None, metadata=LATER)
    plan: str | None = None
    plan_status: str | None = None
    plan_reason: str = ""
    alternatives: tuple[PlanRecord, ...] = ()
    execution: str | None = None
    execution_status: str | None = None
    execution_reason: str = ""
    queue: str | None = field(default=None, metadata=LATER)
    told_state: str | None = None
    what_if: str | None = None
    terrain_history: tuple[str, ...] = ()
    sequence: str | None = None
    sequence_history: tuple[str, ...] = ()
    sequence_ahead: tuple[str, ...] = field(default=(), metadata=LATER)
    choices: tuple[Choice, ...] = field(default=(), metadata=LATER)
    choices_ahead: tuple[Choice, ...] = field(default=(), metadata=LATER)
    exports: tuple[ExportRecord, ...] = ()
    stop: StopRecord = StopRecord()
    commands: tuple[CommandRecord, ...] = ()
    runs: int = 0
    run: RunRecord | None = field(default=None, metadata=LATER)
    conn: ConnRecord | None = field(default=None, metadata=LATER)
    epoch: int = field(default=0, metadata=LATER)
    joint_scale: float = field(default=1.0, metadata=LATER)
    notes: tuple[Note, ...] = ()
    products: Mapping[str, ProductRecord] = field(default_factory=dict)
    latest: Mapping[str, str] = field(default_factory=dict, metadata=LATER)

    def newest(self, kind: Kind) -> str | None:
        """Digest of the present product of a kind; None where there is none."""
        own = {
            Becomes.PLAN: self.plan,
            Becomes.EXECUTION: self.execution,
            Becomes.QUEUE: self.queue,
            Becomes.COMMANDS: self.sequence,
        }
        return own[kind.becomes] if kind.becomes in own else self.latest.get(kind.name)

    def kind_of(self, digest: str) -> Kind | None:
        """The kind of a product; None where it is none of this session."""
        made = self.products.get(digest)
        return None if made is None else KINDS[made.kind]

    @property
    def plans(self) -> tuple[PlanRecord, ...]:
        """The present plan and what it may be compared with; empty without a plan."""
        if self.alternatives or self.plan is None:
            return self.alternatives
        return (PlanRecord(self.plan, "asked", "as asked for", self.plan_status or "", self.plan_reason),)

    def before_edits(self, sequence: str) -> str:
        """The sequence that was edited to this one, as it was made or read in; itself where it was not edited."""
        while (made := self.products.get(sequence)) is not None and made.kind == EDIT.name:
            sequence = made.parents["sequence"]
        return sequence

    def plan_behind(self, sequence: str) -> ProductRecord | None:
        """The record of the plan, execution or import that a sequence goes back to, through all of its edits."""
        made = self.products.get(self.before_edits(sequence))
        if made is None or made.kind == IMPORT.name:
            return made
        return self.products.get(next((made.parents[one] for one in COMMANDED if one in made.parents), ""))


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
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as err:
        raise InvalidBundle(f"event {event.seq} ({event.type}) is incomplete: {err!r}", seq=event.seq) from err


def fold_all(events: Iterable[Event], state: SessionState | None = None) -> SessionState:
    """The state after all events, from an empty one where none is given.

    Raises InvalidBundle as :func:`fold`, and where a payload had something else in a place than belongs there.
    """
    state = SessionState() if state is None else state
    for event in events:
        state = fold(state, event)
    if (where := misfit(state)) is not None:
        raise InvalidBundle(
            f"the events leave something in {where} of the session that does not belong there", at=where
        )
    return state


def _created(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, name=payload["name"], robot=payload["robot"], robot_name=payload["robot_name"])


def _renamed(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, name=payload["name"])


def _opened(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, **closed_without_an_end(state, event))


def _unchanged(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return state


def _state_frozen(state: SessionState, event: Event, payload: Payload) -> SessionState:
    # a what-if ends with it: the operator asked, or the rover stands there by now (``made_so``)
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
    after = replace(state, footfall=Footfall(payload["leg"], payload["x"], payload["y"]))
    return replace(after, **chosen(state, after, event, "footfall"))


def _points_set(state: SessionState, event: Event, payload: Payload) -> SessionState:
    points = tuple((float(x), float(y), float(z)) for x, y, z in payload["points"])
    after = replace(state, points=LeadPoints(payload["leg"], points))
    return replace(after, **chosen(state, after, event, "points"))


def _stiffness_taken_over(state: SessionState, event: Event, payload: Payload) -> SessionState:
    after = replace(state, joint_scale=float(payload["joint_scale"]))
    return replace(after, **chosen(state, after, event, "stiffness"))


def _product(state: SessionState, event: Event, payload: Payload) -> SessionState:
    kind, digest = KINDS.get(payload["kind"]), payload["digest"]
    if kind is None:
        raise ValueError(f"there is no product called {payload['kind']!r}")
    record = ProductRecord(kind.name, payload["parents"], payload["settings"])
    state = replace(state, products={**state.products, digest: record})
    return _BECOMES[kind.becomes](state, event, payload, digest)


def _latest(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    return replace(state, latest={**state.latest, payload["kind"]: digest})


def _built(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    if state.told_state is not None and payload.get("from_state") == state.told_state:
        # the rover is still planned for from where the images were taken: as that pose is on the map
        state = replace(state, state=payload["state"], what_if=None)
    return _on_terrain(state, digest)


def _mapped(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    return replace(state, maps={**state.maps, str(payload["leg"]): digest})


def _executed(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    if payload["parents"]["plan"] != state.plan:
        return state  # of another plan than the present one
    changes = {"execution_status": payload["status"], "execution_reason": payload["reason"]}
    return replace(state, execution=digest, **changes)


def _queued(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    return _with_queue(state, event, joined(state.queue, payload, digest))


def _queue_shortened(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return _with_queue(state, event, shortened(state.products, state.queue, payload["digest"]))


def _with_queue(state: SessionState, event: Event, queue: str | None) -> SessionState:
    after = replace(state, queue=queue)
    return replace(after, **chosen(state, after, event, "queue"))


def _as_if(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    return replace(state, state=digest, what_if=payload["parents"]["state"])


def _as_if_after(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    # what would be, were the plan carried out: planned from as in a what-if
    return replace(state, state=digest, what_if=state.what_if or state.state or payload["parents"]["state"])


def _commanded(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    made = replace(state, sequence=digest, sequence_history=(), sequence_ahead=())
    return replace(made, **forgotten(state, "edit"))


def _edited(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    history = (*state.sequence_history, state.sequence or "")
    edited = replace(state, sequence=digest, sequence_history=history, sequence_ahead=())
    return replace(edited, **chosen(state, edited, event, "edit"))


def _read_in(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    # commands from a file take the place of those before, so that undo goes back to them
    return replace(state, sequence=digest) if state.sequence is None else _edited(state, event, payload, digest)


def _exported(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    record = ExportRecord(payload["parents"]["sequence"], payload["format"], digest)
    return replace(state, exports=(*state.exports, record))


def _planned(state: SessionState, event: Event, payload: Payload, digest: str) -> SessionState:
    """A plan that was asked for becomes the present one; an alternative to it is only listed."""
    about, status, reason = payload.get("alternative"), payload["status"], payload["reason"]
    if about is None:
        asked = replace(state, alternatives=(), **forgotten(state, "plan"))
        return _with_plan(asked, digest, status, reason)
    if all(one.plan != about["to"] for one in state.plans):
        return state  # another step was planned meanwhile
    found = PlanRecord(digest, about["kind"], about["text"], status, reason)
    others = tuple(one for one in state.plans if one.plan != digest)
    return replace(state, alternatives=(*others, found))


def _plan_chosen(state: SessionState, event: Event, payload: Payload) -> SessionState:
    found = next((one for one in state.alternatives if one.plan == payload["digest"]), None)
    if found is None:
        raise ValueError("it chooses a plan that was not there to choose")
    after = _with_plan(state, found.plan, found.status, found.reason)
    return replace(after, **chosen(state, after, event, "plan"))


def _with_plan(state: SessionState, digest: str, status: str, reason: str) -> SessionState:
    """Another plan is the present one, and nothing says yet how to execute it."""
    planned = replace(state, plan=digest, plan_status=status, plan_reason=reason)
    return replace(planned, execution=None, execution_status=None, execution_reason="")


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
    *history, before = state.sequence_history
    ahead = (*state.sequence_ahead, state.sequence or "")
    left = {"sequence": before, "sequence_history": tuple(history), "sequence_ahead": ahead}
    return replace(state, **left, **edit_undone(state))


def _redone(state: SessionState, event: Event, payload: Payload) -> SessionState:
    if not state.sequence_ahead or state.sequence_ahead[-1] != payload["digest"]:
        raise ValueError("it redoes an edit that was not undone")
    *ahead, again = state.sequence_ahead
    history = (*state.sequence_history, state.sequence or "")
    made = {"sequence": again, "sequence_history": history, "sequence_ahead": tuple(ahead)}
    return replace(state, **made, **edit_redone(state, event))


def _changed(
    change: Callable[[SessionState, Event, Payload], Mapping[str, Any]],
    state: SessionState,
    event: Event,
    payload: Payload,
) -> SessionState:
    return replace(state, **change(state, event, payload))


def _noted(state: SessionState, event: Event, payload: Payload) -> SessionState:
    return replace(state, notes=(*state.notes, Note(float(event.time), payload["text"])))


_BECOMES: Mapping[Becomes, Callable[[SessionState, Event, Payload, str], SessionState]] = {
    Becomes.LATEST: _latest,
    Becomes.TERRAIN: _built,
    Becomes.MAPS: _mapped,
    Becomes.PLAN: _planned,
    Becomes.EXECUTION: _executed,
    Becomes.QUEUE: _queued,
    Becomes.AS_IF: _as_if,
    Becomes.AS_IF_AFTER: _as_if_after,
    Becomes.COMMANDS: _commanded,
    Becomes.EDITED: _edited,
    Becomes.READ_IN: _read_in,
    Becomes.EXPORT: _exported,
}

_FOLDS: dict[str, Callable[[SessionState, Event, Payload], SessionState]] = {
    "session_created": _created,
    "session_opened": _opened,
    RENAMED: _renamed,
    "log_repaired": _unchanged,
    "clock_jumped": _unchanged,
    "link_fault": _unchanged,
    "link_lost": _unchanged,
    "light_time_set": _unchanged,
    "state_frozen": _state_frozen,
    "what_if_ended": _what_if_ended,
    "snapshot_taken": _snapshot_taken,
    "terrain_loaded": _terrain_loaded,
    "terrain_undone": _terrain_undone,
    "footfall_chosen": _footfall_chosen,
    "points_set": _points_set,
    "stiffness_taken_over": _stiffness_taken_over,
    "product": _product,
    "plan_chosen": _plan_chosen,
    "queue_shortened": _queue_shortened,
    "job_failed": _unchanged,
    "walk_decided": _unchanged,
    "way_chosen": _unchanged,
    "sequence_undone": _undone,
    "sequence_redone": _redone,
    "choice_undone": partial(_changed, undone),
    "choice_redone": partial(_changed, redone),
    "note": _noted,
    **{type: partial(_changed, change) for type, change in CHANGES.items()},
}

EVENT_TYPES = frozenset(_FOLDS)
