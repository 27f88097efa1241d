"""``footfall worker``: takes jobs from the database, has processes of its own do them, and tells how far they are."""

import asyncio
import contextlib
import logging
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import procrastinate
import psycopg
from procrastinate.connector import Notify
from procrastinate.exceptions import ConnectorException
from procrastinate.job_context import AbortReason, JobContext
from procrastinate.worker import Worker
from psycopg_pool import PoolTimeout
from structlog.contextvars import bound_contextvars

from footfall.core.errors import FootFallError, InvalidInput, WorkerLost
from footfall.core.value import Value
from footfall.session.jobs.job import Job
from footfall.session.jobs.local import Jobs
from footfall.session.remote.exchange import Exchange, error_text
from footfall.session.remote.job_board import HEARTBEAT, QUEUE, SILENCE, TASK, JobBoard
from footfall.session.storage.databases import binding
from footfall.session.storage.postgres_connection import conninfo

PERIOD = 0.1
"""How often a job is looked after [s]."""
AGAIN = 2.0
"""How long is waited where the database can't be reached [s]."""

_log = logging.getLogger(__name__)


def serve_jobs(
    data: Path,
    workers: int = 2,
    recipes: str = "footfall.session.jobs.recipes",
    on_ready: Callable[[], None] = lambda: None,
) -> None:
    """Work until SIGINT or SIGTERM. data: the folder that the servers share, bound to their database.

    Raises InvalidInput where it is bound to none.
    """
    bound = binding(data)
    if bound is None:
        raise InvalidInput(f"{data} keeps its sessions in SQLite; its server does all work itself and needs no workers")
    with Jobs(recipes, workers=workers, warm=True) as pool:
        board = JobBoard(bound.url)
        try:
            asyncio.run(_serve(bound.url, data, pool, board, workers, on_ready))
        finally:
            board.close()


def serve_jobs_beside(data: Path, workers: int = 2) -> None:
    """As :func:`serve_jobs`, in a process that ends with the one that started it."""

    def end_with_server() -> None:
        server = parent_process()
        if server is not None:
            server.join()
            os._exit(1)

    threading.Thread(target=end_with_server, daemon=True).start()
    serve_jobs(data, workers)


async def _serve(url: str, data: Path, pool: Jobs, board: JobBoard, workers: int, on_ready: Callable[[], None]) -> None:
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    stopping = asyncio.create_task(stop.wait())
    while not stop.is_set():
        # one connection listens all the time; one of the others tells that the worker is there, whatever it does
        connector = _Connector(conninfo=conninfo(url), min_size=2, max_size=workers + 4, timeout=5.0)
        app = procrastinate.App(connector=connector)
        work = _Work(data, pool, board)
        app.task(name=TASK, queue=QUEUE, pass_context=True)(work.make)
        worker = Worker(
            app,
            queues=[QUEUE],
            concurrency=workers,
            fetch_job_polling_interval=2.0,
            abort_job_polling_interval=0.5,
            shutdown_graceful_timeout=0.0,
            install_signal_handlers=False,
            update_heartbeat_interval=HEARTBEAT,
            stalled_worker_timeout=SILENCE,
        )
        try:
            await asyncio.to_thread(board.prepare)
            async with app.open_async():
                working = asyncio.create_task(worker.run())
                failing = asyncio.create_task(_until_unheard(board, worker, work))
                on_ready()
                await asyncio.wait((working, stopping, failing), return_when=asyncio.FIRST_COMPLETED)
                failing.cancel()
                working.cancel()  # it waits for its jobs, which are told to end
                with contextlib.suppress(asyncio.CancelledError):
                    await working
        except (psycopg.Error, ConnectorException, PoolTimeout) as err:
            _log.warning("the database can't be reached: %s", err)
        if not stop.is_set():
            await asyncio.wait((stopping,), timeout=AGAIN)


class _Connector(procrastinate.PsycopgConnector):
    """Listens again after the database was lost; procrastinate's own would end for good, unseen by its worker."""

    async def listen_notify(self, on_notification: Notify, channels: Iterable[str]) -> None:
        names = list(channels)
        while True:
            try:
                await super().listen_notify(on_notification, names)
            except ConnectorException as err:
                _log.warning("new jobs are not heard of at once: %s", err.__cause__ or err)
            await asyncio.sleep(AGAIN)


async def _until_unheard(board: JobBoard, worker: Worker, work: "_Work") -> None:
    """Returns once servers no longer hear of a worker, which would give up all that it does, or of how a job ended."""
    heard = time.monotonic()
    while not work.unheard.is_set() and time.monotonic() - heard < SILENCE / 2:
        await asyncio.sleep(HEARTBEAT)
        number = worker.worker_id
        try:
            if number is not None and await asyncio.to_thread(board.hears, number):
                heard = time.monotonic()
        except psycopg.Error as err:
            _log.warning("the database can't be reached: %s", err)


class _Work:
    """What a worker does with one job after another, in threads of procrastinate's."""

    def __init__(self, data: Path, pool: Jobs, board: JobBoard) -> None:
        self._data, self._pool, self._board = data, pool, board
        self.unheard = threading.Event()
        """The end of a job could not be told. Its server waits as long as this worker is heard of, so that must end."""

    def make(
        self,
        context: JobContext,
        *,
        job: str,
        kind: str,
        session: str,
        parents: dict[str, str],
        settings: str | None,
        server: str,
    ) -> None:
        """One product; what became of it is told on the board."""
        with bound_contextvars(job=job, session=session):
            exchange = Exchange(self._data, job, session)
            made: list[str] = []

            def done(_: Job, product: Value | bytes) -> str:
                made.append(exchange.put_product(product))
                return made[-1]

            def preview(_: Job, product: Value) -> None:
                self._board.show(job, exchange.put_product(product))

            try:
                if not self._is_awaited(server):
                    return
                self._board.tell(job, 0.0, "starting")
                values = {name: exchange.get(digest) for name, digest in parents.items()}
                asked = None if settings is None else exchange.get(settings)
                local = self._pool.submit(kind, values, asked, done, on_preview=preview, session=session)
                lost = self._look_after(context, job, local, server)
                error = lost or local.error
            except FootFallError as err:
                error = err
            except OSError as err:
                error = FootFallError(f"the shared folder can't be used: {err.strerror or err}")
            except Exception as err:
                _log.exception("the %s can't be made", kind)
                error = WorkerLost(f"the worker could not make the {kind}: {type(err).__name__}: {err}")
            self._tell_end(job, made[-1] if made and error is None else None, error and error_text(error))

    def _tell_end(self, job: str, result: str | None, error: str | None) -> None:
        """Tries again for as long as servers wait for a worker: what was made outlives a lost database."""
        until = time.monotonic() + SILENCE
        while True:
            try:
                self._board.end(job, result, error)
                return
            except psycopg.Error as err:
                _log.warning("the end of a job can't be told: %s", err)
                if time.monotonic() > until:
                    self.unheard.set()
                    raise
            time.sleep(AGAIN / 4)

    def _is_awaited(self, server: str) -> bool:
        """Whether the server that asks is there, or comes back soon."""
        until = time.monotonic() + AGAIN
        while not (there := self._board.is_there(server)) and time.monotonic() < until:
            time.sleep(PERIOD)
        return there

    def _look_after(self, context: JobContext, job: str, local: Job, server: str) -> FootFallError | None:
        """Until it ended. Returns why, where this worker and not its work is the reason."""
        sent: Any = None
        there = time.monotonic()
        asked = there
        lost: FootFallError | None = None
        while not local.wait(PERIOD):
            now = time.monotonic()
            if context.should_abort() and not local.cancel_asked.is_set():
                if context.abort_reason() is AbortReason.SHUTDOWN:
                    lost = WorkerLost(f"the worker that made the {local.kind} was ended; ask again for another")
                local.cancel()
            try:
                if now - asked > 1.0:
                    asked = now
                    wanted = [one.status for one in self._board.look([context.job.id or 0])] == ["doing"]
                    if wanted and self._board.is_there(server):
                        there = now
                    elif not wanted or now - there > SILENCE:
                        local.cancel()  # nobody waits for it any more
                if local.state == "running" and (local.fraction, local.text) != sent:
                    sent = local.fraction, local.text
                    self._board.tell(job, *sent)
            except psycopg.Error as err:
                _log.warning("a job can't be told of: %s", err)
        return lost
