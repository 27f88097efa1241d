"""Tables of the database of sessions and accounts on a PostgreSQL server, and how they are brought up to date.

They stand in the first schema of the connection's search path. The guards are the same as SQLite's
(:mod:`footfall.session.storage.schema`): events follow one another, and neither change nor leave one by one.
"""

import time
from typing import Any

import psycopg

from footfall.core.errors import Conflict, InvalidBundle
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.event_log import START
from footfall.session.storage.schema import readable

TABLES = {"schema_versions", "store", "sessions", "events", "leaving", "job_reports", "accounts", "keys", "audit"}

FUNCTIONS: dict[str, str] = {
    "events_follow": f"""
        DECLARE last record;
        BEGIN
            SELECT seq, hash INTO last FROM events WHERE session = NEW.session ORDER BY seq DESC LIMIT 1;
            IF NEW.seq <> coalesce(last.seq + 1, 0) OR NEW.previous <> coalesce(last.hash, '{START}') THEN
                RAISE EXCEPTION 'an event must follow the last one of its session' USING ERRCODE = '23000';
            END IF;
            RETURN NEW;
        END""",
    "events_stay": """
        BEGIN
            RAISE EXCEPTION 'events are never changed' USING ERRCODE = '23000';
        END""",
    "events_remain": """
        BEGIN
            IF TG_OP = 'TRUNCATE' OR NOT EXISTS (SELECT 1 FROM leaving WHERE session = OLD.session) THEN
                RAISE EXCEPTION 'events are never removed one by one' USING ERRCODE = '23000';
            END IF;
            RETURN OLD;
        END""",
}
FUNCTIONS_2: dict[str, str] = {
    "audit_stays": """
        BEGIN
            RAISE EXCEPTION 'the record is only added to' USING ERRCODE = '23000';
        END""",
}

# Name, function, when; the number is PostgreSQL's for the same (pg_trigger.tgtype).
TRIGGERS: tuple[tuple[str, str, str, int], ...] = (
    ("events_follow", "events_follow", "BEFORE INSERT ON events FOR EACH ROW", 7),
    ("events_stay", "events_stay", "BEFORE UPDATE ON events FOR EACH ROW", 19),
    ("events_remain", "events_remain", "BEFORE DELETE ON events FOR EACH ROW", 11),
    ("events_remain_all", "events_remain", "BEFORE TRUNCATE ON events FOR EACH STATEMENT", 34),
)
TRIGGERS_2: tuple[tuple[str, str, str, int], ...] = (
    ("audit_stays", "audit_stays", "BEFORE UPDATE OR DELETE ON audit FOR EACH ROW", 27),
    ("audit_stays_all", "audit_stays", "BEFORE TRUNCATE ON audit FOR EACH STATEMENT", 34),
)


def _guards(functions: dict[str, str], triggers: tuple[tuple[str, str, str, int], ...]) -> tuple[str, ...]:
    making = "CREATE FUNCTION {}() RETURNS trigger LANGUAGE plpgsql AS $$ {} $$"
    return (
        *(making.format(name, body) for name, body in functions.items()),
        *(f"CREATE TRIGGER {name} {when} EXECUTE FUNCTION {function}()" for name, function, when, _ in triggers),
    )


SCHEMAS: tuple[tuple[str, ...], ...] = (
    (
        # id: by which the database and its folder know each other
        "CREATE TABLE store (id TEXT NOT NULL, one BOOLEAN PRIMARY KEY DEFAULT true CHECK (one))",
        "CREATE TABLE sessions (id TEXT PRIMARY KEY, about TEXT NOT NULL, digest TEXT NOT NULL)",
        # time and payload: JSON as it was hashed; PostgreSQL's own types would write it otherwise
        """CREATE TABLE events (
            session TEXT NOT NULL REFERENCES sessions (id),
            seq BIGINT NOT NULL, time TEXT NOT NULL, type TEXT NOT NULL, payload TEXT NOT NULL,
            previous TEXT NOT NULL, hash TEXT NOT NULL,
            PRIMARY KEY (session, seq)
        )""",
        "CREATE TABLE leaving (session TEXT PRIMARY KEY)",
        # what workers say of jobs on their way (session/remote/); preview, result: names in the exchange
        """CREATE TABLE job_reports (
            job TEXT PRIMARY KEY, fraction DOUBLE PRECISION NOT NULL, text TEXT NOT NULL,
            preview TEXT, result TEXT, error TEXT
        )""",
        *_guards(FUNCTIONS, TRIGGERS),
    ),
    (
        # as in io/account_store
        """CREATE TABLE accounts (
            name TEXT PRIMARY KEY, role TEXT NOT NULL, password TEXT NOT NULL, created DOUBLE PRECISION NOT NULL
        )""",
        """CREATE TABLE keys (
            digest TEXT PRIMARY KEY,
            use TEXT NOT NULL CHECK (use IN ('login', 'token', 'rover')),
            name TEXT UNIQUE,
            account TEXT REFERENCES accounts (name) ON DELETE CASCADE CHECK ((account IS NULL) = (use = 'rover')),
            role TEXT, created DOUBLE PRECISION NOT NULL, expires DOUBLE PRECISION NOT NULL
        )""",
        "CREATE INDEX keys_of_account ON keys (account)",
        """CREATE TABLE audit (
            seq BIGINT PRIMARY KEY, time DOUBLE PRECISION NOT NULL, who TEXT NOT NULL, act TEXT NOT NULL,
            what TEXT NOT NULL, client TEXT NOT NULL, hash TEXT NOT NULL
        )""",
        *_guards(FUNCTIONS_2, TRIGGERS_2),
    ),
    ("CREATE INDEX names ON events (session, seq) WHERE type = 'session_renamed'",),
)
"""Statements that lead from version n (the index; 0: an empty database) to version n + 1."""

Database = psycopg.Connection[Any]


def bring_up(database: Database, store: str, create: bool, schemas: tuple[tuple[str, ...], ...] = SCHEMAS) -> None:
    """Bring a database (in autocommit mode) to the newest version, all or nothing.

    store: id of the store that it has to be, or becomes. Raises InvalidBundle where a later version of FootFall wrote
    it, or others; Conflict where it is another store; FileNotFoundError where it has no tables and ``create`` is off.
    """
    if table_version(database, len(schemas)) < len(schemas):
        with database.transaction():
            # another server may have done it while this one waited
            database.execute("SELECT pg_advisory_xact_lock(hashtext('footfall tables'))")
            begin = table_version(database, len(schemas))
            if begin == 0 and not create:
                raise FileNotFoundError("the database has no tables of FootFall")
            if begin == 0:
                database.execute(
                    "CREATE TABLE schema_versions (version INTEGER PRIMARY KEY, software TEXT, time DOUBLE PRECISION)"
                )
            for version in range(begin, len(schemas)):
                for statement in schemas[version]:
                    database.execute(statement.encode())
                row = (version + 1, SOFTWARE_VERSION, time.time())
                database.execute("INSERT INTO schema_versions VALUES (%s, %s, %s)", row)
    if create:
        database.execute("INSERT INTO store (id) VALUES (%s) ON CONFLICT DO NOTHING", (store,))
    row = database.execute("SELECT id FROM store").fetchone()
    if row is None or row[0] != store:
        raise Conflict(
            "the database belongs to another data folder; give that folder (--data), "
            "or a database of its own for this one"
        )


def damage(database: Database) -> list[str]:
    """What differs from the tables and guards that :func:`bring_up` makes."""
    triggers = database.execute(
        """SELECT tgname, proname, tgtype::int, tgenabled::text, prosrc
            FROM pg_trigger JOIN pg_proc ON pg_proc.oid = tgfoid
            WHERE tgrelid IN ('events'::regclass, 'audit'::regclass) AND NOT tgisinternal"""
    ).fetchall()
    bodies = {**FUNCTIONS, **FUNCTIONS_2}
    sound = {(name, function, kind, "O", f" {bodies[function]} ") for name, function, _, kind in TRIGGERS + TRIGGERS_2}
    keys = database.execute(
        """SELECT conrelid::regclass::text, contype::text FROM pg_constraint
            WHERE conrelid IN ('events'::regclass, 'sessions'::regclass) AND contype IN ('p', 'f')"""
    ).fetchall()
    whole = {("events", "p"), ("events", "f"), ("sessions", "p")}
    if {tuple(row) for row in triggers} != sound or {tuple(row) for row in keys} != whole:
        return ["its tables or their guards are not those of FootFall"]
    return []


def table_version(database: Database, newest: int = len(SCHEMAS)) -> int:
    """Version of the tables, 0 where there are none. Raises InvalidBundle where they are none of this FootFall's."""
    query = "SELECT tablename FROM pg_tables WHERE schemaname = current_schema()"
    tables = {name for (name,) in database.execute(query)}
    if "schema_versions" not in tables:
        if tables & TABLES:
            raise InvalidBundle("the database is none of FootFall's", tables=sorted(tables))
        return 0
    row = database.execute("SELECT max(version) FROM schema_versions").fetchone()
    return readable(None if row is None else row[0], newest)
