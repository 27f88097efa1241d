"""What waits for one listener of a session's events: events queue, of telemetry and the link only the newest stays."""

import asyncio
import threading
import time
from collections import deque
from typing import Any

from footfall.api.bodies.answers import Listener
from footfall.session.access.identity import LOCAL, Identity

LONGEST_BACKLOG = 5000
"""A listener that falls this many messages behind is let go; it resumes with Last-Event-ID."""
SLOW_AFTER = 1.0
"""A listener for which something has waited longer than this is slow [s]."""


class Mailbox:
    """Messages from the session's threads to one event loop. Events queue; of telemetry only the newest stays.

    session: whose. rate: most telemetry messages in a second. most_unheard: most of them that may be under way, where
    the listener says what it has heard: however much the lines between would hold, it is never further behind. asker:
    the account or address that listens; who: as which page; holds_conn: as holder of the conn; kept: at the place that
    is kept for that. taken: messages that went on to the listener; dropped: telemetry that gave way to newer;
    fell_behind: whether the listener was let go because too much waited.
    """

    def __init__(
        self,
        session: str,
        rate: float,
        most_unheard: int | None = None,
        asker: str = "",
        holds_conn: bool = False,
        who: Identity = LOCAL,
    ) -> None:
        self.session, self.rate, self.most_unheard, self.number = session, rate, most_unheard, 0
        self.asker, self.holds_conn, self.kept, self.who = asker, holds_conn, False, who
        self.taken = self.dropped = 0
        self.fell_behind = False
        self._since = time.time()
        self._oldest: float | None = None  # when the first of what waits came
        self._loop = asyncio.get_running_loop()
        self._filled = asyncio.Event()
        self._lock = threading.Lock()
        self._queue: deque[dict[str, Any]] = deque()
        self._telemetry: dict[str, Any] | None = None
        self._next_telemetry = 0.0
        self._unheard: deque[int] = deque()  # numbers of the telemetry under way
        self.closed = False

    def put(self, message: dict[str, Any]) -> None:
        """Called by the session with its lock held: take it and return."""
        with self._lock:
            now = time.monotonic()
            if message["type"] == "telemetry":
                self.dropped += self._telemetry is not None
                self._telemetry = {**message, "taken": now}
            elif message["type"] == "link" and self._queue and self._queue[-1]["type"] == "link":
                self._queue[-1] = message  # how the link is now
            elif len(self._queue) >= LONGEST_BACKLOG:
                self.closed = self.fell_behind = True
            else:
                self._queue.append(message)
                self._oldest = self._oldest or now
        self._wake()

    def begin(self, telemetry: dict[str, Any]) -> None:
        """What was told before it listened; telemetry that came since is newer."""
        with self._lock:
            self._telemetry = self._telemetry or {**telemetry, "taken": time.monotonic()}
        self._wake()

    def heard(self, number: int) -> None:
        """The listener has this telemetry, and all that went before it. Another number says nothing."""
        with self._lock:
            if number in self._unheard:
                while self._unheard.popleft() != number:
                    pass
        self._wake()

    def as_dict(self) -> Listener:
        """Plain JSON. waiting: messages; behind_s: since when the first of them waits."""
        with self._lock:
            waiting = len(self._queue) + (self._telemetry is not None)
            due = None if self._telemetry is None else max(self._telemetry["taken"], self._next_telemetry)
            times = [at for at in (self._oldest, due) if at is not None]
            behind = max(time.monotonic() - min(times), 0.0) if times else 0.0
        return {
            "number": self.number,
            "session": self.session,
            "since": self._since,
            "rate": self.rate,
            "taken": self.taken,
            "dropped": self.dropped,
            "waiting": waiting,
            "behind_s": behind,
            "slow": behind > SLOW_AFTER,
        }

    def close(self) -> None:
        self.closed = True
        self._wake()

    def _wake(self) -> None:
        try:
            self._loop.call_soon_threadsafe(self._filled.set)
        except RuntimeError:
            self.closed = True  # the loop has ended, and with it the listener

    async def take(self) -> list[dict[str, Any]]:
        """Messages since the last call, at least one unless the mailbox was closed."""
        while not self.closed:
            self._filled.clear()
            with self._lock:
                taken = list(self._queue)
                self._queue.clear()
                self._oldest = None
                wait = self._next_telemetry - time.monotonic()
                free = self.most_unheard is None or len(self._unheard) < self.most_unheard
                if self._telemetry is not None and free and wait <= 0:
                    taken.append(self._telemetry)
                    if self.most_unheard is not None:
                        self._unheard.append(self._telemetry["frame"].number)
                    self._telemetry = None
                    self._next_telemetry = time.monotonic() + 1.0 / self.rate
                pending = self._telemetry is not None and free
            if taken:
                self.taken += len(taken)
                return taken
            try:
                await asyncio.wait_for(self._filled.wait(), max(wait, 0.001) if pending else None)
            except TimeoutError:
                continue
        return []
