"""Events: what happened in a session, in order. The log of them is the session; all else folds out of it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from footfall.io.event_log import START, Record, make_record

RENAMED = "session_renamed"
"""Type of the event that gives a session another name: databases look for it to list sessions without folding them."""


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened.

    seq: 0, 1, 2… without gaps. time: wall clock, seconds since 1970-01-01 UTC.
    type: one of the names that :mod:`footfall.session.log.fold` knows. payload: plain JSON.
    previous, hash: the chain; see :mod:`footfall.io.event_log`.
    """

    seq: int
    time: float
    type: str
    payload: Mapping[str, Any]
    previous: str
    hash: str

    def as_dict(self) -> Record:
        """The event as its line in the log."""
        return {
            "seq": self.seq,
            "time": self.time,
            "type": self.type,
            "payload": dict(self.payload),
            "previous": self.previous,
            "hash": self.hash,
        }


def event_of(record: Record) -> Event:
    """The event of one record of a log that was read and checked."""
    return Event(**{**record, "payload": MappingProxyType(record["payload"])})


def loaded_world(events: Iterable[Event]) -> str | None:
    """Digest of the ground that a session's rover really stands on, as far as its events say it.

    What was loaded first is the world; what was rebuilt from images is only a view of it.
    """
    return next((event.payload["digest"] for event in events if event.type == "terrain_loaded"), None)


def next_event(last: Event | None, time: float, type: str, payload: Mapping[str, Any]) -> Event:
    """The event that follows ``last``. Raises InvalidInput where the payload is not plain JSON."""
    seq, previous = (0, START) if last is None else (last.seq + 1, last.hash)
    return event_of(make_record(seq, time, type, dict(payload), previous))
