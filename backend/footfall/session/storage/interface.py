"""What a database of sessions has to offer. Everything else of the store is files, and the same for all of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from footfall.io.event_log import Record


class StoreRefused(OSError):
    """Something could not be written, or read, now: no room, a lock, a missing file. strerror says what to do."""


@dataclass(frozen=True)
class Listed:
    """One session of a database. latest: time of its last event; None where it has none."""

    id: str
    about: Mapping[str, Any]
    events: int
    latest: float | None


class EventLog(Protocol):
    """The hash-chained logs of many sessions; an event that was appended stays as it is.

    Every method raises StoreRefused where the database can't be reached, is locked for longer than it
    may be waited for, or has no room; then nothing of the call is in the database. InvalidBundle: it is damaged.
    """

    name: str

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

    def close(self) -> None:
        """Harmless when done twice."""
        ...
