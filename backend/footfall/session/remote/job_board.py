"""What server and worker tell each other of jobs, beside procrastinate's own tables."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import psycopg
from procrastinate import SyncPsycopgConnector
from procrastinate.schema import SchemaManager
from psycopg.rows import class_row

from footfall.session.storage.postgres_connection import BoundedConnection, conninfo

QUEUE = "footfall"
TASK = "footfall.make"
HEARTBEAT = 1.0
"""How often a worker says that it is there [s] …"""
SILENCE = 10.0
"""… and after how long without that it is given up [s]."""

_JOBS = """
    SELECT jobs.id AS number, jobs.status::text AS status, coalesce(reports.fraction, 0) AS fraction,
        coalesce(reports.text, '') AS text, reports.preview, reports.result, reports.error,
        jobs.status = 'doing' AND (workers.last_heartbeat IS NULL
            OR workers.last_heartbeat < now() - make_interval(secs => %s)) AS abandoned
    FROM procrastinate_jobs AS jobs
    LEFT JOIN job_reports AS reports ON reports.job = jobs.args ->> 'job'
    LEFT JOIN procrastinate_workers AS workers ON workers.id = jobs.worker_id
    WHERE jobs.id = ANY(%s)"""

# who can take the lock of a server is told that it is gone; a worker that is heard of ends what it does by itself
_TIDY = """
    DELETE FROM procrastinate_jobs AS jobs WHERE queue_name = 'footfall' AND status <> 'todo'
        AND NOT (status = 'doing' AND EXISTS (
            SELECT FROM procrastinate_workers AS workers WHERE workers.id = jobs.worker_id
                AND workers.last_heartbeat >= now() - make_interval(secs => %s)))
        AND pg_try_advisory_xact_lock(hashtextextended(args ->> 'server', 1))"""


@dataclass(frozen=True)
class SeenJob:
    """One job as the database has it. status: procrastinate's word. abandoned: who does it has gone silent."""

    number: int
    status: str
    fraction: float
    text: str
    preview: str | None
    result: str | None
    error: str | None
    abandoned: bool


class JobBoard:
    """One connection, made again where it is lost. Thread-safe; all methods raise psycopg.Error."""

    def __init__(self, url: str, presence: str | None = None) -> None:
        """presence: say under this name that a server is there, as long as the connection lasts."""
        self._url = url
        self._presence = presence
        self._guard = threading.Lock()
        self._database: psycopg.Connection[Any] | None = None

    def prepare(self) -> None:
        """Make procrastinate's tables where there are none, and tidy up after servers that are gone."""
        with self._guard, self._connected().transaction():
            database = self._connected()
            database.execute("SELECT pg_advisory_xact_lock(hashtext('footfall jobs'))")
            found = database.execute("SELECT to_regclass('procrastinate_jobs')").fetchone()
            if found is None or found[0] is None:
                database.execute(SchemaManager.get_schema().encode())
            database.execute(_TIDY, (SILENCE,))
            database.execute("DELETE FROM job_reports WHERE job NOT IN (SELECT args ->> 'job' FROM procrastinate_jobs)")

    def known(self) -> set[str]:
        """Jobs that are waiting, under way, or not yet taken note of."""
        with self._guard:
            return {job for (job,) in self._connected().execute("SELECT args ->> 'job' FROM procrastinate_jobs")}

    def look(self, numbers: Sequence[int]) -> list[SeenJob]:
        """Jobs by their numbers; those that are gone are left out."""
        with self._guard, self._connected().cursor(row_factory=class_row(SeenJob)) as cursor:
            return cursor.execute(_JOBS, (SILENCE, list(numbers))).fetchall()

    def tell(self, job: str, fraction: float, text: str) -> None:
        """How far a job is."""
        query = """INSERT INTO job_reports (job, fraction, text) VALUES (%s, %s, %s)
            ON CONFLICT (job) DO UPDATE SET fraction = EXCLUDED.fraction, text = EXCLUDED.text"""
        self._run(query, job, fraction, text)

    def show(self, job: str, preview: str) -> None:
        """A coarse form of what a job makes; nothing where the job was never told of."""
        self._run("UPDATE job_reports SET preview = %s WHERE job = %s", preview, job)

    def end(self, job: str, result: str | None, error: str | None) -> None:
        """What a job made, or why it made nothing."""
        query = """INSERT INTO job_reports (job, fraction, text, result, error) VALUES (%s, 1, '', %s, %s)
            ON CONFLICT (job) DO UPDATE SET result = EXCLUDED.result, error = EXCLUDED.error"""
        self._run(query, job, result, error)

    def drop(self, number: int, job: str) -> None:
        """A job is over for its server."""
        self._run("DELETE FROM procrastinate_jobs WHERE id = %s", number)
        self._run("DELETE FROM job_reports WHERE job = %s", job)

    def cancel(self, number: int) -> None:
        """Take a job back; one that is under way is asked to stop."""
        self._run("SELECT procrastinate_cancel_job_v1(%s, true, false)", number)

    def workers(self) -> int:
        """How many workers are there."""
        query = "SELECT count(*) FROM procrastinate_workers WHERE last_heartbeat > now() - make_interval(secs => %s)"
        with self._guard:
            row = self._connected().execute(query, (SILENCE,)).fetchone()
        return 0 if row is None else row[0]

    def hears(self, worker: int) -> bool:
        """Whether that one has said lately that it is there."""
        query = """SELECT last_heartbeat > now() - make_interval(secs => %s) FROM procrastinate_workers WHERE id = %s"""
        with self._guard:
            row = self._connected().execute(query, (SILENCE / 3, worker)).fetchone()
        return row is not None and row[0]

    def is_there(self, presence: str) -> bool:
        """Whether the server of this name is."""
        with self._guard:
            # only while nobody holds it can it be taken, and it is let go at once
            query = "SELECT pg_try_advisory_xact_lock(hashtextextended(%s, 1))"
            row = self._connected().execute(query, (presence,)).fetchone()
        return row is not None and not row[0]

    def close(self) -> None:
        """Harmless when done twice."""
        with self._guard:
            if self._database is not None:
                self._database.close()

    def _run(self, query: str, *values: Any) -> None:
        with self._guard:
            self._connected().execute(query.encode(), values)

    def _connected(self) -> psycopg.Connection[Any]:
        if self._database is None or self._database.closed:
            self._database = BoundedConnection.connect(conninfo(self._url), autocommit=True)
            if self._presence is not None:
                # shared: the database may not know yet that the connection before is lost, and hold its lock
                self._database.execute("SELECT pg_advisory_lock_shared(hashtextextended(%s, 1))", (self._presence,))
        return self._database


def connector(url: str) -> SyncPsycopgConnector:
    """For who asks for work. Tried anew each time, not after pauses that grow with the time the database is away."""
    return SyncPsycopgConnector(conninfo=conninfo(url), min_size=1, max_size=4, timeout=3.0, reconnect_timeout=1.0)
