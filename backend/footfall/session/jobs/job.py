"""One job as others see it: how far it is, how it ended, and how to cancel it."""

import logging
import threading
import time
import uuid
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from footfall.core.errors import Cancelled, Conflict, FootFallError, NotFound
from footfall.core.value import Value
from footfall.session.answers.jobs import JobInSummary, JobState
from footfall.session.storage.interface import StoreRefused

MOST_ENDED = 200
"""Ended jobs that can still be asked for."""

OnDone = Callable[["Job", Any], str]
OnChange = Callable[["Job"], None]
OnPreview = Callable[["Job", Value], None]


class Job:
    """One piece of work. Attributes are written by the pool only and may be read from any thread.

    state: "queued", "running", "done", "failed" or "cancelled"; fraction: 0…1; text: what is being done.
    result: digest of the product once done; error: why there is none. seconds: how long it took, once it has ended,
    from when it began to run (or was asked for, where it never ran); ended_at: when that was [s since 1970].
    """

    def __init__(
        self,
        kind: str,
        session: str,
        on_done: OnDone | None,
        on_change: OnChange | None,
        on_preview: OnPreview | None = None,
    ) -> None:
        self.id = uuid.uuid4().hex[:12]
        self.kind = kind
        self.session = session
        self.state: JobState = "queued"
        self.fraction = 0.0
        self.text = "waiting for a worker"
        self.result: str | None = None
        self.error: FootFallError | None = None
        self.cancel_asked = threading.Event()
        self.unqueue: Callable[[], bool] = lambda: False
        self.on_end: Callable[[], None] = lambda: None
        self.seconds = 0.0
        self.ended_at: float | None = None
        self._began = time.monotonic()
        self._ended = threading.Event()
        self._on_done = on_done
        self._on_change = on_change
        self._on_preview = on_preview

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

    def as_dict(self) -> JobInSummary:
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
            "ended": self.ended_at,
        }

    def waits(self, text: str) -> None:
        """For the pool: what it waits for."""
        if self.state == "queued" and self.text != text:
            self.text = text
            self._changed()

    def report(self, fraction: float, text: str) -> None:
        """For the pool: the job is running and so far."""
        if self.state == "queued":
            self._began = time.monotonic()
        self.state, self.fraction, self.text = "running", min(max(fraction, self.fraction), 1.0), text
        self._changed()

    def preview(self, product: Value) -> None:
        """For the pool: a coarse form of the product, to be looked at until the product is there."""
        if self._on_preview is not None and not self.cancel_asked.is_set():
            try:
                self._on_preview(self, product)
            except Exception:
                logging.getLogger(__name__).exception("the preview of job %s could not be shown", self.id)

    def end(self, product: Any = None, error: FootFallError | None = None) -> None:
        """For the pool: the job ended with a product or an error."""
        if error is None:
            try:
                self.result = self._on_done(self, product) if self._on_done else getattr(product, "digest", None)
                self.ended_at = time.time()
                self.state, self.fraction, self.text = "done", 1.0, "done"
            except FootFallError as err:
                error = err
            except StoreRefused as err:
                error = err.not_recorded
            except Exception as err:
                logging.getLogger(__name__).exception("a finished %s job could not be recorded", self.kind)
                error = FootFallError(f"the product could not be recorded: {type(err).__name__}: {err}")
        if error is not None:
            self.error = error
            self.ended_at = time.time()
            self.state = "cancelled" if isinstance(error, Cancelled) else "failed"
            self.text = error.message
        self.seconds = time.monotonic() - self._began
        self.on_end()
        self._ended.set()
        self._changed()

    def _changed(self) -> None:
        if self._on_change is not None:
            try:
                self._on_change(self)
            except Exception:
                logging.getLogger(__name__).exception("a listener to job %s failed", self.id)


@dataclass
class JobTally:
    """How many jobs, and how long those took together that have ended [s]."""

    count: int = 0
    seconds: float = 0.0


class Records:
    """The jobs that can be asked for by id: all that run, and the latest that ended."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._ended: defaultdict[tuple[str, str], JobTally] = defaultdict(JobTally)
        self._guard = threading.Lock()

    def tally(self) -> dict[tuple[str, str], JobTally]:
        """(kind, state) → the jobs that are queued or running now, and all that ever ended."""
        with self._guard:
            found = {key: JobTally(one.count, one.seconds) for key, one in self._ended.items()}
            for job in self._jobs.values():
                if job.state in ("queued", "running"):
                    found.setdefault((job.kind, job.state), JobTally()).count += 1
            return found

    def _count(self, job: Job) -> None:
        with self._guard:
            tally = self._ended[job.kind, job.state]
            tally.count += 1
            tally.seconds += job.seconds

    def add(self, job: Job) -> None:
        job.on_end = lambda: self._count(job)
        with self._guard:
            self._jobs[job.id] = job
            ended = [one.id for one in self._jobs.values() if one.ended]
            for old in ended[: max(0, len(ended) - MOST_ENDED)]:
                del self._jobs[old]

    def get(self, job_id: str) -> Job:
        with self._guard:
            if job_id not in self._jobs:
                raise NotFound(f"there is no job {job_id}", job=job_id)
            return self._jobs[job_id]
