"""The logs of all sessions of a data folder in a PostgreSQL database: every commit on the server's disk.

Several machines may share it. Who writes to a session holds an advisory lock on the connection that it writes with,
so that losing the one is losing the other.
"""

import contextlib
import errno
import hashlib
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg
from psycopg import errors

from footfall.core.errors import Conflict, FootFallError, InvalidBundle
from footfall.io.event_log import Record, require_chain
from footfall.session.storage.interface import Listed, OutcomeUnknown, StoreRefused
from footfall.session.storage.postgres_connection import BoundedConnection, conninfo
from footfall.session.storage.postgres_schema import bring_up, damage
from footfall.session.storage.sqlite_log import SqliteLog

PATIENCE = 1.0
"""How long another program's lock on the tables is waited for [s]."""

_REFUSALS: tuple[tuple[type[psycopg.Error], int, str], ...] = (
    (errors.LockNotAvailable, errno.EBUSY, "another program holds its tables locked; end that program's work on them"),
    (errors.DiskFull, errno.ENOSPC, "there is no room for it; make room on the server's disk"),
    (errors.ReadOnlySqlTransaction, errno.EROFS, "it only lets read: is it a standby? Give the address of the primary"),
    (
        errors.InsufficientPrivilege,
        errno.EACCES,
        "this user may not write to it; grant the right, or give another user",
    ),
)
_INSERT = "INSERT INTO events VALUES (%s, %s, %s, %s, %s, %s, %s)"
_EVENTS = "SELECT seq, time, type, payload, previous, hash FROM events WHERE session = %s ORDER BY seq"


class PostgresLog:
    """An EventLog (:mod:`footfall.session.storage.interface`) on a server.

    Calls of several threads must not overlap.
    """

    def __init__(self, url: str, store: str, create: bool = True) -> None:
        """url: as libpq reads it. store: id of the store that the database has to be, or becomes.

        Raises FileNotFoundError where it has no tables and ``create`` is off, Conflict where it is another store or
        promises no durability, and as EventLog's methods.
        """
        self.name = url
        self.remedy = f"Bring {url} back to its latest state, from its archive of write-ahead logs or a standby"
        self._store = store
        self._held: list[str] = []
        self._connect(create)

    def hold(self, session: str) -> None:
        key = f"{self._store}/{session}"
        deadline = time.monotonic() + PATIENCE  # the connection of a process that was just killed lasts a moment
        while True:
            with self._translated():
                got = self._database.execute("SELECT pg_try_advisory_lock(hashtextextended(%s, 0))", (key,)).fetchone()
            if got is not None and got[0]:
                break
            if time.monotonic() > deadline:
                raise Conflict(f"session {session} is open on another server; close it there", session=session)
            time.sleep(0.02)
        if session not in self._held:
            self._held.append(session)

    def sessions(self) -> list[Listed]:
        query = """SELECT id, about, (SELECT count(*) FROM events WHERE session = id),
            (SELECT time FROM events WHERE session = id ORDER BY seq DESC LIMIT 1)
            FROM sessions ORDER BY id COLLATE "C" """
        with self._translated():
            rows = self._database.execute(query).fetchall()
        return [
            Listed(id, self._object(id, about), events, None if latest is None else float(self._parsed(id, latest)))
            for id, about, events, latest in rows
        ]

    def about(self, session: str) -> dict[str, Any] | None:
        with self._translated():
            row = self._database.execute("SELECT about, digest FROM sessions WHERE id = %s", (session,)).fetchone()
        if row is None:
            return None
        if row[1] != _digest(row[0]):
            raise InvalidBundle(f"{self.name}: what it says of session {session} was changed", session=session)
        return self._object(session, row[0])

    def read(self, session: str) -> list[Record]:
        with self._translated():
            rows = self._database.execute(_EVENTS, (session,)).fetchall()
        records: list[Record] = []
        for seq, at, type, payload, previous, chained in rows:
            told, content = self._parsed(session, at), self._object(session, payload)
            found = {"seq": seq, "time": told, "type": type, "payload": content, "previous": previous, "hash": chained}
            records.append(found)
        require_chain(records, f"{self.name}, session {session}:")
        return records

    def create(self, session: str, about: Mapping[str, Any], records: Sequence[Record] = ()) -> None:
        with self._transaction():
            self._insert_session(session, about)
            self._insert(session, records)

    def append(self, session: str, records: Sequence[Record]) -> None:
        if not records:
            return
        try:
            self._add(session, records)
        except StoreRefused:
            if not self._database.closed:
                raise
            try:
                self.reopen()
                if self._last(session) != (records[-1]["seq"], records[-1]["hash"]):
                    self._add(session, records)
            except (FootFallError, OSError) as err:
                text = err.message if isinstance(err, FootFallError) else str(err.strerror or err)
                raise OutcomeUnknown(errno.ENOTCONN, text, self.name) from err

    def replace(self, session: str, about: Mapping[str, Any], records: Sequence[Record]) -> None:
        with self._transaction():
            self._remove(session)
            self._insert_session(session, about)
            self._insert(session, records)

    def forget(self, session: str) -> None:
        with self._transaction():
            self._remove(session)

    def displaced(self) -> bool:
        return self._database.closed

    def reopen(self) -> None:
        before = self._backend
        self.close()
        self._connect(create=False)
        try:
            with self._translated():
                # the server may not have noticed that the old connection is lost, which still holds the locks
                query = """SELECT pg_terminate_backend(pid, 1000) FROM pg_locks
                    WHERE locktype = 'advisory' AND pid = %s AND pid <> pg_backend_pid()"""
                self._database.execute(query, (before,))
            for session in self._held:
                self.hold(session)
        except BaseException:
            self.close()  # nothing is written without the lock
            raise

    def close(self) -> None:
        self._database.close()

    def damage(self) -> list[str]:
        with self._translated():
            return damage(self._database)

    def copy_to(self, path: Path, sessions: Sequence[str]) -> None:
        with contextlib.closing(SqliteLog(path)) as copy, self._transaction():
            self._database.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
            rows = self._database.execute("SELECT id, about, digest FROM sessions").fetchall()
            for session, about, digest in rows:
                if session in sessions:
                    events = self._database.execute(_EVENTS, (session,)).fetchall()
                    told = [(session, seq, self._parsed(session, at), *rest) for seq, at, *rest in events]
                    copy.take(session, about, digest, told)

    # -- inside ----------------------------------------------------------------------------------

    def _connect(self, create: bool) -> None:
        with self._translated():
            self._database = BoundedConnection.connect(conninfo(self.name), autocommit=True)
        try:
            self._prepare(create)
        except BaseException:
            self._database.close()
            raise
        self._backend = self._database.info.backend_pid

    def _prepare(self, create: bool) -> None:
        with self._translated():
            for name in ("fsync", "full_page_writes"):
                if self._setting(name) != "on":
                    text = f"{self.name} runs with {name} off: what it says is written may be lost; turn that on"
                    raise Conflict(text, setting=name)
            if self._setting("synchronous_commit") in ("off", "local"):
                self._database.execute("SET synchronous_commit = on")
            self._database.execute(f"SET lock_timeout = {int(PATIENCE * 1000)}".encode())
            for name, seconds in (("idle", 10), ("interval", 5), ("count", 3)):
                # the locks of a machine that lost its power must not last for the hours that are usual
                self._database.execute(f"SET tcp_keepalives_{name} = {seconds}".encode())
            bring_up(self._database, self._store, create)

    def _setting(self, name: str) -> str:
        row = self._database.execute("SELECT current_setting(%s)", (name,)).fetchone()
        return "" if row is None else row[0]

    def _last(self, session: str) -> tuple[int, str] | None:
        with self._translated():
            query = "SELECT seq, hash FROM events WHERE session = %s ORDER BY seq DESC LIMIT 1"
            return self._database.execute(query, (session,)).fetchone()

    def _insert_session(self, session: str, about: Mapping[str, Any]) -> None:
        text = json.dumps({key: about[key] for key in about if key != "head"}, sort_keys=True, allow_nan=False)
        self._database.execute("INSERT INTO sessions VALUES (%s, %s, %s)", (session, text, _digest(text)))

    def _add(self, session: str, records: Sequence[Record]) -> None:
        # one statement is a transaction by itself, and one way to the server and back
        with self._translated() if len(records) == 1 else self._transaction():
            self._insert(session, records)

    def _insert(self, session: str, records: Sequence[Record]) -> None:
        rows = [
            (session, r["seq"], _json(r["time"]), r["type"], _json(r["payload"]), r["previous"], r["hash"])
            for r in records
        ]
        if len(rows) == 1:
            self._database.execute(_INSERT, rows[0])
        else:
            with self._database.cursor() as cursor:
                cursor.executemany(_INSERT, rows)

    def _remove(self, session: str) -> None:
        self._database.execute("INSERT INTO leaving VALUES (%s)", (session,))
        self._database.execute("DELETE FROM events WHERE session = %s", (session,))
        self._database.execute("DELETE FROM sessions WHERE id = %s", (session,))
        self._database.execute("DELETE FROM leaving WHERE session = %s", (session,))

    def _object(self, session: str, text: str) -> dict[str, Any]:
        content = self._parsed(session, text)
        if not isinstance(content, dict):
            raise InvalidBundle(f"{self.name}, session {session}: a text in it is no object", session=session)
        return content

    def _parsed(self, session: str, text: str) -> Any:
        try:
            return json.loads(text)
        except (ValueError, RecursionError) as err:
            raise InvalidBundle(f"{self.name}, session {session}: a text in it is no JSON", session=session) from err

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._translated(), self._database.transaction():
            yield

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except errors.IntegrityError as err:
            raise Conflict(f"{self.name} refused what was to be written: {_first_line(err)}") from err
        except (errors.DataCorrupted, errors.IndexCorrupted) as err:
            raise InvalidBundle(f"{self.name} is damaged: {_first_line(err)}", file=self.name) from err
        except psycopg.Error as err:
            for kind, number, advice in _REFUSALS:
                if isinstance(err, kind):
                    raise StoreRefused(number, f"{advice} (PostgreSQL: {_first_line(err)})", self.name) from err
            text = "it can't be reached, or does not work as it should; see to the server and the network to it"
            raise StoreRefused(errno.EIO, f"{text} (PostgreSQL: {_first_line(err)})", self.name) from err


def _first_line(err: Exception) -> str:
    return str(err).strip().partition("\n")[0]


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
