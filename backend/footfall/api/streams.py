"""Server-sent events: what happens in a session, to any number of listeners, each at its own pace."""

import asyncio
import itertools
import threading
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable
from typing import Annotated, Any

from fastapi import Header, Query
from fastapi.sse import ServerSentEvent

from footfall.api.bodies.jsonable import dumps
from footfall.core.errors import InvalidInput
from footfall.session.live import LiveSession
from footfall.telemetry.state import TelemetryFrame

RATE = 20.0
"""Most telemetry messages to one listener in a second, where it asks for no other rate."""
RATES = (0.1, 50.0)
"""Rates that a listener may ask for [1/s]."""
LONGEST_BACKLOG = 5000
"""A listener that falls this many messages behind is let go; it resumes with Last-Event-ID."""
SLOW_AFTER = 1.0
"""A listener for which something has waited longer than this is slow [s]."""


class Streams:
    """The open streams of one server: who listens and how well, and the way to end them when it stops.

    dropped, let_go: telemetry that no listener that has gone took in time, and how many fell too far behind.
    """

    def __init__(self) -> None:
        self._open: set[_Mailbox] = set()
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._dropped = self.let_go = 0
        self.closed = False

    def add(self, mailbox: "_Mailbox") -> Callable[[], None]:
        with self._lock:
            if self.closed:
                mailbox.close()
            mailbox.number = next(self._numbers)
            self._open.add(mailbox)
        return lambda: self._remove(mailbox)

    def _remove(self, mailbox: "_Mailbox") -> None:
        with self._lock:
            if mailbox in self._open:
                self._open.remove(mailbox)
                self._dropped += mailbox.dropped
                self.let_go += mailbox.fell_behind

    @property
    def dropped(self) -> int:
        """Telemetry messages that gave way to newer ones, of all listeners so far."""
        with self._lock:
            return self._dropped + sum(mailbox.dropped for mailbox in self._open)

    def listeners(self, session: str | None = None) -> list[dict[str, Any]]:
        """Who listens to a session (None: to any), oldest first."""
        with self._lock:
            found = [mailbox for mailbox in self._open if session in (None, mailbox.session)]
        return [mailbox.as_dict() for mailbox in sorted(found, key=lambda mailbox: mailbox.number)]

    def close(self) -> None:
        """End every stream; thread-safe."""
        with self._lock:
            self.closed = True
            for mailbox in tuple(self._open):
                mailbox.close()


class _Mailbox:
    """Messages from the session's threads to one event loop. Events queue; of telemetry only the newest stays.

    session: whose. rate: most telemetry messages in a second. taken: messages that went on to the listener; dropped:
    telemetry that gave way to newer; fell_behind: whether the listener was let go because too much waited.
    """

    def __init__(self, session: str, rate: float) -> None:
        self.session, self.rate, self.number = session, rate, 0
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
        self.closed = False

    def put(self, message: dict[str, Any]) -> None:
        """Called by the session with its lock held: take it and return."""
        with self._lock:
            now = time.monotonic()
            if message["type"] == "telemetry":
                self.dropped += self._telemetry is not None
                self._telemetry = {**message, "taken": now}
            elif len(self._queue) >= LONGEST_BACKLOG:
                self.closed = self.fell_behind = True
            else:
                self._queue.append(message)
                self._oldest = self._oldest or now
        self._wake()

    def as_dict(self) -> dict[str, Any]:
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
                if self._telemetry is not None and wait <= 0:
                    taken.append(self._telemetry)
                    self._telemetry = None
                    self._next_telemetry = time.monotonic() + 1.0 / self.rate
                pending = self._telemetry is not None
            if taken:
                self.taken += len(taken)
                return taken
            try:
                await asyncio.wait_for(self._filled.wait(), max(wait, 0.001) if pending else None)
            except TimeoutError:
                continue
        return []


async def session_stream(
    live: LiveSession, streams: Streams, after: int | None, rate: float = RATE
) -> AsyncGenerator[ServerSentEvent]:
    """Everything that happens in a session; ``after``: first the recorded events with a higher number.

    rate: most telemetry messages in a second; of what comes faster, the newest.
    """
    mailbox = _Mailbox(live.id, rate)
    forget = streams.add(mailbox)
    unlisten = live.listen(mailbox.put)
    try:
        # listening before reading the log: what happens between comes twice and is dropped by its number
        seen = -1
        recorded = live.events(0 if after is None else after + 1)
        if after is not None:
            for event in recorded:
                yield _event(event.as_dict())
        if recorded:
            seen = recorded[-1].seq
        yield ServerSentEvent(raw_data=dumps(live.link.as_dict()), event="link")
        while taken := await mailbox.take():
            for message in taken:
                if message["type"] == "event":
                    if message["event"]["seq"] > seen:
                        seen = message["event"]["seq"]
                        yield _event(message["event"])
                elif message["type"] == "telemetry":
                    # it may have lain here until a slow listener took it
                    waited = time.monotonic() - message["taken"]
                    body = telemetry_body(message["frame"], message["age"] + waited, message["light"])
                    yield ServerSentEvent(raw_data=dumps(body), event="telemetry")
                else:
                    yield ServerSentEvent(raw_data=dumps(message[message["type"]]), event=message["type"])
    finally:
        unlisten()
        forget()


def _event(event: dict[str, Any]) -> ServerSentEvent:
    return ServerSentEvent(raw_data=dumps(event), event="event", id=str(event["seq"]))


def telemetry_body(frame: TelemetryFrame, age: float, light: float) -> dict[str, Any]:
    """One telemetry frame as the page and scripts see it. age: since it came; light: how long it was on its way [s]."""
    state = frame.state
    return {
        "number": frame.number,
        "time": state.time,
        "mode": state.mode,
        "posture": state.posture,
        "commanded": frame.commanded,
        "T_site_base": state.T_site_base,
        "wheel_forces": state.wheel_forces,
        "joint_torques": state.joint_torques,
        "age_s": age,
        "measured_age_s": age + light,
    }


Rate = Annotated[
    float, Query(ge=RATES[0], le=RATES[1], description="most telemetry messages in a second; of faster ones the newest")
]


def resume_after(
    since: Annotated[int | None, Query(ge=-1, description="send the recorded events after this number first")] = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> int | None:
    """The event number to continue after. Last-Event-ID, which the browser sends, wins over ``since``."""
    if last_event_id is None or last_event_id == "":
        return since
    if not last_event_id.removeprefix("-").isdecimal():
        raise InvalidInput("Last-Event-ID is the number of an event", last_event_id=last_event_id)
    return int(last_event_id)
