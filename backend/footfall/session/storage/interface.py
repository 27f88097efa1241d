"""What a database of sessions has to offer. Everything else of the store is files, and the same for all of them."""

import errno
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from footfall.core.errors import NotRecorded
from footfall.io.event_log import Record
from footfall.session.log.event import Event


class StoreRefused(OSError):
    """Something could not be written, or read, now: no room, a lock, a missing file. strerror says what to do."""

    @property
    def not_recorded(self) -> NotRecorded:
        """For whoever asked for what can't be written."""
        no_room = self.errno == errno.ENOSPC
        return NotRecorded(f"it can't be recorded, so it was not done: {self.strerror}", no_room=no_room)


class OutcomeUnknown(StoreRefused):
    """The database was lost while it wrote: what was to be written may turn out to be in it once it is back."""


class TurnedUp(Exception):
    """An event whose outcome was unknown is in the log after all. event: it, as the database has it."""

    def __init__(self, event: Event) -> None:
        super().__init__(f"event {event.seq} was written after all")
        self.event = event


@dataclass(frozen=True)
class Listed:
    """One session of a database.

    latest: time of its last event; None where it has none. renamed: the payload that gave it its latest name; None
    where it has the one that it was made with.
    """

    id: str
    about: Mapping[str, Any]
    events: int
    latest: float | None
    renamed: Mapping[str, Any] | None = None


class EventLog(Protocol):
    """The hash-chained logs of many sessions; an event that was appended stays as it is.

    Every method raises StoreRefused where the database can't be reached, is locked for longer than it
    may be waited for, or has no room; then nothing of the call is in the database, but for OutcomeUnknown.
    InvalidBundle: it is damaged.

    name: for messages. remedy: how a person brings back what it lost, as a sentence.
    """

    name: str
    remedy: str

    def hold(self, session: str) -> None:
        """Keep other machines from writing to a session until closed. Raises Conflict where one does.

        Processes of one machine are kept apart by the session's own lock file.
        """
        ...

    def sessions(self) -> list[Listed]:
        """All sessions, by id."""
        ...

    def about(self, session: str) -> dict[str, Any] | None:
        """What session.json says of a session, but for its head; None where the database has no such session."""
        ...

    def read(self, session: str) -> list[Record]:
        """Every event of a session, the chain checked."""
        ...

    def create(self, session: str, about: Mapping[str, Any], records: Sequence[Record] = ()) -> None:
        """A new session with its first events, all or nothing. Raises Conflict where there is one of this id."""
        ...

    def append(self, session: str, records: Sequence[Record]) -> None:
        """Add events, all or nothing, and wait until the disk has them.

        Raises Conflict where they do not follow the last event that the database has.
        """
        ...

    def replace(self, session: str, about: Mapping[str, Any], records: Sequence[Record]) -> None:
        """Put another log in the place of a session's: for migrations to another layout of events only."""
        ...

    def forget(self, session: str) -> None:
        """Remove a session with its events."""
        ...

    def displaced(self) -> bool:
        """Whether what is now found under the database's name is another one than was opened, or none."""
        ...

    def reopen(self) -> None:
        """Go on with what is now found under that name."""
        ...

    def damage(self) -> list[str]:
        """What the database itself finds wrong with its tables and guards; empty where it finds nothing."""
        ...

    def copy_to(self, path: Path, sessions: Sequence[str]) -> None:
        """Copy sessions, as they are at one moment, into a new SQLite file while others write on."""
        ...

    def close(self) -> None:
        """Harmless when done twice."""
        ...
