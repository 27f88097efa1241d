"""Who acts at the moment: whoever is asked for by name in what is written down meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypedDict

from footfall.session.access.identity import Identity
from footfall.session.answers.commands import HolderAnswer


class SaidBy(TypedDict, total=False):
    """Of an event's payload: who caused it."""

    by: HolderAnswer


_who: ContextVar[Identity | None] = ContextVar("who acts", default=None)


def set_actor(who: Identity) -> None:
    """For the rest of this context: of one request."""
    _who.set(who)


@contextmanager
def acting(who: Identity | None) -> Iterator[None]:
    """What happens inside is done by ``who``."""
    before = _who.set(who)
    try:
        yield
    finally:
        _who.reset(before)


def actor() -> Identity | None:
    """Who acts; None where nobody said so: a script that holds the session, the rover, the session itself."""
    return _who.get()


def said_by() -> SaidBy:
    """As the payload of an event says it: ``{"by": …}``, or nothing."""
    who = actor()
    return {} if who is None else {"by": who.as_dict()}
