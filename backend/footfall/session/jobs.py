"""Long work in worker processes: queued, watched, cancelled, and survived when a worker dies."""

import contextlib
import heapq
import itertools
import logging
import multiprocessing
import threading
import time
from collections.abc import Iterator, Mapping
from importlib import import_module
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any, Self

from structlog.contextvars import bound_contextvars

from footfall.core.errors import Busy, Cancelled, Conflict, FootFallError, WorkerLost
from footfall.core.value import Value
from footfall.session.job import Job, OnChange, OnDone, OnPreview, Records, Tally
from footfall.session.recipes import make
from footfall.session.worker import work

CANCEL_GRACE = 1.0
"""A worker that has not stopped this long after it was asked to is killed [s]."""


RETRY_AFTER = 5
"""When to ask again where the queue is full [s]."""


class InlineJobs:
    """Jobs that run in the caller's thread, at once: for scripts, samples and tests."""

    def __init__(self, recipes: str = "footfall.session.recipes") -> None:
        self._recipes = import_module(recipes).RECIPES
        self._records = Records()

    def submit(
        self,
        kind: str,
        parents: Mapping[str, Value],
        settings: Value | None,
        on_done: OnDone | None = None,
        on_change: OnChange | None = None,
        *,
        on_preview: OnPreview | None = None,
        session: str = "",
        urgent: bool = False,
    ) -> Job:
        """Do the work; the job has ended when this returns."""
        job = Job(kind, session, on_done, on_change, on_preview)
        self._records.add(job)
        try:
            product = make(self._recipes, kind, parents, settings, _Here(job))
        except FootFallError as err:
            job.end(error=err)
        else:
            job.end(product)
        return job

    def adopt(self, job: Job) -> None:
        """Keep the record of a job that needs no work."""
        self._records.add(job)

    def get(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self._records.get(job_id)

    def tally(self) -> dict[tuple[str, str], Tally]:
        """See :meth:`Jobs.tally`."""
        return self._records.tally()

    @property
    def ready(self) -> bool:
        """See :attr:`Jobs.ready`."""
        return True

    def close(self) -> None:
        """Nothing is running."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


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


class Jobs:
    """A pool of worker processes; close it, or use it as a context manager.

    recipes: module with ``RECIPES`` (kind → recipe) and optionally ``preload()``; workers import it.
    workers: number of processes. queue_limit: waiting jobs before new ones are refused.
    """

    def __init__(
        self, recipes: str = "footfall.session.recipes", workers: int = 2, queue_limit: int = 32, warm: bool = False
    ) -> None:
        """``warm``: start the processes now, not with the first job."""
        self._recipes = recipes
        self.queue_limit = queue_limit
        self._records = Records()
        self._queue: list[tuple[int, int, Job, tuple[Any, ...]]] = []
        self._order = itertools.count()
        self._wake = threading.Condition()
        self._closing = False
        self._threads = [
            threading.Thread(target=self._serve, args=(warm,), name=f"footfall-worker-{i}") for i in range(workers)
        ]
        for thread in self._threads:
            thread.start()

    def submit(
        self,
        kind: str,
        parents: Mapping[str, Value],
        settings: Value | None,
        on_done: OnDone | None = None,
        on_change: OnChange | None = None,
        *,
        on_preview: OnPreview | None = None,
        session: str = "",
        urgent: bool = False,
    ) -> Job:
        """Queue one product to be made; ``urgent`` goes before what waits.

        on_done(job, product): called in a pool thread before the job counts as done; returns the digest;
        what it raises fails the job. on_change(job): called there at every progress and at the end.
        on_preview(job, product): called there with coarse forms of the product, where its recipe makes any.

        Raises Busy where the queue is full, Conflict where the pool is closed.
        """
        job = Job(kind, session, on_done, on_change, on_preview)
        sent = {name: (value.digest, value) for name, value in parents.items()}
        asked = None if settings is None else (settings.digest, settings)
        with self._wake:
            if self._closing:
                raise Conflict("the job pool is closed")
            if len(self._queue) >= self.queue_limit:
                raise Busy(
                    f"{self.queue_limit} jobs are waiting already; cancel one, or wait",
                    limit=self.queue_limit,
                    retry_after=RETRY_AFTER,
                )
            waiting = (not urgent, next(self._order), job, (kind, sent, asked))
            heapq.heappush(self._queue, waiting)
            job.unqueue = lambda: self._unqueue(waiting)
            self._records.add(job)
            self._wake.notify()
        return job

    def adopt(self, job: Job) -> None:
        """Keep the record of a job that needs no work."""
        self._records.add(job)

    def get(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self._records.get(job_id)

    def tally(self) -> dict[tuple[str, str], Tally]:
        """How many jobs of each kind are queued, running, or have ended and how, and how long those took."""
        return self._records.tally()

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

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _serve(self, warm: bool) -> None:
        process = _Process(self._recipes)
        try:
            if warm:
                process.start()
            while (taken := self._take()) is not None:
                job, message = taken
                with bound_contextvars(job=job.id, session=job.session):
                    product, error = self._run(process, job, message)
                    job.end(product, error)
        finally:
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

    def _run(self, process: "_Process", job: Job, message: tuple[Any, ...]) -> tuple[Any, FootFallError | None]:
        """One job on one worker: (product, None) or (None, error)."""
        cancel_by: float | None = None
        try:
            pipe = process.start()
            job.report(0.0, "starting")
            with self._taken(process, job):
                pipe.send(("job", job.id, *message))
            while True:
                if pipe.poll(0.05):
                    match pipe.recv():
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
        except (EOFError, OSError):
            code = process.stop()
            if job.cancel_asked.is_set() or self._closing:
                return None, Cancelled("cancelled; its worker did not take it and was ended")
            return None, WorkerLost(
                f"the worker process died while it made the {job.kind} (exit code {code}); "
                "a new one takes the next job",
                exit_code=code,
            )
        except Exception as err:
            # A value that can't cross the pipe: the two ends no longer agree where a message starts.
            process.stop()
            return None, FootFallError(f"the {job.kind} could not be exchanged with its worker: {err}")

    @contextlib.contextmanager
    def _taken(self, process: "_Process", job: Job) -> Iterator[None]:
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


class _Process:
    """One worker process and this end of its pipe; started when needed."""

    def __init__(self, recipes: str) -> None:
        self._recipes = recipes
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None

    def start(self) -> Connection:
        if self._process is not None and not self._process.is_alive():
            self.stop()
        if self._process is None or self._pipe is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe(duplex=True)
            self._process = context.Process(target=work, args=(theirs, self._recipes), daemon=True)
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
