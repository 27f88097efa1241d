"""The pool of jobs that workers on any machine take from the database: the same to its sessions as a local one."""

import contextlib
import errno
import logging
import secrets
import threading
from collections.abc import Mapping
from pathlib import Path

import procrastinate
import psycopg
from procrastinate.exceptions import ConnectorException
from psycopg_pool import PoolTimeout

from footfall.core.errors import Cancelled, Conflict, FootFallError, WorkerLost
from footfall.core.value import Value
from footfall.session.jobs.job import Job
from footfall.session.jobs.pool import JobPool
from footfall.session.remote.exchange import Exchange, error_of, remove_forgotten
from footfall.session.remote.job_board import QUEUE, SILENCE, TASK, JobBoard, SeenJob, connector
from footfall.session.storage.interface import StoreRefused

POLL = 0.1
"""How often the database is asked about jobs on their way [s]."""


class _Sent:
    """A job on its way, and what of it was seen."""

    def __init__(self, job: Job, exchange: Exchange) -> None:
        self.job, self.exchange = job, exchange
        self.reported: tuple[float, str] | None = None
        self.preview: str | None = None
        self.cancel_unheard = False


class RemoteJobs(JobPool):
    """Jobs for ``footfall worker``. Thread-safe.

    url: of the database. data: the folder that server and workers share. Making it, and submitting, raise StoreRefused
    where the database can't be reached.
    """

    def __init__(self, url: str, data: Path, queue_limit: int = 32) -> None:
        super().__init__(queue_limit)
        self._url, self._data = url, data
        self._name = secrets.token_hex(8)
        self._board = JobBoard(url, self._name)
        self._app = procrastinate.App(connector=connector(url))
        try:
            self._board.prepare()
            remove_forgotten(data, self._board.known())
            self._app.open()
        except (psycopg.Error, ConnectorException, PoolTimeout) as err:
            raise _refused(url, err) from err
        self._sent: dict[int, _Sent] = {}
        self._over: dict[int, str] = {}
        self._guard = threading.Lock()
        self._closing = threading.Event()
        self._watching = threading.Thread(target=self._watch, name="footfall-remote-jobs")
        self._watching.start()

    @property
    def ready(self) -> bool:
        """Whether it takes jobs: the database is there, and somebody who does them."""
        try:
            return not self._closing.is_set() and self._board.workers() > 0
        except psycopg.Error:
            return False

    def close(self) -> None:
        """Cancel what is on its way; workers go on to serve others."""
        self._closing.set()
        if self._watching is not threading.current_thread():
            self._watching.join()
        with self._guard:
            left, self._sent = self._sent, {}
        for number, one in left.items():
            self._cancel(number)
            one.job.end(error=Cancelled("the job pool was closed"))
            one.exchange.remove()
        with contextlib.suppress(psycopg.Error):
            self._drop_ended()
        self._app.close()
        self._board.close()

    # -- inside ----------------------------------------------------------------------------------

    def _take_on(self, job: Job, parents: Mapping[str, Value], settings: Value | None, urgent: bool) -> None:
        if self._closing.is_set():
            raise Conflict("the job pool is closed")
        with self._guard:
            waiting = sum(one.job.state == "queued" for one in self._sent.values())
        self._require_room(waiting)
        exchange = Exchange(self._data, job.id, job.session)
        try:
            exchange.open()
            message = {
                "job": job.id,
                "kind": job.kind,
                "session": job.session,
                "parents": {name: exchange.put(value) for name, value in parents.items()},
                "settings": None if settings is None else exchange.put(settings),
                "server": self._name,
            }
            task = self._app.configure_task(TASK, queue=QUEUE, priority=int(urgent))
            number = task.defer(**message)
        except (ConnectorException, PoolTimeout) as err:
            exchange.remove()
            raise _refused(self._url, err) from err
        except BaseException:
            exchange.remove()
            raise
        job.unqueue = lambda: self._cancel(number)
        self._records.add(job)
        with self._guard:
            self._sent[number] = _Sent(job, exchange)

    def _cancel(self, number: int) -> bool:
        """Ask for it; how it ends shows in the database."""
        try:
            self._board.cancel(number)
        except psycopg.Error as err:
            logging.getLogger(__name__).warning("a job can't be cancelled yet: %s", err)
            with self._guard:
                if number in self._sent:
                    self._sent[number].cancel_unheard = True
        return False

    def _watch(self) -> None:
        while not self._closing.wait(POLL):
            with self._guard:
                sent = dict(self._sent)
            if not sent and not self._over:
                continue
            try:
                self._follow_all(sent)
                self._drop_ended()
            except psycopg.Error as err:
                logging.getLogger(__name__).warning("jobs can't be looked after: %s", err)
                self._closing.wait(1.0)

    def _follow_all(self, sent: Mapping[int, _Sent]) -> None:
        found = {seen.number: seen for seen in self._board.look(list(sent))}
        workers = self._board.workers() if any(one.status == "todo" for one in found.values()) else 1
        for number, one in sent.items():
            try:
                self._follow(number, one, found.get(number), workers)
            except psycopg.Error as err:
                logging.getLogger(__name__).warning("job %s can't be looked after: %s", one.job.id, err)
            except Exception as err:
                logging.getLogger(__name__).exception("job %s can't be followed", one.job.id)
                text = f"the {one.job.kind} was given up: {type(err).__name__}: {err}"
                self._end(number, one, error=FootFallError(text))

    def _drop_ended(self) -> None:
        """What can't be dropped now is at the next look: a worker goes on with what it finds in the database."""
        for number, job in list(self._over.items()):
            self._board.drop(number, job)
            del self._over[number]

    def _follow(self, number: int, sent: _Sent, seen: SeenJob | None, workers: int) -> None:
        job = sent.job
        if sent.cancel_unheard:
            self._board.cancel(number)
            sent.cancel_unheard = False
        if seen is None:
            self._end(number, sent, error=WorkerLost(f"the {job.kind} was taken out of the queue by somebody else"))
        elif seen.error is not None:
            self._end(number, sent, error=error_of(seen.error))
        elif seen.result is not None:
            try:
                product = sent.exchange.product(seen.result)
            except (FootFallError, OSError) as err:
                text = f"the {job.kind} was made, but can't be read from the shared folder: {err}"
                self._end(number, sent, error=FootFallError(text))
            else:
                self._end(number, sent, product)
        elif seen.status == "todo":
            job.waits("waiting for a worker" if workers else "no worker is connected: start `footfall worker`")
        elif seen.status in ("cancelled", "aborted"):
            self._end(number, sent, error=Cancelled("cancelled before it started"))
        elif seen.status != "doing" or seen.abandoned:
            if job.cancel_asked.is_set():
                self._end(number, sent, error=Cancelled("cancelled; its worker did not answer any more"))
                return
            text = f"the worker that made the {job.kind} was lost: nothing was heard of it for {SILENCE:g} s"
            text = text if seen.abandoned else f"the worker could not make the {job.kind}; its log says why"
            self._end(number, sent, error=WorkerLost(text))
        else:
            self._report(sent, seen)

    def _report(self, sent: _Sent, seen: SeenJob) -> None:
        if sent.reported != (seen.fraction, seen.text):
            sent.reported = seen.fraction, seen.text
            sent.job.report(seen.fraction, seen.text or "starting")
        if seen.preview is not None and seen.preview != sent.preview:
            sent.preview = seen.preview
            product = sent.exchange.product(seen.preview)
            if isinstance(product, Value):
                sent.job.preview(product)

    def _end(self, number: int, sent: _Sent, product: object = None, error: FootFallError | None = None) -> None:
        with self._guard:
            if self._sent.pop(number, None) is None:
                return
        sent.job.end(product, error)
        sent.exchange.remove()
        self._over[number] = sent.job.id


def _refused(url: str, err: Exception) -> StoreRefused:
    return StoreRefused(errno.ENOTCONN, f"no work can be asked for: the database can't be reached ({err})", url)
