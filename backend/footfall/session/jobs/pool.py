"""Where jobs are done: in processes of the server's own, at once, or by workers elsewhere; the same to who asks."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from footfall.core.errors import Busy
from footfall.core.value import Value
from footfall.session.jobs.job import Job, JobTally, OnChange, OnDone, OnPreview, Records

RETRY_AFTER = 5
"""When to ask again where the queue is full [s]."""


class JobPool(ABC):
    """Takes jobs and keeps their records; close it, or use it as a context manager.

    queue_limit: waiting jobs before new ones are refused; None: nothing ever waits.
    """

    def __init__(self, queue_limit: int | None = None) -> None:
        self.queue_limit = queue_limit
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
        """Have one product made; ``urgent`` goes before what waits.

        on_done(job, product): called in a pool thread before the job counts as done; returns the digest;
        what it raises fails the job. on_change(job): called there at every progress and at the end.
        on_preview(job, product): called there with coarse forms of the product, where its recipe makes any.

        Raises Busy where the queue is full, Conflict where the pool is closed, and what the class says.
        """
        job = Job(kind, session, on_done, on_change, on_preview)
        self._take_on(job, parents, settings, urgent)
        return job

    def adopt(self, job: Job) -> None:
        """Keep the record of a job that needs no work."""
        self._records.add(job)

    def get(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self._records.get(job_id)

    def tally(self) -> dict[tuple[str, str], JobTally]:
        """How many jobs of each kind are queued, running, or have ended and how, and how long those took."""
        return self._records.tally()

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether it takes jobs, and somebody is there who does them."""

    @abstractmethod
    def close(self) -> None:
        """Cancel what runs and waits."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @abstractmethod
    def _take_on(self, job: Job, parents: Mapping[str, Value], settings: Value | None, urgent: bool) -> None:
        """Do a job, or see to it that it is done; its record is kept. Raises as :meth:`submit`."""

    def _require_room(self, waiting: int) -> None:
        if self.queue_limit is not None and waiting >= self.queue_limit:
            text = f"{self.queue_limit} jobs are waiting already; cancel one, or wait"
            raise Busy(text, limit=self.queue_limit, retry_after=RETRY_AFTER)
