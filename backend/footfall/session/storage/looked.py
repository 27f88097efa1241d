"""A session on disk that is only looked at: nothing in its folder or its database changes, whoever has it open."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from footfall.core.errors import Conflict
from footfall.core.value import Value
from footfall.session.log.event import Event, event_of
from footfall.session.storage.artifact_folder import ArtifactFolder
from footfall.session.storage.store import SessionStore, read_session


class LookedStore(SessionStore):
    """The session as it was when it was read. Whoever would change it is refused: Conflict."""

    writes = False

    def __init__(self, folder: Path) -> None:
        """Raises InvalidBundle where its log is damaged or lost events; StoreRefused where it can't be reached."""
        bundle = read_session(folder)
        self._have(folder, bundle.session, [event_of(record) for record in bundle.records])

    def _have(self, folder: Path, session: Mapping[str, Any], events: Sequence[Event]) -> None:
        self.folder = folder
        self.repairs: list[dict[str, Any]] = []
        self.session = dict(session)
        self.events = list(events)
        self._artifacts = ArtifactFolder(folder)
        self._log = self._head = self._doubtful = None
        self._displaced = False

    def append(self, event: Event) -> NoReturn:
        """Refused."""
        self._refuse()

    def put(self, value: Value) -> str:
        """Refused unless it is there."""
        return value.digest if self.has(value.digest) else self._refuse()

    def put_bytes(self, data: bytes, extension: str) -> NoReturn:
        """Refused."""
        self._refuse()

    def close(self) -> None:
        """There is nothing to let go of."""

    def _refuse(self) -> NoReturn:
        name = self.folder.name
        raise Conflict(f"session {name} is only looked at; open it, and it can be changed", session=name)


class EarlierStore(LookedStore):
    """A session that may be open, as it was after one of its events."""

    def __init__(self, store: SessionStore, events: Sequence[Event]) -> None:
        """events: those up to that one."""
        self._have(store.folder, store.session, events)
