"""A session on disk: every event is in the database, and its head beside it, before anyone hears of it."""

import contextlib
import errno
import logging
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput
from footfall.core.value import Value
from footfall.io import bundles
from footfall.io.bundles import ARTIFACTS, VERSION, Bundle, log_bytes
from footfall.io.event_log import Record
from footfall.session.log.event import Event, event_of
from footfall.session.storage.artifact_folder import ArtifactFolder, sync_folder, write_whole
from footfall.session.storage.databases import has_log, log_name, open_log, sole_writer
from footfall.session.storage.head import HEAD, HeadFile, compare, new_head, read_head
from footfall.session.storage.interface import EventLog, OutcomeUnknown, StoreRefused, TurnedUp
from footfall.session.storage.plain_log import has_plain_log, keep, move_into
from footfall.session.storage.writer_lock import WriterLock

LEAVING = ".removed-"
"""How the folder of a session that is being removed begins."""


class SessionStore:
    """One session, held open for appending: its log in the working folder's database, the rest in its own folder.

    Not thread-safe, but for the artifacts: its session serialises calls.

    .session: what session.json of its bundle says, but for the head. .events: the log as found at opening.
    .repairs: what opening had to repair: payloads of "log_repaired" events. .writes: whether it may be changed.
    """

    writes = True

    def __init__(self, folder: Path) -> None:
        """Open a session. A log that an earlier version left in the folder is moved into the database.

        Raises Conflict where another process has it open; InvalidBundle where its log is damaged or lost events;
        StoreRefused where the database can't be reached.
        """
        self.folder = folder
        self.repairs: list[dict[str, Any]] = []
        self._artifacts = ArtifactFolder(folder)
        self._log: EventLog | None = None
        self._head: HeadFile | None = None
        self._displaced = False
        self._doubtful: Event | None = None
        self._lock = WriterLock(folder)
        try:
            self._log = open_log(folder.parent, create=has_plain_log(folder))
            self._log.hold(folder.name)
            self._load(self._log)
        except BaseException as err:
            self._let_go()
            if isinstance(err, FileNotFoundError):
                raise InvalidBundle(_unknown(folder), session=folder.name) from err
            raise

    @classmethod
    def create(cls, folder: Path, session: Mapping[str, Any]) -> "SessionStore":
        """Make a new session. Raises InvalidInput where one is there."""
        return cls.take_in(folder, Bundle(session, [], 0, VERSION, {}))

    @classmethod
    def take_in(cls, folder: Path, bundle: Bundle) -> "SessionStore":
        """Make a session of a bundle; ``session`` goes with its records. Raises InvalidInput where one is there."""
        try:
            folder.mkdir(parents=True)
        except FileExistsError as err:
            raise InvalidInput(f"there is a session in {folder.name} already") from err
        try:
            (folder / ARTIFACTS).mkdir()
            for name, content in bundle.files.items():
                write_whole(folder / ARTIFACTS / name, content())
            new_head(folder, bundle.records).close()
            sync_folder(folder.parent)
            with contextlib.closing(open_log(folder.parent)) as log:
                log.create(folder.name, bundle.session, bundle.records)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return cls(folder)

    def append(self, event: Event) -> None:
        """Write one event and wait until the disk has it. StoreRefused, Conflict: it is not in the log.

        After OutcomeUnknown it may be, which shows when the database is back: then TurnedUp is raised, once, instead of
        writing another event in its place.
        """
        log = self._opened()
        try:
            if self._displaced or log.displaced():
                self._displaced = True
                log.reopen()
                self._complete(log)
                self._displaced = False
            if self._doubtful is not None and self.events and self.events[-1] is self._doubtful:
                self._doubtful = None
                raise TurnedUp(self.events[-1])
            log.append(self.folder.name, [event.as_dict()])
        except OutcomeUnknown:
            self._doubtful = event
            raise
        except InvalidBundle as err:
            raise StoreRefused(errno.EIO, err.message, log.name) from err
        self.events.append(event)
        self._write_head()

    def take_doubtful(self) -> Event | None:
        """An event that may be in the log or not, once: it is taken for one that is, so that no other stands there."""
        found, self._doubtful = self._doubtful, None
        if found is not None:
            self.events.append(found)
        return found

    def seal(self) -> None:
        """Make sure that the head names the last event."""
        self._write_head()

    def keep_beside(self, pending: Sequence[Event]) -> None:
        """Write the whole log, with events that the database can't take, into the folder, to be moved when opened."""
        keep(self.folder, self.session, [event.as_dict() for event in (*self.events, *pending)])

    def bundle(self) -> Bundle:
        """The session so far, in the form that is exchanged."""
        return bundle_of(self.folder, self.session, [event.as_dict() for event in self.events])

    @property
    def displaced(self) -> bool:
        """Whether the database that it was opened with is not there now: somebody may be putting it back."""
        return self._log is not None and (self._displaced or self._log.displaced())

    def put(self, value: Value) -> str:
        """Store a value; returns its digest. One that is there stays as it is."""
        return self._artifacts.put(value)

    def put_bytes(self, data: bytes, extension: str) -> str:
        """Store a file's content; returns its digest."""
        return self._artifacts.put_bytes(data, extension)

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle naming the file where it is damaged."""
        return self._artifacts.get(digest)

    def get_bytes(self, digest: str) -> bytes:
        """Content of a stored file that is no value. Raises as :meth:`get`."""
        return self._artifacts.get_bytes(digest)

    def has(self, digest: str) -> bool:
        """Whether a value of this name is stored; its content is not looked at."""
        return self._artifacts.has(digest)

    def close(self) -> None:
        """Harmless when done twice. Where the database is gone by now, the log is kept in the session's folder."""
        if self._log is not None:
            self.seal()
            if self._log.displaced() and not has_plain_log(self.folder):
                try:
                    self.keep_beside(())
                except OSError as err:
                    logging.getLogger(__name__).error("session %s is not kept: %s", self.folder.name, err)
        self._let_go()

    # -- inside ----------------------------------------------------------------------------------

    def _load(self, log: EventLog) -> None:
        name = self.folder.name
        self._upgrade(log)
        torn = move_into(log, self.folder) if has_plain_log(self.folder) else 0
        if torn:
            text = "the last line of the log was torn and has been cut off"
            self.repairs.append({"bytes": torn, "text": text})
        about = log.about(name)
        if about is None:
            raise InvalidBundle(_unknown(self.folder), session=name)
        records = log.read(name)
        found = compare(read_head(self.folder), records)
        if found.lost:
            raise InvalidBundle(
                f"session {name} can't be opened: {found.text}. {log.remedy}. To go on without the lost events, "
                f"remove the file {name}/{HEAD}; the session's log will say so",
                session=name,
            )
        if found.kind == "missing" or found.by > 1:
            self.repairs.append({"bytes": 0, "text": f"{found.text}; it was made anew from the log"})
        self.session: dict[str, Any] = about
        self.events = [event_of(record) for record in records]
        self._head = new_head(self.folder, records)

    def _upgrade(self, log: EventLog) -> None:
        """Bring events of an older layout up to date; the log as it was written stays beside."""
        about = log.about(self.folder.name)
        if about is None or about.get("version") == bundles.VERSION:
            return
        before = log.read(self.folder.name)
        session, records = bundles.migrate(about, before)
        old = self.folder / f"events.v{about['version']}.jsonl"
        if not old.exists():
            write_whole(old, log_bytes(before))
        log.replace(self.folder.name, session, records)
        new_head(self.folder, records).close()

    def _complete(self, log: EventLog) -> None:
        """Give a database that came into the place of the first one the events that it lacks."""
        ours = [event.as_dict() for event in self.events]
        about = log.about(self.folder.name)
        if about is None:
            log.create(self.folder.name, self.session, ours)
            return
        theirs = log.read(self.folder.name)
        if self._doubtful is not None:
            if theirs == [*ours, self._doubtful.as_dict()]:
                self.events.append(self._doubtful)
                return
            self._doubtful = None
        if ours[: len(theirs)] != theirs:
            raise Conflict(f"{log.name} was replaced by one that tells another story of this session; put it back")
        log.append(self.folder.name, ours[len(theirs) :])

    def _write_head(self) -> None:
        # The event is in the log whatever becomes of the head; the next one tries again.
        if self._head is not None and self.events:
            last = self.events[-1]
            try:
                self._head.write(last.seq, last.hash)
            except OSError as err:
                logging.getLogger(__name__).error("the head of session %s is not written: %s", self.folder.name, err)

    def _opened(self) -> EventLog:
        if self._log is None:
            raise Conflict("the session is closed")
        return self._log

    def _let_go(self) -> None:
        log, head, self._log, self._head = self._log, self._head, None, None
        if log is not None:
            log.close()
        if head is not None:
            head.close()
        self._lock.release()


def read_session(source: str | os.PathLike[str] | bytes) -> Bundle:
    """Read a bundle (folder, zip file, bytes), or a session of a working folder while others may write to it.

    Raises InvalidBundle as :func:`footfall.io.bundles.read_bundle`.
    """
    if isinstance(source, bytes):
        return bundles.read_bundle(source)
    folder = Path(source).absolute()
    if not folder.is_dir() or has_plain_log(folder) or not has_log(folder.parent):
        return bundles.read_bundle(source)
    # the head first: while others write, the log that is read after it is as long or longer
    head = read_head(folder)
    with contextlib.closing(open_log(folder.parent, create=False)) as log:
        about = log.about(folder.name)
        if about is None:
            raise InvalidBundle(_unknown(folder), session=folder.name)
        session, records = bundles.migrate(about, log.read(folder.name))
    found = compare(head, records)
    if found.lost:
        raise InvalidBundle(f"session {folder.name}: {found.text}", session=folder.name)
    return bundle_of(folder, session, records)


def remove_session(folder: Path) -> None:
    """Remove a session that nobody has open, with all that belongs to it. Raises Conflict where somebody has."""
    with sole_writer(folder):
        # what is left of a folder without its events can't be taken for a session
        leaving = folder.with_name(LEAVING + folder.name)
        folder.rename(leaving)
        with contextlib.closing(open_log(folder.parent)) as log:
            log.forget(folder.name)
        shutil.rmtree(leaving)


def bundle_of(folder: Path, session: Mapping[str, Any], records: list[Record]) -> Bundle:
    """A session of a working folder in the form that is exchanged."""
    head = {"head": {"seq": records[-1]["seq"], "hash": records[-1]["hash"]}} if records else {}
    files = {name: read for name, read in bundles.artifact_files(folder).items() if bundles.is_artifact(name)}
    return Bundle({**session, **head}, records, 0, bundles.VERSION, files)


def _unknown(folder: Path) -> str:
    return (
        f"the events of session {folder.name} are not in {log_name(folder.parent)}, which was removed or replaced. "
        "Put it back from a backup; a bundle of the session can be imported as well"
    )
