"""Long work in worker processes: queued, watched, cancelled, and survived when a worker dies."""

import heapq
import itertools
import logging
import multiprocessing
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from importlib import import_module
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any, Self

from footfall.core.errors import Cancelled, Conflict, FootFallError, NotFound, WorkerLost
from footfall.core.value import Value
from footfall.session.recipes import make
from footfall.session.worker import work

CANCEL_GRACE = 1.0
"""A worker that has not stopped this long after it was asked to is killed [s]."""

KEPT = 200
"""Ended jobs that can still be asked for."""

OnDone = Callable[["Job", Any], str]
OnChange = Callable[["Job"], None]


class Job:
    """One piece of work. Attributes are written by the pool only and may be read from any thread.

    state: "queued", "running", "done", "failed" or "cancelled"; fraction: 0…1; text: what is being done.
    result: digest of the product once done; error: why there is none.
    """

    def __init__(self, kind: str, session: str, on_done: OnDone | None, on_change: OnChange | None) -> None:
        self.id = uuid.uuid4().hex[:12]
        self.kind = kind
        self.session = session
        self.state = "queued"
        self.fraction = 0.0
        self.text = "waiting for a worker"
        self.result: str | None = None
        self.error: FootFallError | None = None
        self.cancel_asked = threading.Event()
        self.unqueue: Callable[[], bool] = lambda: False
        self._ended = threading.Event()
        self._on_done = on_done
        self._on_change = on_change

    def cancel(self) -> None:
        """Ask the work to stop; an ended job stays as it is."""
        self.cancel_asked.set()
        if self.unqueue():
            self.end(error=Cancelled("cancelled before it started"))

    @property
    def ended(self) -> bool:
        """Whether the job is done, failed or cancelled."""
        return self._ended.is_set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; whether it came within ``timeout`` [s]."""
        return self._ended.wait(timeout)

    def finish(self, timeout: float | None = None) -> str:
        """Wait for the end; the digest of the product ("" where nothing named it).

        Raises the job's error, Conflict on a time-out.
        """
        if not self.wait(timeout):
            raise Conflict(f"the {self.kind} job is still {self.state} after {timeout} s", job=self.id)
        if self.error is not None:
            raise self.error
        return self.result or ""

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON for the interface."""
        error = self.error
        return {
            "id": self.id,
            "session": self.session,
            "kind": self.kind,
            "state": self.state,
            "fraction": self.fraction,
            "text": self.text,
            "result": self.result,
            "error": None
            if error is None
            else {"kind": error.kind, "message": error.message, "details": error.details},
        }

    def report(self, fraction: float, text: str) -> None:
        """For the pool: the job is running and so far."""
        self.state, self.fraction, self.text = "running", min(max(fraction, self.fraction), 1.0), text
        self._changed()

    def end(self, product: Any = None, error: FootFallError | None = None) -> None:
        """For the pool: the job ended with a product or an error."""
        if error is None:
            try:
                self.result = self._on_done(self, product) if self._on_done else getattr(product, "digest", None)
                self.state, self.fraction, self.text = "done", 1.0, "done"
            except FootFallError as err:
                error = err
            except Exception as err:
                logging.getLogger(__name__).exception("a finished %s job could not be recorded", self.kind)
                error = FootFallError(f"the product could not be recorded: {type(err).__name__}: {err}")
        if error is not None:
            self.error = error
            self.state = "cancelled" if isinstance(error, Cancelled) else "failed"
            self.text = error.message
        self._ended.set()
        self._changed()

    def _changed(self) -> None:
        if self._on_change is not None:
            try:
                self._on_change(self)
            except Exception:
                logging.getLogger(__name__).exception("a listener to job %s failed", self.id)


class _Records:
    """The jobs that can be asked for by id: all that run, and the latest that ended."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._guard = threading.Lock()

    def add(self, job: Job) -> None:
        with self._guard:
            self._jobs[job.id] = job
            ended = [one.id for one in self._jobs.values() if one.ended]
            for old in ended[: max(0, len(ended) - KEPT)]:
                del self._jobs[old]

    def get(self, job_id: str) -> Job:
        with self._guard:
            if job_id not in self._jobs:
                raise NotFound(f"there is no job {job_id}", job=job_id)
            return self._jobs[job_id]


class InlineJobs:
    """Jobs that run in the caller's thread, at once: for scripts, samples and tests."""

    def __init__(self, recipes: str = "footfall.session.recipes") -> None:
        self._recipes = import_module(recipes).RECIPES
        self._records = _Records()

    def submit(
        self,
        kind: str,
        parents: Mapping[str, Value],
        settings: Value | None,
        on_done: OnDone | None = None,
        on_change: OnChange | None = None,
        *,
        session: str = "",
        urgent: bool = False,
    ) -> Job:
        """Do the work; the job has ended when this returns."""
        job = Job(kind, session, on_done, on_change)
        self._records.add(job)

        def progress(fraction: float, text: str) -> None:
            job.report(fraction, text)
            if job.cancel_asked.is_set():
                raise Cancelled("cancelled")

        try:
            product = make(self._recipes, kind, parents, settings, progress)
        except FootFallError as err:
            job.end(error=err)
        else:
            job.end(product)
        return job

    def get(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self._records.get(job_id)

    def close(self) -> None:
        """Nothing is running."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


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
        self._limit = queue_limit
        self._records = _Records()
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
        session: str = "",
        urgent: bool = False,
    ) -> Job:
        """Queue one product to be made; ``urgent`` goes before what waits.

        on_done(job, product): called in a pool thread before the job counts as done; returns the digest;
        what it raises fails the job. on_change(job): called there at every progress and at the end.

        Raises Conflict where the queue is full or the pool closed.
        """
        job = Job(kind, session, on_done, on_change)
        sent = {name: (value.digest, value) for name, value in parents.items()}
        asked = None if settings is None else (settings.digest, settings)
        with self._wake:
            if self._closing:
                raise Conflict("the job pool is closed")
            if len(self._queue) >= self._limit:
                raise Conflict(f"{self._limit} jobs are waiting already; cancel one, or wait", limit=self._limit)
            waiting = (not urgent, next(self._order), job, (kind, sent, asked))
            heapq.heappush(self._queue, waiting)
            job.unqueue = lambda: self._unqueue(waiting)
            self._records.add(job)
            self._wake.notify()
        return job

    def get(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self._records.get(job_id)

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
            pipe.send(("job", job.id, *message))
            while True:
                if pipe.poll(0.05):
                    match pipe.recv():
                        case ("progress", fraction, text):
                            job.report(fraction, text)
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
            return None, WorkerLost(
                f"the worker process died while it made the {job.kind} (exit code {code}); "
                "a new one takes the next job",
                exit_code=code,
            )
        except Exception as err:
            # A value that can't cross the pipe: the two ends no longer agree where a message starts.
            process.stop()
            return None, FootFallError(f"the {job.kind} could not be exchanged with its worker: {err}")


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
