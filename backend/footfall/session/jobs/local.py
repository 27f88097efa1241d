"""Long work in worker processes: queued, watched, cancelled, and survived when a worker dies."""

import contextlib
import heapq
import itertools
import logging
import multiprocessing
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

from structlog.contextvars import bound_contextvars

from footfall.core.errors import Cancelled, Conflict, FootFallError, WorkerLost
from footfall.core.value import Value
from footfall.session.jobs.job import Job
from footfall.session.jobs.pool import JobPool
from footfall.session.jobs.product_recipes import make
from footfall.session.jobs.worker import work

CANCEL_GRACE = 1.0
"""A worker that has not stopped this long after it was asked to is killed [s]."""


class InlineJobs(JobPool):
    """Jobs that run in the caller's thread, at once: for scripts, samples and tests."""

    def __init__(self, recipes: str = "footfall.session.jobs.recipes") -> None:
        super().__init__()
        self._recipes = import_module(recipes).RECIPES

    @property
    def ready(self) -> bool:
        """Always."""
        return True

    def close(self) -> None:
        """Nothing is running."""

    def _take_on(self, job: Job, parents: Mapping[str, Value], settings: Value | None, urgent: bool) -> None:
        """The job has ended when this returns."""
        self._records.add(job)
        try:
            product = make(self._recipes, job.kind, parents, settings, _Here(job))
        except FootFallError as err:
            job.end(error=err)
        else:
            job.end(product)


class _Here:
    """The progress of a job in the caller's thread, as seen by its recipe."""

    def __init__(self, job: Job) -> None:
        self.job = job

    def __call__(self, fraction: float, text: str) -> None:
        self.job.report(fraction, text)
        if self.job.cancel_asked.is_set():
            raise Cancelled("cancelled")

    def preview(self, product: Value) -> None:
        """See :func:`footfall.core.progress.preview_of`."""
        self.job.preview(product)


class Jobs(JobPool):
    """A pool of worker processes.

    recipes: module with ``RECIPES`` (kind → recipe) and optionally ``preload()``; workers import it.
    workers: number of processes. queue_limit: waiting jobs before new ones are refused.
    """

    def __init__(
        self,
        recipes: str = "footfall.session.jobs.recipes",
        workers: int = 2,
        queue_limit: int = 32,
        warm: bool = False,
    ) -> None:
        """``warm``: start the processes now, not with the first job."""
        super().__init__(queue_limit)
        self._recipes = recipes
        self._queue: list[tuple[int, int, Job, tuple[Any, ...]]] = []
        self._order = itertools.count()
        self._wake = threading.Condition()
        self._closing = False
        self._threads = [
            threading.Thread(target=self._serve, args=(warm,), name=f"footfall-worker-{i}") for i in range(workers)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def ready(self) -> bool:
        """Whether it takes jobs: all that serve workers are there."""
        return not self._closing and all(thread.is_alive() for thread in self._threads)

    def close(self) -> None:
        """Cancel what runs and waits, end the workers; returns when all are gone."""
        with self._wake:
            self._closing = True
            waiting, self._queue = self._queue, []
            self._wake.notify_all()
        for _, _, job, _ in waiting:
            job.end(error=Cancelled("the job pool was closed"))
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join()

    def _take_on(self, job: Job, parents: Mapping[str, Value], settings: Value | None, urgent: bool) -> None:
        sent = {name: (value.digest, value) for name, value in parents.items()}
        asked = None if settings is None else (settings.digest, settings)
        with self._wake:
            if self._closing:
                raise Conflict("the job pool is closed")
            self._require_room(len(self._queue))
            waiting = (not urgent, next(self._order), job, (job.kind, sent, asked))
            heapq.heappush(self._queue, waiting)
            job.unqueue = lambda: self._unqueue(waiting)
            self._records.add(job)
            self._wake.notify()

    def _serve(self, warm: bool) -> None:
        process = self._hired()
        try:
            if warm:
                process.start()
            while (taken := self._take()) is not None:
                job, message = taken
                with bound_contextvars(job=job.id, session=job.session):
                    product, error = self._run(process, job, message)
                    job.end(product, error)
        finally:
            self._dismiss(process)

    def _hired(self) -> "WorkerProcess":
        return WorkerProcess(work, self._recipes)

    def _dismiss(self, process: "WorkerProcess") -> None:
        process.stop()

    def _take(self) -> tuple[Job, tuple[Any, ...]] | None:
        with self._wake:
            while not self._queue:
                if self._closing:
                    return None
                self._wake.wait()
            _, _, job, message = heapq.heappop(self._queue)
            return job, message

    def _unqueue(self, waiting: tuple[int, int, Job, tuple[Any, ...]]) -> bool:
        """Take a job out of the queue; whether it was still there."""
        with self._wake:
            if waiting not in self._queue:
                return False
            self._queue.remove(waiting)
            heapq.heapify(self._queue)
            return True

    def _run(self, process: "WorkerProcess", job: Job, message: tuple[Any, ...]) -> tuple[Any, FootFallError | None]:
        """One job on one worker: (product, None) or (None, error).

        A worker that ended before it took the job up made nothing of it: another gets the job, once.
        """
        for tries_left in (1, 0):
            try:
                return self._exchange(process, job, message)
            except (EOFError, OSError):
                begun, code = process.begun, process.stop()
                if job.cancel_asked.is_set() or self._closing:
                    return None, Cancelled("cancelled; its worker did not take it and was ended")
                if begun or not tries_left:
                    break
            except Exception as err:
                # A value that can't cross the pipe: the two ends no longer agree where a message starts.
                process.stop()
                return None, FootFallError(f"the {job.kind} could not be exchanged with its worker: {err}")
        return None, WorkerLost(
            f"the worker process died while it made the {job.kind} (exit code {code}); a new one takes the next job",
            exit_code=code,
        )

    def _exchange(
        self, process: "WorkerProcess", job: Job, message: tuple[Any, ...]
    ) -> tuple[Any, FootFallError | None]:
        """Hand a job over and hear of it until it ends. Raises EOFError or OSError where its worker has gone."""
        pipe = process.start()
        process.begun = False
        job.report(0.0, "starting")
        with self._taken(process, job):
            pipe.send(("job", job.id, *message))
        cancel_by: float | None = None
        while True:
            if pipe.poll(0.05):
                match pipe.recv():
                    case ("begun",):
                        process.begun = True
                    case ("progress", fraction, text):
                        job.report(fraction, text)
                    case ("preview", product):
                        job.preview(product)
                    case ("log", record):
                        logging.getLogger(record.name).handle(record)
                    case ("done", product):
                        return product, None
                    case ("failed", error):
                        return None, error
            if cancel_by is None and (job.cancel_asked.is_set() or self._closing):
                cancel_by = time.monotonic() + CANCEL_GRACE
                pipe.send(("cancel", job.id))
            elif cancel_by is not None and time.monotonic() > cancel_by:
                process.stop()
                return None, Cancelled("cancelled; its worker did not stop by itself and was ended")

    @contextlib.contextmanager
    def _taken(self, process: "WorkerProcess", job: Job) -> Iterator[None]:
        """While a job is handed over: a large one waits for its worker to read, and one that hangs never does."""
        over = threading.Event()

        def watch() -> None:
            while not over.wait(0.05):
                if (job.cancel_asked.is_set() or self._closing) and not over.wait(CANCEL_GRACE):
                    process.kill()
                    return

        watching = threading.Thread(target=watch, name="footfall-hand-over", daemon=True)
        watching.start()
        try:
            yield
        finally:
            over.set()
            watching.join()


class WorkerProcess:
    """One worker process and this end of its pipe; started when needed.

    serve: what the process does with its end of the pipe and ``args``.
    begun: whether it has taken up the job that was handed to it last.
    """

    def __init__(self, serve: Callable[..., None], *args: Any) -> None:
        self._serve, self._args = serve, args
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None
        self.begun = False

    def start(self) -> Connection:
        if self._process is not None and not self._process.is_alive():
            self.stop()
        if self._process is None or self._pipe is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe(duplex=True)
            self._process = context.Process(target=self._serve, args=(theirs, *self._args), daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe

    def kill(self) -> None:
        """End it whatever it does; another thread may be writing to it, and fails then."""
        if self._process is not None:
            self._process.kill()

    def stop(self) -> int | None:
        """End the process, politely first; its exit code."""
        if self._process is None or self._pipe is None:
            return None
        process, pipe, self._process, self._pipe = self._process, self._pipe, None, None
        pipe.close()
        process.join(0.2)
        if process.is_alive():
            process.kill()
            process.join()
        code = process.exitcode
        process.close()
        return code
