"""What the operator chose, in its order over all kinds, so that it can be taken back and made again.

A choice keeps the fields of the state that it changed as they were before. To undo it puts them back and keeps what
they were, to redo puts that back: the two are each other's inverse. What makes choices meaningless (another plan,
another sequence) forgets those of its kind.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

from footfall.core.value import Value, value
from footfall.session.answers.choices import ChoiceAnswer
from footfall.session.log.event import Event
from footfall.session.log.fold_commands import Changes

FIELDS: Mapping[str, tuple[str, ...]] = {
    "footfall": ("footfall",),
    "points": ("points",),
    "plan": ("plan", "plan_status", "plan_reason", "execution", "execution_status", "execution_reason"),
    "edit": ("sequence",),
    "queue": ("queue",),
    "stiffness": ("joint_scale",),
}
"""Kind of a choice → what it changes of a session's state."""


@value
class Choice(Value):
    """One thing that the operator chose.

    kind: a key of FIELDS; seq: of its event; by: name of who made it, "" where that is not known; leg: of which it
    is, None where of none alone. other: the fields of its kind as undo, or redo, puts them back.
    """

    kind: str
    seq: int
    by: str
    leg: int | None
    other: Mapping[str, Any]

    def as_dict(self) -> ChoiceAnswer:
        """Plain JSON: which it is, and whose."""
        return {"choice": self.seq, "kind": self.kind, "leg": self.leg, "by": self.by}


class Chosen(Protocol):
    """What of a session's state undo and redo work on, besides the fields of FIELDS."""

    @property
    def choices(self) -> tuple[Choice, ...]: ...
    @property
    def choices_ahead(self) -> tuple[Choice, ...]: ...
    @property
    def sequence(self) -> str | None: ...
    @property
    def sequence_history(self) -> tuple[str, ...]: ...
    @property
    def sequence_ahead(self) -> tuple[str, ...]: ...


def chosen(before: Chosen, after: Chosen, event: Event, kind: str) -> Changes:
    """The event was a choice. One that changes nothing is none; any other ends what could be made again."""
    was, now = _of(before, kind), _of(after, kind)
    if kind != "edit" and all(alike(was[name], now[name]) for name in was):
        return {}
    by = event.payload.get("by") or {}
    made = Choice(kind, event.seq, by.get("name", ""), event.payload.get("leg"), was)
    return {"choices": (*before.choices, made), "choices_ahead": ()}


def forgotten(state: Chosen, kind: str) -> Changes:
    """There is nothing left that choices of this kind could go back to."""
    return {
        name: tuple(one for one in getattr(state, name) if one.kind != kind) for name in ("choices", "choices_ahead")
    }


def undone(state: Chosen, event: Event, payload: Mapping[str, Any]) -> Changes:
    """The latest choice is taken back. Raises ValueError where that is another than the event names."""
    if not state.choices or state.choices[-1].seq != payload["choice"]:
        raise ValueError("it takes back a choice that is not the latest")
    *left, last = state.choices
    changes = {"choices": tuple(left), "choices_ahead": (*state.choices_ahead, _turned(state, last))}
    if last.kind == "edit":
        changes |= {
            "sequence_history": state.sequence_history[:-1],
            "sequence_ahead": (*state.sequence_ahead, state.sequence),
        }
    return {**last.other, **changes}


def redone(state: Chosen, event: Event, payload: Mapping[str, Any]) -> Changes:
    """What was taken back last is made again. Raises ValueError where that is another than the event names."""
    if not state.choices_ahead or state.choices_ahead[-1].seq != payload["choice"]:
        raise ValueError("it makes a choice again that was not taken back last")
    *left, last = state.choices_ahead
    changes = {"choices": (*state.choices, _turned(state, last)), "choices_ahead": tuple(left)}
    if last.kind == "edit":
        changes |= {
            "sequence_history": (*state.sequence_history, state.sequence),
            "sequence_ahead": state.sequence_ahead[:-1],
        }
    return {**last.other, **changes}


def edit_undone(state: Chosen) -> Changes:
    """The latest edit alone was taken back, whatever was chosen since."""
    at = max(i for i, one in enumerate(state.choices) if one.kind == "edit")
    ahead = (*state.choices_ahead, _turned(state, state.choices[at]))
    return {"choices": (*state.choices[:at], *state.choices[at + 1 :]), "choices_ahead": ahead}


def edit_redone(state: Chosen, event: Event) -> Changes:
    """The edit that was undone last was made again; a choice since then may have ended that it could by redo."""
    undone_edits = [i for i, one in enumerate(state.choices_ahead) if one.kind == "edit"]
    if not undone_edits:
        return {"choices": (*state.choices, Choice("edit", event.seq, "", None, _of(state, "edit")))}
    at = undone_edits[-1]
    again = _turned(state, state.choices_ahead[at])
    return {
        "choices": (*state.choices, again),
        "choices_ahead": (*state.choices_ahead[:at], *state.choices_ahead[at + 1 :]),
    }


def _turned(state: Chosen, choice: Choice) -> Choice:
    """The choice as it leads back to the present state."""
    return replace(choice, other=_of(state, choice.kind))


def _of(state: Chosen, kind: str) -> dict[str, Any]:
    return {name: getattr(state, name) for name in FIELDS[kind]}


def alike(one: Any, other: Any) -> bool:
    """Whether two fields of a state hold the same."""
    if isinstance(one, Value) and isinstance(other, Value):
        return one.digest == other.digest
    return one == other
