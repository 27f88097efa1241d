"""Accounts in the PostgreSQL database of the sessions: one set for all servers of a data folder.

Who asks is recognised with every request, and no request, least of all a stop, may wait for a network. So a server
knows all keys by heart, and looks every second whether something was changed elsewhere; what it changes itself counts
at once.
"""

import contextlib
import errno
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from psycopg import errors

from footfall.io.account_store import AccountStore, AlreadyThere, Change, Key
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.postgres_connection import BoundedConnection
from footfall.session.storage.postgres_server import connected, translated

LOOK_AGAIN = 1.0
"""How often is asked whether something was changed elsewhere [s]."""
UNHEARD = 5.0
"""Keys that could not be looked at again for this long are good for nothing but stops [s]."""
PATIENCE = 5.0
"""How long a change waits for another one to end [s]."""
_MARK = "SELECT (SELECT max(seq) FROM audit), (SELECT count(*) FROM keys)"


class SharedAccounts(AccountStore):
    """Tables of accounts on a server. One connection reads, one writes; both are made again where they were lost."""

    def __init__(self, url: str, store: str, clock: Callable[[], float] = time.monotonic) -> None:
        """url, store: of the database that the data folder is bound to. clock: one that never jumps [s].

        Raises StoreRefused where it can't be reached, Conflict where it is another store.
        """
        self._url, self._store, self._clock = url, store, clock
        self._reading, self._writing = threading.Lock(), threading.Lock()
        self._known: dict[str, tuple[Key, str | None]] = {}
        self._mark: Any = None
        self._heard = clock()
        self._closing = threading.Event()
        self._reader = self._connect()
        try:
            self._look()
            self._writer = self._connect()
        except BaseException:
            self._reader.close()
            raise
        self._watch = threading.Thread(target=self._look_on, name="footfall-accounts", daemon=True)
        self._watch.start()

    def close(self) -> None:
        self._closing.set()
        self._watch.join()
        self._reader.close()
        self._writer.close()

    def key(self, digest: str) -> tuple[Key, str | None] | None:
        silent = self._clock() - self._heard
        if silent > UNHEARD:
            text = f"its accounts could not be looked at for {silent:z.0f} s; see to the server and the network to it"
            raise StoreRefused(errno.ENOTCONN, text, self._url)
        return self._known.get(digest)

    @contextlib.contextmanager
    def change(self) -> Iterator[Change]:
        with self._writing, translated(self._url):
            self._writer = self._usable(self._writer)
            with self._writer.transaction():
                # numbers of the record, the first account and the last admin are each decided by one at a time
                self._writer.execute("SELECT pg_advisory_xact_lock(hashtext('footfall accounts'))")
                yield Change(self._written)
        with contextlib.suppress(StoreRefused):
            self._look()

    def _written(self, text: str, *given: Any) -> list[Any]:
        try:
            return _rows(self._writer, text, given)
        except errors.UniqueViolation as err:
            raise AlreadyThere(str(err)) from err

    def _ask(self, text: str, *given: Any) -> list[Any]:
        with self._reading, translated(self._url):
            self._reader = self._usable(self._reader)
            return _rows(self._reader, text, given)

    def _look(self) -> None:
        """Learn all keys anew where something was changed."""
        with self._reading, translated(self._url):
            self._reader = self._usable(self._reader)
            asked = self._clock()
            with self._reader.transaction():
                self._reader.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
                mark = _rows(self._reader, _MARK, ())[0]
                if mark != self._mark:
                    text = """SELECT k.digest, k.use, k.name, k.account, k.role, k.created, k.expires, a.role
                        FROM keys k LEFT JOIN accounts a ON a.name = k.account"""
                    rows = _rows(self._reader, text, ())
                    self._known = {row[0]: (Key(*row[:-1]), row[-1]) for row in rows}
                    self._mark = mark
            self._heard = asked

    def _look_on(self) -> None:
        while not self._closing.wait(LOOK_AGAIN):
            with contextlib.suppress(StoreRefused):
                self._look()

    def _connect(self) -> BoundedConnection:
        return connected(self._url, self._store, create=False, patience=PATIENCE)

    def _usable(self, database: BoundedConnection) -> BoundedConnection:
        """The connection itself, or another one where it was lost."""
        if not database.closed:
            with contextlib.suppress(errors.OperationalError):
                database.execute("SELECT 1")
                return database
            database.close()
        return self._connect()


def _rows(database: BoundedConnection, text: str, given: tuple[Any, ...]) -> list[Any]:
    cursor = database.execute(text.replace("?", "%s").encode(), given or None)
    return [] if cursor.description is None else cursor.fetchall()
