"""Replay checks of whole sessions, by a worker: the server answers, and hears a stop, while one runs."""

import json
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np

from footfall.core.errors import Conflict, NotFound
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import CheckRequest
from footfall.session.registry import Sessions


class ReplayChecks:
    """The latest check of each session of a registry. Thread-safe."""

    def __init__(self, sessions: Sessions) -> None:
        self._sessions = sessions
        self._guard = threading.Lock()
        self._running: dict[str, Job] = {}
        self._reports: dict[str, Mapping[str, Any]] = {}

    def start(self, session_id: str) -> Job:
        """Recompute what a session has recorded until now. Raises NotFound; Conflict where that is under way."""
        with self._guard:
            before = self._running.get(session_id)
            if before is not None and not before.ended:
                raise Conflict("this session is being checked already", job=before.id)
            bundle = np.frombuffer(self._sessions.export_bundle(session_id), np.uint8)

            def keep(job: Job, report: bytes) -> str:
                self._reports[session_id] = json.loads(report)
                return ""

            job = self._sessions.jobs.submit("check", {}, CheckRequest(bundle), keep)
            self._running[session_id] = job
            return job

    def report(self, session_id: str) -> Mapping[str, Any]:
        """What the latest check that ended has found, see ReplayReport. Raises NotFound where there is none."""
        if session_id not in self._reports:
            raise NotFound("this session has not been checked since the server started", session=session_id)
        return self._reports[session_id]
