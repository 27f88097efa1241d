"""Slows down who fails too often: a few tries are free, then each failure doubles the wait."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

LONGEST_WAIT = 60.0
"""[s]"""
FORGOTTEN_AFTER = 900.0
"""A key that has not failed for this long [s] starts anew."""
MOST_KEYS = 10_000
"""So many are remembered; beyond that the one that failed longest ago is forgotten."""


@dataclass
class _Failures:
    count: int
    latest: float


class Throttle:
    """Counts failures by key, in memory; thread-safe.

    free: failures that cost nothing, at least one. first: the wait after those [s].
    """

    def __init__(self, free: int, first: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        self._free, self._first, self._clock = free, first, clock
        self._lock = threading.Lock()
        self._failures: dict[str, _Failures] = {}

    def attempt(self, key: str) -> float:
        """0 where ``key`` may try: the try counts as failed until it is known to have succeeded, so that many at once
        don't slip through. Else how long it has to wait [s]."""
        with self._lock:
            now = self._clock()
            found = self._failures.pop(key, None)
            if found is None or now - found.latest > FORGOTTEN_AFTER:
                found = _Failures(0, now)
            over = found.count - self._free
            wait = 0.0 if over < 0 else min(self._first * 2.0 ** min(over, 30), LONGEST_WAIT) - (now - found.latest)
            if wait <= 0:
                found.count, found.latest = found.count + 1, now
            self._failures[key] = found
            while len(self._failures) > MOST_KEYS:
                del self._failures[next(iter(self._failures))]
            return max(0.0, wait)

    def forget(self, key: str) -> None:
        """The try succeeded: earlier failures count no longer."""
        with self._lock:
            self._failures.pop(key, None)

    def uncount(self, key: str) -> None:
        """The try succeeded, but earlier failures of the same key may have been somebody else's."""
        with self._lock:
            if key in self._failures:
                self._failures[key].count -= 1
