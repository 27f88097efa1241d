"""Products of a session: each is asked for by the digests of its parents, made by a job, stored and logged."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from footfall.core.errors import Cancelled, Conflict, InvalidInput
from footfall.core.value import Value, stored_name
from footfall.robot.legged.legged_model import DescribedRobot
from footfall.session.access.acting import said_by
from footfall.session.described_robots import athletes_alone
from footfall.session.folded_log import FoldedLog
from footfall.session.jobs.job import Job
from footfall.session.jobs.pool import JobPool
from footfall.session.products.kinds import Becomes, Kind
from footfall.session.storage.store import SessionStore
from footfall.session.value_store import ValueStore
from footfall.telemetry.images import Snapshot
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import on_map

KEPT_JOBS = 50
REPLACED = {"dem": "terrain", "queue": "queue"}
"""Field of the state → what that is, of which nobody's change may be lost to another's."""


@dataclass(frozen=True)
class Preview:
    """A coarse form of a product that a job is making, and the digests of what it is made from."""

    job: Job
    parents: dict[str, str]
    product: Value


class ProductJobs:
    """Submits the jobs of one session and records what they make. Thread-safe."""

    def __init__(self, pool: JobPool, folded_log: FoldedLog, value_store: ValueStore, store: SessionStore) -> None:
        self._session = store.folder.name
        self._pool = pool
        self._folded_log = folded_log
        self._value_store = value_store
        self._store = store
        self._jobs: list[Job] = []
        self._of_leg: dict[tuple[str, int], Job] = {}
        self._previews: dict[int, Preview] = {}
        self._made: dict[tuple[Any, ...], str] = {}
        self._closing = False

    @property
    def pool(self) -> JobPool:
        """Who makes them."""
        return self._pool

    @property
    def jobs(self) -> list[Job]:
        """The session's latest jobs, newest last."""
        return list(self._jobs)

    def preview(self, leg: int) -> Preview | None:
        """Coarse maps of a leg while the real ones are on their way."""
        return self._previews.get(leg)

    def under_way(self, kind: Kind, leg: int) -> Job | None:
        """The job that makes products of this kind for a leg, where it has not ended."""
        job = self._of_leg.get((kind.name, leg))
        return None if job is None or job.ended else job

    def submit(
        self,
        kind: Kind,
        parents: dict[str, str],
        settings: Value | None,
        *,
        urgent: bool = False,
        while_there: Mapping[str, str | None] | None = None,
        **about: Any,
    ) -> Job:
        """Have a product made; ``about``, and who asks, go into its event. What a cancelled job still makes is dropped.

        Of a kind that is made for each leg, newer ones cancel older ones on their way, and what was made before from
        the same parents with the same settings is taken as it is. while_there: a key of REPLACED → what is there of
        it, whose place the product takes: where something else is there by then, it is dropped. Raises InvalidInput for
        settings of another kind, and for a robot that others described where the kind is not for those.
        """
        if (None if settings is None else stored_name(type(settings))) != kind.request:
            raise InvalidInput(f"{kind.name} is asked for with {kind.request or 'no settings'}", kind=kind.name)
        asked = None if settings is None else self._value_store.put(settings)
        payload = {"kind": kind.name, "parents": parents, "settings": asked, **about, **said_by()}
        request = (kind.name, *sorted(parents.items()), asked)

        def done(job: Job, product: Value | bytes) -> str:
            if isinstance(product, bytes):
                digest = self._store.put_bytes(product, about["format"])
            else:
                digest = self._value_store.put(product)
            snapshot = values.get("snapshot")
            if isinstance(product, Dem) and isinstance(snapshot, Snapshot):
                # where the snapshot was taken, on this map: what is planned from
                payload.update(
                    from_state=snapshot.state.digest, state=self._value_store.put(on_map(snapshot.state, product))
                )
            if isinstance(product, Dem) and product.left_out:
                payload["left_out"] = dict(product.left_out)
            if kind.says_status:
                payload.update(_answer(product))
            with self._folded_log.lock:
                if job.cancel_asked.is_set():
                    raise Cancelled("cancelled when it was nearly done")
                state = self._folded_log.state
                if kind.of_this_state and parents["state"] != (state.what_if or state.state):
                    raise Conflict("another state was frozen while the shift was computed; ask again")
                if kind.becomes is Becomes.EDITED and parents["sequence"] != state.sequence:
                    raise Conflict(
                        "the sequence has changed while the edit was made, so it was dropped; read it again",
                        yours=parents["sequence"],
                        present=state.sequence,
                    )
                for name, then in (while_there or {}).items():
                    if (now := getattr(state, name)) not in (then, digest):
                        text = f"the {REPLACED[name]} has changed while this was made of it, so it was dropped"
                        raise Conflict(f"{text}: look at it, and ask again", yours=then, present=now)
                self._folded_log.record("product", {**payload, "digest": digest})
                if kind.per_leg:
                    self._made[request] = digest
            return digest

        def previewed(job: Job, product: Value) -> None:
            with self._folded_log.lock:
                if not job.cancel_asked.is_set():
                    self._previews[about["leg"]] = Preview(job, parents, product)
                    self._folded_log.tell("preview", preview={"leg": about["leg"]})

        def changed(job: Job) -> None:
            if job.state == "failed" and job.error is not None:
                self._folded_log.record_anyway("job_failed", {**payload, "reason": job.error.message})
            if job.ended:
                self._drop_preview(job)
            self._folded_log.tell("job", job=job.as_dict())

        values = {name: self._value_store.get(digest) for name, digest in parents.items()}
        if isinstance(about_robot := values.get("robot"), DescribedRobot) and not kind.for_described:
            raise athletes_alone(about_robot.name)
        with self._folded_log.lock:
            if self._closing or self._folded_log.closed:
                raise Conflict("the session is closed")
            if kind.per_leg and (older := self._of_leg.get((kind.name, about["leg"]))) is not None:
                older.cancel()
                self._drop_preview(older)
            if request in self._made:
                job = Job(kind.name, self._session, lambda job, digest: self._again(payload, digest), changed)
                self._pool.adopt(job)
                job.end(self._made[request])
            else:
                job = self._pool.submit(
                    kind.name,
                    values,
                    settings,
                    done,
                    changed,
                    on_preview=previewed,
                    session=self._session,
                    urgent=urgent,
                )
            if kind.per_leg:
                self._of_leg[kind.name, about["leg"]] = job
            self._jobs = [*self._jobs[-KEPT_JOBS + 1 :], job]
            self._folded_log.tell("job", job=job.as_dict())
        return job

    def _drop_preview(self, job: Job) -> None:
        """Forget what a job showed of its product."""
        with self._folded_log.lock:
            for leg in [leg for leg, preview in self._previews.items() if preview.job is job]:
                del self._previews[leg]
                self._folded_log.tell("preview", preview={"leg": leg})

    def _again(self, payload: dict[str, Any], digest: str) -> str:
        """A product that is there already becomes the present one once more."""
        self._folded_log.record("product", {**payload, "digest": digest})
        return digest

    def close(self) -> None:
        """Cancel what is on its way and wait for it; nothing more is submitted."""
        with self._folded_log.lock:
            self._closing = True
        for job in self.jobs:
            job.cancel()
        for job in self.jobs:
            job.wait(5.0)


def _answer(product: Any) -> dict[str, str]:
    """Of a product that is an answer: its status, and the reason for it."""
    return {"status": product.status.value, "reason": product.reason}
