"""The queue of steps and moves of the chassis: what is put at its end, and taken from there."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from footfall.planning.answers import Status
from footfall.session.log.event import Event
from footfall.session.log.fold_choices import chosen
from footfall.session.log.fold_commands import Changes
from footfall.session.log.records import ProductRecord

if TYPE_CHECKING:
    from footfall.session.log.fold import SessionState


def queues_behind(products: Mapping[str, ProductRecord], queue: str | None) -> tuple[str | None, ...]:
    """A queue, that with an entry less, and so on to None, the empty one."""
    found: list[str | None] = [queue]
    while (digest := found[-1]) is not None:
        found.append(products[digest].parents.get("queue"))
    return tuple(found)


def queued(state: "SessionState", event: Event, payload: Mapping[str, Any], digest: str) -> Changes:
    """A plan follows the queue, or does not: then that stays as it is."""
    return _with(state, event, digest) if payload["status"] == Status.FOUND.value else {}


def shortened(state: "SessionState", event: Event, payload: Mapping[str, Any]) -> Changes:
    """Entries are taken from the end. Raises ValueError where that does not leave what was there before them."""
    left = payload["digest"]
    if left not in queues_behind(state.products, state.queue)[1:]:
        raise ValueError("it shortens a queue to one that was not before")
    return _with(state, event, left)


def _with(state: "SessionState", event: Event, queue: str | None) -> Changes:
    return {"queue": queue, **chosen(state, replace(state, queue=queue), event, "queue")}
