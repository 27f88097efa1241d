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
_by_itself: ContextVar[bool] = ContextVar("something acts for them", default=False)


def set_actor(who: Identity) -> None:
    """For the rest of this context: of one request."""
    _who.set(who)


@contextmanager
def acting(who: Identity | None, by_itself: bool = False) -> Iterator[None]:
    """What happens inside is done by ``who``; by_itself: by what acts for them, which goes on without them."""
    before, before_itself = _who.set(who), _by_itself.set(by_itself)
    try:
        yield
    finally:
        _who.reset(before)
        _by_itself.reset(before_itself)


def acts_by_itself() -> bool:
    """Whether what happens is no sign of who acts."""
    return _by_itself.get()


def actor() -> Identity | None:
    """Who acts; None where nobody said so: a script that holds the session, the rover, the session itself."""
    return _who.get()


def said_by() -> SaidBy:
    """As the payload of an event says it: ``{"by": …}``, or nothing."""
    who = actor()
    return {} if who is None else {"by": who.as_dict()}
