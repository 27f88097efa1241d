"""Products of a session: each is asked for by the digests of its parents, made by a job, stored and logged."""

from typing import Any, cast

from footfall.core.errors import Conflict
from footfall.core.value import Value
from footfall.planning.step.problem import PlanResult
from footfall.session.jobs import InlineJobs, Job, Jobs
from footfall.session.journal import Journal
from footfall.session.remembered import on_map
from footfall.session.shelf import Shelf
from footfall.session.store import SessionStore
from footfall.telemetry.images import Snapshot
from footfall.terrain.dem import Dem

KEPT_JOBS = 50


class Workshop:
    """Submits the jobs of one session and records what they make. Thread-safe."""

    def __init__(self, pool: Jobs | InlineJobs, journal: Journal, shelf: Shelf, store: SessionStore) -> None:
        self._session = store.folder.name
        self._pool = pool
        self._journal = journal
        self._shelf = shelf
        self._store = store
        self._jobs: list[Job] = []
        self._map_jobs: dict[int, Job] = {}

    @property
    def jobs(self) -> list[Job]:
        """The session's latest jobs, newest last."""
        return list(self._jobs)

    def submit(
        self,
        kind: str,
        parents: dict[str, str],
        settings: Value | None,
        *,
        urgent: bool = False,
        **about: Any,
    ) -> Job:
        """Have a product made; ``about`` goes into its event. Newer maps of a leg cancel older ones on their way."""
        asked = None if settings is None else self._shelf.put(settings)
        payload = {"kind": kind, "parents": parents, "settings": asked, **about}

        def done(job: Job, product: Value | bytes) -> str:
            if isinstance(product, bytes):
                digest = self._store.put_bytes(product, about["format"])
            else:
                digest = self._shelf.put(product)
            if isinstance(product, Dem) and "snapshot" in values:
                # where the snapshot was taken, on this map: what is planned from
                snapshot = cast(Snapshot, values["snapshot"])
                payload.update(from_state=snapshot.state.digest, state=self._shelf.put(on_map(snapshot.state, product)))
            if isinstance(product, PlanResult):
                payload.update(status=product.status.value, reason=product.reason)
            self._journal.record("product", {**payload, "digest": digest})
            return digest

        def changed(job: Job) -> None:
            if job.state == "failed" and job.error is not None:
                self._journal.record_anyway("job_failed", {**payload, "reason": job.error.message})
            self._journal.tell("job", job=job.as_dict())

        values = {name: self._shelf.get(digest) for name, digest in parents.items()}
        with self._journal.lock:
            if self._journal.closed:
                raise Conflict("the session is closed")
            if kind == "maps" and about["leg"] in self._map_jobs:
                self._map_jobs[about["leg"]].cancel()
            job = self._pool.submit(kind, values, settings, done, changed, session=self._session, urgent=urgent)
            if kind == "maps":
                self._map_jobs[about["leg"]] = job
            self._jobs = [*self._jobs[-KEPT_JOBS + 1 :], job]
            self._journal.tell("job", job=job.as_dict())
        return job

    def close(self) -> None:
        """Cancel what is on its way and wait for it."""
        for job in self.jobs:
            job.cancel()
        for job in self.jobs:
            job.wait(5.0)
