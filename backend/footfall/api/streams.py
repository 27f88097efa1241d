"""Server-sent events: what happens in a session, to any number of listeners, each at its own pace."""

import itertools
import re
import threading
import time
from collections.abc import AsyncGenerator, Callable
from dataclasses import asdict
from typing import Annotated, Any

from fastapi import Header, Query, Request
from fastapi.sse import ServerSentEvent

from footfall.api.access import OneSession
from footfall.api.acting import Actor
from footfall.api.bodies.answers import Listener
from footfall.api.bodies.jsonable import dumps
from footfall.api.door.limits import MOST_LISTENERS, MOST_OF_ONE
from footfall.api.mailbox import Mailbox
from footfall.core.errors import Busy, Conflict, InvalidInput
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.live import LiveSession
from footfall.telemetry.state import TelemetryFrame

_NUMBER = re.compile(r"-?[0-9]{1,18}")

RATE = 20.0
"""Most telemetry messages to one listener in a second, where it asks for no other rate."""
RATES = (0.1, 50.0)
"""Rates that a listener may ask for [1/s]."""
RETRY_AFTER = 10
"""A listener that there was no room for may ask again after so long [s]."""
UNHEARD_ALLOWED = (1, 100)
"""How much telemetry a listener that says what it hears may let be under way."""


class Streams:
    """The open streams of one server: who listens and how well, and the way to end them when it stops.

    dropped, let_go: telemetry that no listener that has gone took in time, and how many fell too far behind.
    """

    def __init__(self) -> None:
        self._open: set[Mailbox] = set()
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._dropped = self.let_go = 0
        self.closed = False

    def require_room(self, asker: str, holds_conn: bool) -> None:
        """Raises Busy where as many listen as may, or of this account or address; never for the holder of the conn."""
        if not holds_conn:
            self._require_share(asker)

    def _require_share(self, asker: str) -> None:
        listening = [one.asker for one in tuple(self._open) if not one.kept]
        if len(listening) >= MOST_LISTENERS:
            text = f"{MOST_LISTENERS} pages or programs listen already; close one of them"
            raise Busy(text, limit=MOST_LISTENERS, retry_after=RETRY_AFTER)
        if listening.count(asker) >= MOST_OF_ONE:
            text = f"{MOST_OF_ONE} pages or programs of {asker} listen already; close one of them"
            raise Busy(text, limit=MOST_OF_ONE, retry_after=RETRY_AFTER)

    def add(self, mailbox: Mailbox) -> Callable[[], None]:
        """Returns what takes it out again. Raises Busy where as many listen as may, or of its account or address.

        The holder of the conn has a place that is kept for it: who has it already gives way.
        """
        with self._lock:
            try:
                self._require_share(mailbox.asker)
            except Busy:
                if not mailbox.holds_conn:
                    raise
                for one in self._open:
                    if one.kept:
                        one.close()
                mailbox.kept = True
            if self.closed:
                mailbox.close()
            mailbox.number = next(self._numbers)
            self._open.add(mailbox)
        return lambda: self._remove(mailbox)

    def _remove(self, mailbox: Mailbox) -> None:
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

    def listeners(self, session: str | None = None) -> list[Listener]:
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


async def session_stream(
    live: LiveSession, streams: Streams, after: int | None, mailbox: Mailbox
) -> AsyncGenerator[ServerSentEvent]:
    """Everything that happens in a session; ``after``: first the recorded events with a higher number. A page hears of
    the view that it shows, who names no page of every page's.

    Telemetry begins with the newest there is, however old.
    """
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
        yield ServerSentEvent(raw_data=dumps(live.rover.link.as_dict()), event="link")
        if (frame := live.rover.frame) is not None:
            # who comes while the rover is silent hears how it was, and how long ago that is
            mailbox.begin(
                {"type": "telemetry", "frame": frame, "age": live.rover.link.age or 0.0, "light": live.rover.link.light}
            )
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
                elif message["type"] == "view" and mailbox.who.seat:
                    if live.choices.concerns(mailbox.who, message["seat"]):
                        view = live.choices.of(mailbox.who).view
                        yield ServerSentEvent(raw_data=dumps(asdict(view)), event="view")
                elif message["type"] != "missed" or mailbox.who.seat == message["seat"]:
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


def room_to_listen(live: OneSession, request: Request, who: Actor) -> None:
    """Raises Busy or Conflict before a stream begins: later it could only break off."""
    require_open(live)
    request.app.state.streams.require_room(asker_of(who), live.commands.holds_conn(who))


def require_open(live: LiveSession) -> None:
    """Raises Conflict where nothing would ever be heard."""
    if live.only_looked_at:
        text = f"session {live.id} is not open, so nothing happens in it; open it with POST /api/v1/sessions"
        raise Conflict(text, session=live.id)


def mailbox_of(live: LiveSession, who: Identity, rate: float, ahead: int | None = None) -> Mailbox:
    """For ``who`` to listen to a session."""
    return Mailbox(live.id, rate, ahead, asker_of(who), live.commands.holds_conn(who), who)


def asker_of(who: Identity) -> str:
    """Whose share of the places a listener takes: an account's; without accounts, its address's."""
    return who.client if who.name == LOCAL.name else who.name


Rate = Annotated[
    float, Query(ge=RATES[0], le=RATES[1], description="most telemetry messages in a second; of faster ones the newest")
]

Ahead = Annotated[
    int | None,
    Query(
        ge=UNHEARD_ALLOWED[0],
        le=UNHEARD_ALLOWED[1],
        description='most telemetry messages under way; the listener says of each {"heard": number} when it has it',
    ),
]


def resume_after(
    since: Annotated[int | None, Query(ge=-1, description="send the recorded events after this number first")] = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> int | None:
    """The event number to continue after. Last-Event-ID, which the browser sends, wins over ``since``."""
    if last_event_id is None or last_event_id == "":
        return since
    if not _NUMBER.fullmatch(last_event_id):
        raise InvalidInput("Last-Event-ID is the number of an event", last_event_id=last_event_id[:100])
    return int(last_event_id)
