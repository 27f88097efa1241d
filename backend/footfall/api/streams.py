"""Server-sent events: what happens in a session, to any number of listeners, each at its own pace."""

import asyncio
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

from fastapi import Header, Query
from fastapi.sse import ServerSentEvent

from footfall.api.jsonable import dumps
from footfall.core.errors import InvalidInput
from footfall.session.live import LiveSession

TELEMETRY_PERIOD = 0.2
"""Least time between two telemetry messages to one listener [s]."""
LONGEST_BACKLOG = 5000
"""A listener that falls this many messages behind is let go; it resumes with Last-Event-ID."""


class Streams:
    """The open streams of one server, so that it can end them when it stops."""

    def __init__(self) -> None:
        self._open: set[_Mailbox] = set()
        self._lock = threading.Lock()
        self.closed = False

    def add(self, mailbox: "_Mailbox") -> Callable[[], None]:
        with self._lock:
            if self.closed:
                mailbox.close()
            self._open.add(mailbox)
        return lambda: self._open.discard(mailbox)

    def close(self) -> None:
        """End every stream; thread-safe."""
        with self._lock:
            self.closed = True
            for mailbox in tuple(self._open):
                mailbox.close()


class _Mailbox:
    """Messages from the session's threads to one event loop. Events queue; of telemetry only the newest stays."""

    def __init__(self) -> None:
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
            if message["type"] == "telemetry":
                self._telemetry = {**message, "taken": time.monotonic()}
            elif len(self._queue) >= LONGEST_BACKLOG:
                self.closed = True
            else:
                self._queue.append(message)
        self._wake()

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
                wait = self._next_telemetry - time.monotonic()
                if self._telemetry is not None and wait <= 0:
                    taken.append(self._telemetry)
                    self._telemetry = None
                    self._next_telemetry = time.monotonic() + TELEMETRY_PERIOD
                pending = self._telemetry is not None
            if taken:
                return taken
            try:
                await asyncio.wait_for(self._filled.wait(), max(wait, 0.001) if pending else None)
            except TimeoutError:
                continue
        return []


async def session_stream(live: LiveSession, streams: Streams, after: int | None) -> AsyncIterator[ServerSentEvent]:
    """Everything that happens in a session; ``after``: first the recorded events with a higher number."""
    mailbox = _Mailbox()
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
                    body = telemetry_body(message["frame"], message["age"] + waited)
                    yield ServerSentEvent(raw_data=dumps(body), event="telemetry")
                else:
                    yield ServerSentEvent(raw_data=dumps(message[message["type"]]), event=message["type"])
    finally:
        unlisten()
        forget()


def _event(event: dict[str, Any]) -> ServerSentEvent:
    return ServerSentEvent(raw_data=dumps(event), event="event", id=str(event["seq"]))


def telemetry_body(frame: Any, age: float | None) -> dict[str, Any]:
    """One telemetry frame as the page and scripts see it."""
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
    }


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
