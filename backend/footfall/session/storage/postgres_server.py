"""A connection to the database of sessions that keeps what it says it has, and its refusals in words."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

import psycopg
from psycopg import errors

from footfall.core.errors import Conflict, InvalidBundle
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.postgres_connection import BoundedConnection, conninfo
from footfall.session.storage.postgres_schema import bring_up

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


def connected(url: str, store: str, create: bool, patience: float) -> BoundedConnection:
    """A connection to the tables of a store, brought up to date; in autocommit mode.

    store: id that the database has to have, or takes. patience: how long others' locks are waited for [s]. Raises
    FileNotFoundError where it has no tables and ``create`` is off, Conflict where it is another store or promises no
    durability, and as :func:`translated`.
    """
    with translated(url):
        database = BoundedConnection.connect(conninfo(url), autocommit=True)
        try:
            for name in ("fsync", "full_page_writes"):
                if _setting(database, name) != "on":
                    text = f"{url} runs with {name} off: what it says is written may be lost; turn that on"
                    raise Conflict(text, setting=name)
            if _setting(database, "synchronous_commit") in ("off", "local"):
                database.execute("SET synchronous_commit = on")
            database.execute(f"SET lock_timeout = {int(patience * 1000)}".encode())
            for name, seconds in (("idle", 10), ("interval", 5), ("count", 3)):
                # the locks of a machine that lost its power must not last for the hours that are usual
                database.execute(f"SET tcp_keepalives_{name} = {seconds}".encode())
            bring_up(database, store, create)
        except BaseException:
            database.close()
            raise
    return database


@contextmanager
def translated(url: str) -> Iterator[None]:
    """What psycopg raises of the database at ``url``, as EventLog's methods raise it."""
    try:
        yield
    except errors.IntegrityError as err:
        raise Conflict(f"{url} refused what was to be written: {_first_line(err)}") from err
    except (errors.DataCorrupted, errors.IndexCorrupted) as err:
        raise InvalidBundle(f"{url} is damaged: {_first_line(err)}", file=url) from err
    except psycopg.Error as err:
        for kind, number, advice in _REFUSALS:
            if isinstance(err, kind):
                raise StoreRefused(number, f"{advice} (PostgreSQL: {_first_line(err)})", url) from err
        text = "it can't be reached, or does not work as it should; see to the server and the network to it"
        raise StoreRefused(errno.EIO, f"{text} (PostgreSQL: {_first_line(err)})", url) from err


def _setting(database: BoundedConnection, name: str) -> str:
    row = database.execute("SELECT current_setting(%s)", (name,)).fetchone()
    return "" if row is None else row[0]


def _first_line(err: Exception) -> str:
    return str(err).strip().partition("\n")[0]
