"""Tables of the database of sessions, and how one of an older version of FootFall is brought up to date."""

import sqlite3
import time
from collections.abc import Sequence
from typing import Final

from footfall.core.errors import InvalidBundle
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.event_log import START

SCHEMAS: tuple[tuple[str, ...], ...] = (
    (
        # about: JSON. digest: of that text, so that damage shows.
        "CREATE TABLE sessions (id TEXT PRIMARY KEY, about TEXT NOT NULL, digest TEXT NOT NULL) WITHOUT ROWID",
        # time has no type: 1 and 1.0 have different hashes and must come back as they were.
        """CREATE TABLE events (
            session TEXT NOT NULL REFERENCES sessions (id),
            seq INTEGER NOT NULL, time NOT NULL, type TEXT NOT NULL, payload TEXT NOT NULL,
            previous TEXT NOT NULL, hash TEXT NOT NULL,
            PRIMARY KEY (session, seq)
        ) WITHOUT ROWID""",
        # Events leave only together with their session, which has to be named here first.
        "CREATE TABLE leaving (session TEXT PRIMARY KEY) WITHOUT ROWID",
        f"""CREATE TRIGGER events_follow BEFORE INSERT ON events
            WHEN NEW.seq IS NOT (SELECT coalesce(max(seq) + 1, 0) FROM events WHERE session = NEW.session)
              OR NEW.previous IS NOT coalesce(
                (SELECT hash FROM events WHERE session = NEW.session ORDER BY seq DESC LIMIT 1), '{START}')
            BEGIN SELECT raise(ABORT, 'an event must follow the last one of its session'); END""",
        """CREATE TRIGGER events_stay BEFORE UPDATE ON events
            BEGIN SELECT raise(ABORT, 'events are never changed'); END""",
        """CREATE TRIGGER events_remain BEFORE DELETE ON events
            WHEN OLD.session NOT IN (SELECT session FROM leaving)
            BEGIN SELECT raise(ABORT, 'events are never removed one by one'); END""",
    ),
    # The list of sessions tells the latest names without reading the logs.
    ("CREATE INDEX names ON events (session, seq) WHERE type = 'session_renamed'",),
)
"""Statements that lead from version n (the index; 0: an empty database) to version n + 1."""


RENAMED_SESSIONS: Final = "SELECT session, payload FROM events WHERE type = 'session_renamed' ORDER BY session, seq"
"""Every new name of every session, its latest last: what the index ``names`` holds. Both kinds of database take it."""


def bring_up(database: sqlite3.Connection, schemas: Sequence[Sequence[str]] = SCHEMAS) -> None:
    """Bring a database (in autocommit mode) to the newest version, all or nothing.

    Raises InvalidBundle where a later version of FootFall wrote it.
    """
    if _version(database, len(schemas)) == len(schemas):
        return
    database.execute("BEGIN IMMEDIATE")
    try:
        # another process may have done it while this one waited
        for version in range(_version(database, len(schemas)), len(schemas)):
            if version == 0:
                database.execute("CREATE TABLE schema_versions (version INTEGER PRIMARY KEY, software TEXT, time REAL)")
            for statement in schemas[version]:
                database.execute(statement)
            row = (version + 1, SOFTWARE_VERSION, time.time())
            database.execute("INSERT INTO schema_versions VALUES (?, ?, ?)", row)
        database.execute("COMMIT")
    except BaseException:
        if database.in_transaction:
            database.execute("ROLLBACK")
        raise


def _version(database: sqlite3.Connection, newest: int) -> int:
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not tables:
        return 0
    if "schema_versions" not in tables:
        raise InvalidBundle("the database is none of FootFall's", tables=sorted(tables))
    (version,) = database.execute("SELECT max(version) FROM schema_versions").fetchone()
    return readable(version, newest)


def readable(version: object, newest: int) -> int:
    """A version of tables that is one of this FootFall's, 1…``newest``. Raises InvalidBundle for another."""
    if type(version) is not int or not 0 < version <= newest:
        raise InvalidBundle(
            f"the database was written by a later version of FootFall (tables {version}, this one reads up to "
            f"{newest}); update FootFall",
            version=version,
            readable=newest,
        )
    return version
