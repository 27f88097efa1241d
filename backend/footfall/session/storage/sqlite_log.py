"""The logs of all sessions of a working folder in one SQLite database: write-ahead log, every commit on the disk."""

import contextlib
import errno
import hashlib
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from footfall.core.errors import Conflict, InvalidBundle
from footfall.io.event_log import Record, require_chain
from footfall.session.storage.interface import Listed, StoreRefused
from footfall.session.storage.schema import RENAMED_SESSIONS, bring_up

DATABASE = "footfall.sqlite"
PATIENCE = 1.0
"""How long another program's lock on the database is waited for [s]."""

_ERRNO = {
    sqlite3.SQLITE_BUSY: errno.EBUSY,
    sqlite3.SQLITE_LOCKED: errno.EBUSY,
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_PERM: errno.EACCES,
    sqlite3.SQLITE_AUTH: errno.EACCES,
}
_ADVICE = {
    errno.EBUSY: f"another program holds it locked for more than {PATIENCE:g} s; end that program's work on it",
    errno.ENOSPC: "there is no room for it; make room on its disk",
    errno.EROFS: "it, or its folder, can't be written; give back the permission to write",
    errno.EACCES: "it can't be opened for lack of permission",
    errno.EIO: "its disk does not read or write as it should",
}
_INSERT = "INSERT INTO events VALUES (?, ?, ?, ?, ?, ?, ?)"


class SqliteLog:
    """An EventLog (:mod:`footfall.session.storage.interface`) in one file. Calls of several threads must not overlap.

    Several processes may hold it open; SQLite lets one at a time write, and readers never wait.
    """

    def __init__(self, path: Path, create: bool = True) -> None:
        """Raises FileNotFoundError where there is none and ``create`` is off, and as EventLog's methods."""
        self.path = path
        self.name = path.name
        self.remedy = f"Put {self.name} back from a backup, together with the file {self.name}-wal beside it"
        self._create = create
        self._open()

    def hold(self, session: str) -> None:
        """The database is a file of one machine."""

    def sessions(self) -> list[Listed]:
        query = """SELECT id, about, (SELECT max(seq) + 1 FROM events WHERE session = id),
            (SELECT time FROM events WHERE session = id ORDER BY seq DESC LIMIT 1) FROM sessions ORDER BY id"""
        with self._translated():
            rows = self._database.execute(query).fetchall()
            renamed = dict(self._database.execute(RENAMED_SESSIONS).fetchall())
        return [
            Listed(
                id,
                self._parsed(id, about),
                events or 0,
                latest,
                self._parsed(id, renamed[id]) if id in renamed else None,
            )
            for id, about, events, latest in rows
        ]

    def about(self, session: str) -> dict[str, Any] | None:
        with self._translated():
            row = self._database.execute("SELECT about, digest FROM sessions WHERE id = ?", (session,)).fetchone()
        if row is None:
            return None
        if row[1] != _digest(row[0]):
            raise InvalidBundle(f"{self.name}: what it says of session {session} was changed", session=session)
        return self._parsed(session, row[0])

    def read(self, session: str) -> list[Record]:
        query = "SELECT seq, time, type, payload, previous, hash FROM events WHERE session = ? ORDER BY seq"
        with self._translated():
            rows = self._database.execute(query, (session,)).fetchall()
        label = f"{self.name}, session {session}:"
        records: list[Record] = []
        for seq, at, type, payload, previous, chained in rows:
            content = self._parsed(session, payload)
            found = {"seq": seq, "time": at, "type": type, "payload": content, "previous": previous, "hash": chained}
            records.append(found)
        require_chain(records, label)
        return records

    def create(self, session: str, about: Mapping[str, Any], records: Sequence[Record] = ()) -> None:
        with self._transaction():
            self._insert_session(session, about)
            self._database.executemany(_INSERT, _rows(session, records))

    def append(self, session: str, records: Sequence[Record]) -> None:
        rows = _rows(session, records)
        if len(rows) == 1:
            with self._translated():
                self._database.execute(_INSERT, rows[0])
            return
        with self._transaction():
            self._database.executemany(_INSERT, rows)

    def replace(self, session: str, about: Mapping[str, Any], records: Sequence[Record]) -> None:
        with self._transaction():
            self._remove(session)
            self._insert_session(session, about)
            self._database.executemany(_INSERT, _rows(session, records))

    def forget(self, session: str) -> None:
        with self._transaction():
            self._remove(session)

    def displaced(self) -> bool:
        try:
            found = os.stat(self.path)
        except OSError:
            return True
        return (found.st_dev, found.st_ino) != self._identity

    def reopen(self) -> None:
        if not self.path.exists():
            text = f"{self.name} is gone; put it back where it was. What happens meanwhile is kept for later"
            raise StoreRefused(errno.ENOENT, text, str(self.path))
        self.close()
        self._create = False
        self._open()

    def close(self) -> None:
        self._database.close()

    def damage(self) -> list[str]:
        """What SQLite itself finds wrong with the file; empty where it finds nothing."""
        tables = "SELECT type, name, sql FROM sqlite_master WHERE name NOT LIKE 'sqlite_%' ORDER BY name"
        with self._translated(), contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as sound:
            bring_up(sound)
            found = [str(row[0]) for row in self._database.execute("PRAGMA integrity_check(20)")]
            for table, *_ in self._database.execute("PRAGMA foreign_key_check"):
                found.append(f"a row of {table} belongs to no session")
            if self._database.execute(tables).fetchall() != sound.execute(tables).fetchall():
                found.append("its tables or their guards are not those of FootFall")
        return [text for text in found if text != "ok"]

    def copy_to(self, path: Path, sessions: Sequence[str]) -> None:
        with self._translated():
            copy = sqlite3.connect(path)
            try:
                self._database.backup(copy)
                copy.execute("PRAGMA journal_mode = DELETE")  # one file, nothing beside it
            finally:
                copy.close()
        with contextlib.closing(SqliteLog(path, create=False)) as log:
            for one in log.sessions():
                if one.id not in sessions:
                    log.forget(one.id)
            with log._translated():
                log._database.execute("VACUUM")  # nothing is left of the others

    def take(self, session: str, about: str, digest: str, rows: Sequence[Sequence[Any]]) -> None:
        """A session from another database as its rows are there, damage included."""
        with self._transaction():
            self._database.execute("INSERT INTO sessions VALUES (?, ?, ?)", (session, about, digest))
            self._database.executemany(_INSERT, rows)

    # -- inside ----------------------------------------------------------------------------------

    def _open(self) -> None:
        if not self._create and not self.path.is_file():
            raise FileNotFoundError(errno.ENOENT, f"there is no {self.name}", str(self.path))
        address = f"file:{quote(str(self.path.absolute()))}?mode={'rwc' if self._create else 'rw'}"
        with self._translated():
            self._database = sqlite3.connect(
                address, uri=True, timeout=PATIENCE, isolation_level=None, check_same_thread=False
            )
            try:
                self._prepare()
            except BaseException:
                self._database.close()
                raise
        found = os.stat(self.path)
        self._identity = (found.st_dev, found.st_ino)

    def _prepare(self) -> None:
        mode = self._write_ahead()
        if mode != "wal":
            text = f"{self.path.parent} can't hold a database that several programs read (is it a network folder?)"
            raise Conflict(f"{text}; choose a folder on a local disk", mode=mode)
        self._database.execute("PRAGMA synchronous = FULL")
        self._database.execute("PRAGMA foreign_keys = ON")
        bring_up(self._database)

    def _write_ahead(self) -> str:
        # SQLite does not wait where two programs make the database at the same time.
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                return self._database.execute("PRAGMA journal_mode = WAL").fetchone()[0]
            except sqlite3.OperationalError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.01)

    def _insert_session(self, session: str, about: Mapping[str, Any]) -> None:
        text = json.dumps({key: about[key] for key in about if key != "head"}, sort_keys=True, allow_nan=False)
        self._database.execute("INSERT INTO sessions VALUES (?, ?, ?)", (session, text, _digest(text)))

    def _remove(self, session: str) -> None:
        self._database.execute("INSERT INTO leaving VALUES (?)", (session,))
        self._database.execute("DELETE FROM events WHERE session = ?", (session,))
        self._database.execute("DELETE FROM sessions WHERE id = ?", (session,))
        self._database.execute("DELETE FROM leaving WHERE session = ?", (session,))

    def _parsed(self, session: str, text: str) -> dict[str, Any]:
        try:
            content = json.loads(text)
        except (ValueError, TypeError, RecursionError) as err:
            raise InvalidBundle(f"{self.name}, session {session}: a text in it is no JSON", session=session) from err
        if not isinstance(content, dict):
            raise InvalidBundle(f"{self.name}, session {session}: a text in it is no object", session=session)
        return content

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._translated():
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")
                raise

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.IntegrityError as err:
            raise Conflict(f"{self.name} refused what was to be written: {err}") from err
        except sqlite3.Error as err:
            # a text that is no UTF-8 has no code
            unnamed = sqlite3.SQLITE_CORRUPT if isinstance(err, sqlite3.OperationalError) else sqlite3.SQLITE_IOERR
            code = getattr(err, "sqlite_errorcode", unnamed) & 0xFF
            if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
                raise InvalidBundle(f"{self.name} is damaged: {err}", file=self.name) from err
            number = _ERRNO.get(code, errno.EIO)
            raise StoreRefused(number, f"{_ADVICE[number]} (SQLite: {err})", str(self.path)) from err


def _rows(session: str, records: Sequence[Record]) -> list[tuple[Any, ...]]:
    return [(session, r["seq"], r["time"], r["type"], _json(r["payload"]), r["previous"], r["hash"]) for r in records]


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
