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
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from footfall.core.errors import Conflict, FootFallError, InvalidBundle
from footfall.io.event_log import Record, require_chain
from footfall.session.storage.interface import Listed, OutcomeUnknown, StoreRefused
from footfall.session.storage.postgres_schema import damage
from footfall.session.storage.postgres_server import connected, translated
from footfall.session.storage.schema import RENAMED_SESSIONS
from footfall.session.storage.sqlite_log import SqliteLog

PATIENCE = 1.0
"""How long another program's lock on the tables is waited for [s]."""

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
        query = """SELECT id, about, (SELECT max(seq) + 1 FROM events WHERE session = id),
            (SELECT time FROM events WHERE session = id ORDER BY seq DESC LIMIT 1)
            FROM sessions ORDER BY id COLLATE "C" """
        with self._translated():
            rows = self._database.execute(query).fetchall()
            renamed = dict(self._database.execute(RENAMED_SESSIONS).fetchall())
        return [
            Listed(
                id,
                self._object(id, about),
                events or 0,
                None if latest is None else float(self._parsed(id, latest)),
                self._object(id, renamed[id]) if id in renamed else None,
            )
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
            when, content = self._parsed(session, at), self._object(session, payload)
            found = {"seq": seq, "time": when, "type": type, "payload": content, "previous": previous, "hash": chained}
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
                    parsed = [(session, seq, self._parsed(session, at), *rest) for seq, at, *rest in events]
                    copy.take(session, about, digest, parsed)

    # -- inside ----------------------------------------------------------------------------------

    def _connect(self, create: bool) -> None:
        self._database = connected(self.name, self._store, create, PATIENCE)
        self._backend = self._database.info.backend_pid

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

    def _translated(self) -> AbstractContextManager[None]:
        return translated(self.name)


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
