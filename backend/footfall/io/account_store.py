"""Accounts, their keys and the record of who did what: what any store of them offers, and one in a SQLite file.

Secrets arrive here hashed: passwords by argon2, keys (logins and tokens) by SHA-256. The record (``audit``) can only
be added to, and each entry carries the hash of the one before, so that a changed or lost entry shows.
"""

import contextlib
import os
import sqlite3
import stat
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from footfall.core.errors import Conflict, InvalidBundle
from footfall.io.event_log import START, Record, make_record

FILE = "accounts.sqlite"
VERSION = 1
BUSY = 5.0
"""How long a writer waits for another process to finish writing [s]."""

_SCHEMA = """
CREATE TABLE accounts (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, password TEXT NOT NULL, created REAL NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE keys (
    digest TEXT PRIMARY KEY,
    use TEXT NOT NULL CHECK (use IN ('login', 'token', 'rover')),
    name TEXT UNIQUE,
    account TEXT REFERENCES accounts(name) ON DELETE CASCADE CHECK ((account IS NULL) = (use = 'rover')),
    role TEXT, created REAL NOT NULL, expires REAL NOT NULL
) STRICT, WITHOUT ROWID;
CREATE INDEX keys_of_account ON keys(account);
CREATE TABLE audit (
    seq INTEGER PRIMARY KEY, time REAL NOT NULL, who TEXT NOT NULL, act TEXT NOT NULL, what TEXT NOT NULL,
    client TEXT NOT NULL, hash TEXT NOT NULL
) STRICT;
CREATE TRIGGER audit_keeps BEFORE UPDATE ON audit BEGIN SELECT RAISE(ABORT, 'the record is only added to'); END;
CREATE TRIGGER audit_stays BEFORE DELETE ON audit BEGIN SELECT RAISE(ABORT, 'the record is only added to'); END;
"""


@dataclass(frozen=True, slots=True)
class Account:
    """Somebody who may log in. created: [s since 1970]."""

    name: str
    role: str
    password: str
    created: float


@dataclass(frozen=True, slots=True)
class Key:
    """A hashed secret that opens the door. use: login, token or rover; name: of a token; account: whose it is.

    role: the most that a token may do; None: as much as its account. expires: [s since 1970].
    """

    secret_hash: str
    use: str
    name: str | None
    account: str | None
    role: str | None
    created: float
    expires: float


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """Who did what, when [s since 1970] and from where; what it was done to, in ``what``."""

    seq: int
    time: float
    who: str
    act: str
    what: str
    client: str


class AccountStore(ABC):
    """Where accounts are kept; thread-safe, and shared with other processes."""

    @abstractmethod
    def close(self) -> None:
        """Harmless when done twice."""

    @abstractmethod
    def key(self, digest: str) -> tuple[Key, str | None] | None:
        """A key and the present role of its account, None for a rover's. Asked with every request: never waits long."""

    @abstractmethod
    def change(self) -> AbstractContextManager["Change"]:
        """One transaction: all of it is on the disk when the block ends, or nothing where it raises."""

    @abstractmethod
    def _ask(self, text: str, *given: Any) -> list[Any]:
        """Rows as they are now."""

    def accounts(self) -> list[Account]:
        """All of them, by name."""
        return _accounts(self._ask)

    def account(self, name: str) -> Account | None:
        """The one of this name."""
        return next((one for one in self.accounts() if one.name == name), None)

    def every_key(self) -> list[Key]:
        """Every login and token."""
        return _keys(self._ask)

    def tokens(self) -> list[Key]:
        """Every token, of accounts and of rovers, by name; logins have none."""
        return sorted((key for key in self.every_key() if key.use != "login"), key=lambda key: key.name or "")

    def audit(self, after: int = -1, limit: int = 1000) -> list[AuditEntry]:
        """The record from after entry ``after`` on, oldest first."""
        text = "SELECT seq, time, who, act, what, client FROM audit WHERE seq > ? ORDER BY seq LIMIT ?"
        return [AuditEntry(*row) for row in self._ask(text, after, limit)]

    def verify_audit(self) -> int:
        """The number of entries. Raises InvalidBundle, naming the first that was changed or follows a lost one."""
        previous, seq = START, -1
        text = "SELECT seq, time, who, act, what, client, hash FROM audit ORDER BY seq"
        for seq, (number, time, who, act, what, client, written) in enumerate(self._ask(text)):
            if number != seq or _record(seq, time, who, act, what, client, previous)["hash"] != written:
                raise InvalidBundle(f"entry {seq} of the record was changed, or one before it was lost", entry=seq)
            previous = written
        return seq + 1


class AccountFile(AccountStore):
    """One SQLite file that its owner alone may read.

    Reading has a connection of its own: it never waits for a writer.
    """

    def __init__(self, path: Path) -> None:
        """Open, or make, the file. Raises Conflict where others may read it, InvalidBundle where it is no such file."""
        self.path = path
        _claim(path)
        self._writing, self._reading = threading.Lock(), threading.Lock()
        self._writer = _connect(path)
        try:
            self._prepare()
            self._reader = _connect(path)
        except BaseException:
            self._writer.close()
            raise

    def close(self) -> None:
        self._reader.close()
        self._writer.close()

    def key(self, digest: str) -> tuple[Key, str | None] | None:
        text = f"SELECT {_KEY}, a.role FROM keys k LEFT JOIN accounts a ON a.name = k.account WHERE k.digest = ?"
        found = self._ask(text, digest)
        return (Key(*found[0][:-1]), found[0][-1]) if found else None

    @contextlib.contextmanager
    def change(self) -> "Iterator[Change]":
        with self._writing:
            self._writer.execute("BEGIN IMMEDIATE")
            try:
                yield Change(self._written)
                self._writer.execute("COMMIT")
            except BaseException:
                if self._writer.in_transaction:  # a full disk may have ended it already
                    self._writer.execute("ROLLBACK")
                raise

    def _ask(self, text: str, *given: Any) -> list[Any]:
        with self._reading:
            return self._reader.execute(text, given).fetchall()

    def _written(self, text: str, *given: Any) -> list[Any]:
        try:
            return self._writer.execute(text, given).fetchall()
        except sqlite3.IntegrityError as err:
            raise AlreadyThere(str(err)) from err

    def _prepare(self) -> None:
        try:
            with self.change():
                found = self._written("PRAGMA user_version")[0][0]
                if found == 0:
                    # executescript would end the transaction first
                    for statement in _statements(_SCHEMA):
                        self._written(statement)
                    self._written(f"PRAGMA user_version = {VERSION}")
        except sqlite3.DatabaseError as err:
            raise InvalidBundle(f"{self.path} holds no accounts: {err}", path=str(self.path)) from err
        if found not in (0, VERSION):
            raise InvalidBundle(f"{self.path} was written by another version of FootFall (layout {found})")


class AlreadyThere(Exception):
    """What was to be added is there already."""


class Change:
    """What one transaction does. ask: runs a statement of it, with ``?`` for what is given; raises Taken."""

    def __init__(self, ask: Callable[..., list[Any]]) -> None:
        self._ask = ask

    def accounts(self) -> list[Account]:
        """All of them as they are within the transaction."""
        return _accounts(self._ask)

    def account(self, name: str) -> Account | None:
        """The one of this name."""
        return next((one for one in self.accounts() if one.name == name), None)

    def token(self, name: str) -> Key | None:
        """The token of this name."""
        return next((key for key in _keys(self._ask) if key.name == name and key.use != "login"), None)

    def put_account(self, account: Account) -> None:
        """Add, or replace role and password of the one with the same name."""
        self._ask(
            "INSERT INTO accounts VALUES (?, ?, ?, ?) "
            "ON CONFLICT (name) DO UPDATE SET role = excluded.role, password = excluded.password",
            *(account.name, account.role, account.password, account.created),
        )

    def remove_account(self, name: str) -> None:
        """And with it every login and token of it."""
        self._ask("DELETE FROM accounts WHERE name = ?", name)

    def put_key(self, key: Key) -> None:
        """Add. Raises Conflict where the name is taken."""
        row = (key.secret_hash, key.use, key.name, key.account, key.role, key.created, key.expires)
        try:
            self._ask("INSERT INTO keys VALUES (?, ?, ?, ?, ?, ?, ?)", *row)
        except AlreadyThere as err:
            raise Conflict(f"there is a token {key.name!r} already; revoke it first, or take another name") from err

    def remove_key(self, digest: str) -> bool:
        """Whether it was there."""
        return bool(self._ask("DELETE FROM keys WHERE digest = ? RETURNING 1", digest))

    def remove_logins(self, account: str) -> None:
        """Every login of an account."""
        self._ask("DELETE FROM keys WHERE account = ? AND use = 'login'", account)

    def remove_expired(self, now: float) -> None:
        """Logins that have ended; tokens stay listed until they are revoked."""
        self._ask("DELETE FROM keys WHERE expires <= ? AND use = 'login'", now)

    def note(self, time: float, who: str, act: str, what: str, client: str) -> None:
        """Add to the record."""
        last = self._ask("SELECT seq, hash FROM audit ORDER BY seq DESC LIMIT 1")
        seq, previous = (last[0][0] + 1, last[0][1]) if last else (0, START)
        written = _record(seq, time, who, act, what, client, previous)["hash"]
        self._ask("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?)", seq, time, who, act, what, client, written)


_KEY = "k.digest, k.use, k.name, k.account, k.role, k.created, k.expires"


def _accounts(ask: Callable[..., list[Any]]) -> list[Account]:
    # each database has an order of texts of its own
    return sorted((Account(*row) for row in ask("SELECT name, role, password, created FROM accounts")), key=_name)


def _keys(ask: Callable[..., list[Any]]) -> list[Key]:
    return [Key(*row) for row in ask(f"SELECT {_KEY} FROM keys k")]


def _name(account: Account) -> str:
    return account.name


def _record(seq: int, time: float, who: str, act: str, what: str, client: str, previous: str) -> Record:
    return make_record(seq, time, act, {"who": who, "what": what, "client": client}, previous)


def _statements(script: str) -> Iterator[str]:
    text = ""
    for part in script.splitlines(keepends=True):
        text += part
        if sqlite3.complete_statement(text):
            yield text
            text = ""


def _claim(path: Path) -> None:
    # made with these rights from the start: SQLite gives the files beside it the same
    path.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600))
    found = path.stat()
    if stat.S_IMODE(found.st_mode) & 0o077 or found.st_uid != os.geteuid():
        raise Conflict(
            f"{path} must belong to you, and others may neither read nor write it: chmod 600 {path}", path=str(path)
        )


def _connect(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, timeout=BUSY, isolation_level=None, check_same_thread=False)
    try:
        for text in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
            connection.execute(f"PRAGMA {text}").fetchall()
    except sqlite3.DatabaseError as err:
        connection.close()
        raise InvalidBundle(f"{path} holds no accounts: {err}", path=str(path)) from err
    return connection
