"""Which database holds the logs of a working folder: SQLite in the folder, or a PostgreSQL server that it names.

A folder that was once bound to a server keeps its address in the file ``store``, and so every command finds it.
"""

import contextlib
import json
import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from footfall.core.errors import Conflict, InvalidBundle, InvalidInput
from footfall.session.storage.interface import EventLog
from footfall.session.storage.sqlite_log import DATABASE, SqliteLog
from footfall.session.storage.writer_lock import WriterLock

BINDING = "store"
_SCHEMES = ("postgresql://", "postgres://")


@dataclass(frozen=True)
class Binding:
    """Address of a database server, and the name by which folder and database know each other."""

    url: str
    id: str


def binding(folder: Path) -> Binding | None:
    """The server that a folder is bound to; None: SQLite. Raises InvalidBundle where the file ``store`` is damaged."""
    try:
        text = (folder / BINDING).read_text()
    except FileNotFoundError:
        return None
    try:
        return Binding(**json.loads(text))
    except (ValueError, TypeError) as err:
        path = folder / BINDING
        raise InvalidBundle(f"{path} does not name a database; put it back from a backup", file=str(path)) from err


def bind(folder: Path, url: str) -> None:
    """Keep the logs of a folder in a PostgreSQL database from now on; again with the same address changes nothing.

    Raises InvalidInput for an address that is none; Conflict where the folder has its sessions elsewhere, or the
    database belongs to another folder; StoreRefused where it can't be reached.
    """
    require_address(url)
    folder.mkdir(parents=True, exist_ok=True)
    bound = binding(folder)
    if bound is None and (folder / DATABASE).exists():
        raise Conflict(
            f"{folder} has its sessions in {DATABASE}; give a new folder (--data), and carry sessions over as bundles"
        )
    wanted = Binding(url, uuid.uuid4().hex if bound is None else bound.id)
    if wanted == bound:
        return
    _open_server(wanted, create=bound is None).close()  # only the folder's own database is taken
    partial = folder / f".{BINDING}.{wanted.id}.partial"
    partial.write_text(json.dumps({"url": wanted.url, "id": wanted.id}) + "\n")
    os.replace(partial, folder / BINDING)


def open_log(folder: Path, create: bool = True) -> EventLog:
    """The database of a working folder. Raises FileNotFoundError where there is none and ``create`` is off."""
    bound = binding(folder)
    return SqliteLog(folder / DATABASE, create) if bound is None else _open_server(bound, create)


@contextlib.contextmanager
def looking(folder: Path) -> Iterator[EventLog]:
    """The database of a working folder, to be read only, also where nothing in the folder can be written.

    SQLite writes beside a database even to read it; of a folder that can't be written a copy is read. Raises
    FileNotFoundError where there is none.
    """
    database = folder / DATABASE
    if binding(folder) is not None or not database.is_file() or (os.access(folder, os.W_OK) and _writable(database)):
        with contextlib.closing(open_log(folder, create=False)) as log:
            yield log
        return
    with tempfile.TemporaryDirectory(prefix="footfall-look-") as beside:
        for path in (database, folder / f"{DATABASE}-wal"):
            if path.is_file():
                shutil.copyfile(path, Path(beside) / path.name)
        with contextlib.closing(SqliteLog(Path(beside) / DATABASE, create=False)) as log:
            yield log


def _writable(database: Path) -> bool:
    beside = (database, *(database.with_name(f"{DATABASE}{ending}") for ending in ("-wal", "-shm")))
    return all(os.access(path, os.W_OK) for path in beside if path.exists())


def has_log(folder: Path) -> bool:
    """Whether a folder has a database; one on a server may be out of reach."""
    return (folder / BINDING).is_file() or (folder / DATABASE).is_file()


def log_name(folder: Path) -> str:
    """What the database of a folder is called in messages."""
    bound = binding(folder)
    return DATABASE if bound is None else bound.url


@contextlib.contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """Nobody else writes to a session, on this machine or another. Raises Conflict where somebody does."""
    lock = WriterLock(folder)
    try:
        with contextlib.ExitStack() as stack:
            if has_log(folder.parent):
                stack.enter_context(contextlib.closing(open_log(folder.parent))).hold(folder.name)
            yield
    finally:
        lock.release()


def require_address(url: str) -> None:
    """Raises InvalidInput unless ``url`` may be the address of a database."""
    if not url.startswith(_SCHEMES):
        raise InvalidInput(f"{url!r} names no database server; give one as postgresql://USER@HOST/DATABASE")
    if ":" in url.partition("://")[2].partition("/")[0].rpartition("@")[0] or "password=" in url:
        raise InvalidInput(
            "the address of a database must not hold a password, for others can read it; "
            "put it into ~/.pgpass or the environment variable PGPASSWORD"
        )


def require_extra(url: str) -> None:
    """Raises InvalidInput where what speaks to a server is not installed."""
    if find_spec("psycopg") is None:
        raise InvalidInput(f"{url} needs the extra `postgres`: pip install 'footfall[postgres]'")


def _open_server(bound: Binding, create: bool) -> EventLog:
    require_extra(bound.url)
    from footfall.session.storage.postgres_log import PostgresLog

    return PostgresLog(bound.url, bound.id, create)
