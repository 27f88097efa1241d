"""How the pairs of a snapshot are matched and masked, by a worker; kept while it is looked at, never in the log."""

import threading
from collections import OrderedDict
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from footfall.session.jobs.job import Job
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.telemetry.images import Camera, Snapshot

if TYPE_CHECKING:
    from footfall.terrain.pair_views import SnapshotViews

_T = TypeVar("_T")
Key = tuple[str, ...]

MOST_VIEWS = 2
"""Snapshots whose views are kept: fifteen megabytes each."""
SILHOUETTES = 18
"""Silhouettes that are kept: both cameras of nine pairs."""
LONGEST = 120.0
"""How long views are waited for [s]."""


class ImageViews:
    """The views of the latest snapshots that were looked at, in any session of a registry. Thread-safe."""

    def __init__(self, sessions: Sessions) -> None:
        self._sessions = sessions
        self._guard = threading.RLock()  # a pool that works inline ends a job while it is submitted
        self._views: OrderedDict[Key, SnapshotViews] = OrderedDict()
        self._running: dict[Key, Job] = {}
        self._silhouettes: OrderedDict[Key, NDArray[np.bool_]] = OrderedDict()

    def of(self, live: LiveSession, snapshot: Snapshot) -> "SnapshotViews":
        """Made when first asked for; whoever asks meanwhile waits for the same.

        Raises what the worker does; Conflict where it takes longer than LONGEST.
        """
        key = (live.robot_digest, snapshot.digest)
        while True:
            with self._guard:
                if key in self._views:
                    self._views.move_to_end(key)
                    return self._views[key]
                job = self._running.get(key) or self._start(key, live, snapshot)
            job.finish(LONGEST)

    def _start(self, key: Key, live: LiveSession, snapshot: Snapshot) -> Job:
        def ended(job: Job) -> None:
            with self._guard:
                if job.ended and self._running.get(key) is job:
                    del self._running[key]

        parents = {"robot": live.described or live.description, "snapshot": snapshot}
        job = self._sessions.jobs.submit(
            "views", parents, None, partial(self._take, key), ended, session=live.id, urgent=True
        )
        if not job.ended:
            self._running[key] = job
        return job

    def _take(self, key: Key, job: Job, made: Any) -> str:
        with self._guard:
            _keep(self._views, key, made, MOST_VIEWS)
        return ""

    def silhouette(self, live: LiveSession, snapshot: Snapshot, camera: Camera) -> NDArray[np.bool_]:
        """Pixels (height, width) that show the rover itself, as its joint angles had it."""
        from footfall.terrain.pair_views import silhouette

        key = (live.robot_digest, snapshot.state.digest, camera.digest)
        with self._guard:
            if key in self._silhouettes:
                self._silhouettes.move_to_end(key)
                return self._silhouettes[key]
        found = silhouette(live.any_robot, snapshot.state, camera)
        with self._guard:
            return _keep(self._silhouettes, key, found, SILHOUETTES)


def _keep(kept: OrderedDict[Key, _T], key: Key, one: _T, most: int) -> _T:
    kept[key] = one
    kept.move_to_end(key)
    while len(kept) > most:
        kept.popitem(last=False)
    return one
