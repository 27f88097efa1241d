"""Whether a PostgreSQL server can keep the sessions of a data folder. Asks it, and changes nothing."""

from contextlib import closing
from typing import Any

import psycopg

from footfall.core.errors import Conflict
from footfall.session.storage.databases import Binding, require_address
from footfall.session.storage.postgres_connection import BoundedConnection, conninfo
from footfall.session.storage.postgres_schema import table_version

OLDEST = 14
"""The earliest major version of PostgreSQL that has all that is asked of it."""


def look(url: str, bound: Binding | None) -> str:
    """What is there. bound: what the data folder says of its database; None: it has none yet.

    Raises a FootFallError that says what is wrong and what to do.
    """
    require_address(url)
    try:
        with closing(BoundedConnection.connect(conninfo(url), autocommit=True)) as database:
            return _looked(database, bound)
    except psycopg.Error as err:
        reason = str(err).strip().replace("\n", "; ")
        raise Conflict(
            f"{url} can't be used ({reason}); does the server run, is the address right, does its pg_hba.conf let this "
            "machine in, is the password in ~/.pgpass or PGPASSWORD?"
        ) from err


def _looked(database: psycopg.Connection[Any], bound: Binding | None) -> str:
    version = database.info.server_version // 10_000
    if version < OLDEST:
        raise Conflict(f"the server is PostgreSQL {version}; FootFall needs {OLDEST} or later")
    for name in ("fsync", "full_page_writes"):
        if _one(database, "SELECT current_setting(%s)", name) != "on":
            raise Conflict(f"the server runs with {name} off: what it says is written may be lost; turn that on")
    if _one(database, "SELECT pg_is_in_recovery()"):
        raise Conflict("the server is a standby, which lets nobody write; give the address of the primary")
    tables = table_version(database)
    if tables == 0:
        if bound is not None:
            raise Conflict(
                "the data folder has its sessions in a database, but this one holds no tables of FootFall (any more); "
                "give another address, or bring the database back from a backup"
            )
        if not _one(database, "SELECT has_schema_privilege(current_schema(), 'CREATE')"):
            raise Conflict("this user may not make tables in the database; grant CREATE on its schema, or own one")
        return f"PostgreSQL {version}, no tables yet: `footfall serve --store` makes them"
    if bound is None or _one(database, "SELECT id FROM store") != bound.id:
        raise Conflict("the database belongs to another data folder; give that one (--data), or another database")
    if not _one(database, "SELECT has_table_privilege('events', 'INSERT')"):
        raise Conflict("this user may not write to the tables; grant the right, or give another user")
    sessions = _one(database, "SELECT count(*) FROM sessions")
    return f"PostgreSQL {version}, tables {tables}, {sessions} sessions"


def _one(database: psycopg.Connection[Any], query: str, *values: str) -> Any:
    row = database.execute(query.encode(), values or None).fetchone()
    return None if row is None else row[0]
