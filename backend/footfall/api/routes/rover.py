"""The rover's end of the link: one WebSocket, telemetry and images up, commands down.

A message that can't be used is counted and answered with what was wrong with it; the connection stays,
because a rover that sends one bad frame is still a rover that must be stoppable.
"""

import asyncio
import contextlib
import logging
import threading
import time
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.types import Message
from structlog.contextvars import bound_contextvars

from footfall.api.access import client_of
from footfall.api.bodies.answers import RoverLinkInfo
from footfall.api.door.limits import TOO_BIG
from footfall.core.errors import Conflict, FootFallError, InvalidImages, InvalidTelemetry
from footfall.io.link_images import decode_images
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.telemetry.link import (
    MAX_BINARY_FRAME,
    SUBPROTOCOL,
    AckMessage,
    EpochMessage,
    ErrorMessage,
    HelloMessage,
    StopAckMessage,
    decode,
    encode,
    kind_of,
)
from footfall.telemetry.state import TelemetryFrame

router = APIRouter()
_log = logging.getLogger(__name__)

GIVEN_UP_AFTER = 3.0
"""A rover that has said nothing for this long [s] gives way to one that knocks: it may be the same, come back."""
FOLLOW_PERIOD = 0.2
"""How often a silent rover is moved to the session that became the current one [s]."""
LONGEST_INBOX = 4096
"""Messages of the rover that wait to be used; beyond that its own end of the line has to wait."""
MOST_TEXT = 16 << 20
"""Of those that are text, likewise [bytes]."""
MOST_PICTURES = 4 * MAX_BINARY_FRAME
"""Images that wait to be decoded and stored; more are dropped, and the rover is told so [bytes]."""
SHORT = 1000
"""A message that may acknowledge a stop has fewer characters."""
AT_A_TIME = 32
"""Messages that one turn of the link's thread uses."""
LAST_WORDS = 5.0
"""How long what a rover said before it left is still read [s]."""


class RoverDoor:
    """At most one rover at a time, and what was wrong with what came: how much of it in all, and of each kind."""

    def __init__(self) -> None:
        self.inside: _Connection | None = None
        self.bad_frames = 0
        self.kinds: Counter[str] = Counter()
        self.last_fault = ""

    def count(self, kind: str, text: str) -> None:
        """One more message that can't be used; see :data:`footfall.telemetry.fields.FAULTS`."""
        self.bad_frames += 1
        self.kinds[kind] += 1
        self.last_fault = text

    def as_dict(self) -> RoverLinkInfo:
        """Plain JSON, for ``GET info``."""
        return {
            "linked": self.inside is not None,
            "bad_frames": self.bad_frames,
            "faults_by_kind": dict(self.kinds),
            "last_fault": self.last_fault,
        }


def fault_of(error: FootFallError) -> str:
    """Kind of what was wrong with a message of the rover."""
    return error.details.get("fault", "images" if isinstance(error, InvalidImages) else "wrong-field")


@router.websocket("/rover")
async def rover(socket: WebSocket) -> None:
    door: RoverDoor = socket.app.state.rover_door
    if SUBPROTOCOL not in (offered := socket.scope["subprotocols"]):
        text = f"the rover link needs the sub-protocol {SUBPROTOCOL}"
        refused = f"{text}; {', '.join(offered)[:80] or 'none'} was offered"
        door.count("wrong-version", refused)
        await socket.close(1008, text)
        if (live := socket.app.state.sessions.current) is not None:
            await to_thread.run_sync(partial(live.rover.take_complaint, refused, about_rover="wrong-version"))
        return
    if door.inside is not None and not door.inside.silent:
        await socket.close(1008, "another rover is linked")
        return
    before, connection = door.inside, _Connection(socket, socket.app.state.sessions, door)
    door.inside = connection
    if before is not None:
        await before.give_way()
    try:
        await socket.accept(SUBPROTOCOL)
        await connection.run()
    finally:
        if door.inside is connection:
            door.inside = None


def require_same_rover(hello: HelloMessage, live: LiveSession) -> None:
    """Raises InvalidTelemetry unless the session is about this rover."""
    robot, layout = live.state.robot_name, live.layout
    if (hello.robot, hello.legs) != (robot, len(layout.legs)):
        raise InvalidTelemetry(
            f"this session is for {robot} with {len(layout.legs)} legs, the rover is {hello.robot} with {hello.legs}",
            fault="wrong-robot" if hello.robot != robot else "wrong-legs",
        )
    if live.described is not None and hello.described is None:
        raise InvalidTelemetry(f"hello: {robot} has to name its joints, as docs/rover-link.md says", fault="wrong-legs")
    if hello.described is not None and hello.described.digest != layout.digest:
        other = sorted(set(hello.described.joint_names) ^ set(layout.joint_names))
        difference = f"one of them alone has {', '.join(other[:4])}" if other else "they have them in another order"
        raise InvalidTelemetry(
            f"hello: {robot} names other joints than the session's robot: {difference}", fault="wrong-legs"
        )


class _Connection:
    """One rover. It belongs to the current session, and follows when another becomes current."""

    def __init__(self, socket: WebSocket, sessions: Sessions, door: RoverDoor) -> None:
        self._socket = socket
        self._sessions = sessions
        self._door = door
        self._client = client_of(socket)
        self._loop = asyncio.get_running_loop()
        self._outbox: asyncio.Queue[str] = asyncio.Queue()
        self._inbox: asyncio.Queue[tuple[Message, float]] = asyncio.Queue(LONGEST_INBOX)
        self._text_waiting = self._pictures_waiting = 0  # bytes
        self._room = asyncio.Event()
        self._heard_at = time.monotonic()
        self._hello: HelloMessage | None = None
        self._live: LiveSession | None = None
        # one object for all sessions: they tell links apart by it
        self._send = self._post
        # a thread of its own, one call after the other: frames keep their order and never wait for the shared pool
        self._thread = CapacityLimiter(1)
        self._pictures = CapacityLimiter(1)
        self._stops = CapacityLimiter(1)
        self._tasks: list[asyncio.Task[None]] = []
        self._looking: set[asyncio.Task[None]] = set()
        self._ended = False
        # cancelling a task does not end the thread that works for it: without, that one could link after the leave
        self._linking = threading.Lock()
        self._left = False

    @property
    def silent(self) -> bool:
        """Whether nothing has come for so long that another rover may take the place."""
        return time.monotonic() - self._heard_at > GIVEN_UP_AFTER

    async def run(self) -> None:
        """Until the rover has gone."""
        self._tasks = [asyncio.create_task(work()) for work in (self._write, self._work, self._follow)]
        try:
            while True:
                message = await self._socket.receive()
                if message["type"] == "websocket.disconnect":
                    if message.get("code") == TOO_BIG:
                        reason = "a message was too large, or came too slowly, to be read at all; the link was closed"
                        self._refuse(reason, "too-large")
                    return
                self._heard_at = time.monotonic()
                # stamped here: what waits in the inbox must not look fresh
                await self._receive(message, self._heard_at)
        except WebSocketDisconnect:
            return
        finally:
            await self._end()

    async def _receive(self, message: Message, at: float) -> None:
        text = message.get("text")
        if text is None:
            size = len(message["bytes"])
            if self._pictures_waiting + size > MOST_PICTURES:
                reason = (
                    f"images came while {self._pictures_waiting} bytes of others wait to be stored; they were dropped"
                )
                await to_thread.run_sync(self._refuse, reason, "images", limiter=self._stops)
                return
            self._pictures_waiting += size
        elif self._live is not None and len(text) < SHORT and '"stop_ack"' in text:
            # the operator waits for it: not behind whatever else the rover says
            await to_thread.run_sync(self._take, self._take_text, text, at, limiter=self._stops)
            return
        else:
            while self._text_waiting > MOST_TEXT:
                self._room.clear()
                await self._room.wait()
            self._text_waiting += len(text)
        await self._inbox.put((message, at))

    async def give_way(self) -> None:
        """Leave the session and close: another connection takes over."""
        await self._end()
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await self._socket.close(1001, "the rover fell silent, and another connection took over")

    async def _end(self) -> None:
        self._ended = True
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._read_out(), LAST_WORDS)
        for task in self._tasks:
            task.cancel()
        for task in self._looking:
            task.cancel()
        await asyncio.gather(*self._tasks, *self._looking, return_exceptions=True)
        await to_thread.run_sync(self._leave, limiter=self._thread)

    async def _read_out(self) -> None:
        """Wait until everything that came is used: what was said before the end was said."""
        await self._inbox.join()
        await asyncio.gather(*self._looking, return_exceptions=True)

    def _leave(self) -> None:
        with self._linking:
            self._left = True
            live, self._live, self._hello = self._live, None, None
            if live is not None:
                live.rover.disconnected(self._send)

    def _part(self) -> None:
        """The rover that was there is gone; the connection stays."""
        with self._linking:
            live, self._live = self._live, None
            if live is not None:
                live.rover.disconnected(self._send)

    async def _write(self) -> None:
        try:
            while True:
                await self._socket.send_text(await self._outbox.get())
        except (WebSocketDisconnect, RuntimeError):
            return  # the reader sees the same end

    async def _work(self) -> None:
        while True:
            taken = [await self._inbox.get()]
            while len(taken) < AT_A_TIME and not self._inbox.empty():
                taken.append(self._inbox.get_nowait())
            # in their order: pictures belong to the session that is there when their turn comes
            for is_text, some in groupby(taken, lambda one: one[0].get("text") is not None):
                if is_text:
                    texts = [(message["text"], at) for message, at in some]
                    await to_thread.run_sync(self._take_texts, texts, limiter=self._thread)
                    self._text_waiting -= sum(len(text) for text, _ in texts)
                    self._room.set()
                else:
                    for message, at in some:
                        # decoding and storing takes seconds; telemetry and acknowledgements go on meanwhile
                        task = asyncio.create_task(self._look(message["bytes"], at))
                        self._looking.add(task)
                        task.add_done_callback(self._looking.discard)
            for _ in taken:
                self._inbox.task_done()

    async def _look(self, pictures: bytes, at: float) -> None:
        try:
            await to_thread.run_sync(self._take, self._take_images, pictures, at, limiter=self._pictures)
        finally:
            self._pictures_waiting -= len(pictures)

    def _take_texts(self, texts: list[tuple[str, float]]) -> None:
        for text, at in texts:
            self._take(self._take_text, text, at)

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(FOLLOW_PERIOD)
            if self._hello is not None and self._sessions.current is not self._live:
                with contextlib.suppress(FootFallError):
                    await to_thread.run_sync(self._session, limiter=self._thread)

    def _post(self, text: str) -> None:
        """Thread-safe, does not block: sessions call it with their lock held. Raises Conflict after the end."""
        if self._ended:
            raise Conflict("the rover has gone")
        try:
            self._loop.call_soon_threadsafe(self._outbox.put_nowait, text)
        except RuntimeError as err:
            raise Conflict("the server's end of the link has ended") from err

    def _take(self, take: Any, content: str | bytes, at: float) -> None:
        live = self._live
        with bound_contextvars(session=None if live is None else live.id):
            self._taken(take, content, at)

    def _taken(self, take: Any, content: str | bytes, at: float) -> None:
        try:
            take(content, at)
        except FootFallError as error:
            self._refuse(error.message, fault_of(error))
        except Exception:
            _log.exception("a message of the rover met an unexpected error")
            self._refuse("the server met an unexpected error with this message; its log says more")

    def _refuse(self, text: str, kind: str = "other") -> None:
        self._door.count(kind, text)
        with contextlib.suppress(Conflict):
            self._send(encode(ErrorMessage("", text)))
        live = self._live
        if live is not None:
            live.rover.take_complaint(text, about_rover=kind)

    def _take_images(self, content: bytes, at: float) -> None:
        live = self._live
        if self._hello is None or live is None:
            raise InvalidTelemetry("the first message of a rover is hello", fault="no-hello")
        with self._sessions.pixels.of(self._client) as held:
            _, snapshot = decode_images(content, len(live.layout.legs), held.take, live.named_layout)
            live.rover.take_images(snapshot, held)
        for reason in snapshot.left_out.values():
            self._refuse(reason, "images")

    def _take_text(self, text: str, at: float) -> None:
        hello = self._hello
        message = decode(text) if hello is None else decode(text, hello.legs, hello.described)
        if isinstance(message, HelloMessage):
            self._take_hello(message)
            return
        live = self._session()
        if live is None:
            return
        match message:
            case TelemetryFrame():
                live.rover.take_telemetry(message, at)
            case AckMessage():
                live.rover.take_acknowledgement(message.id, message.state, message.reason, message.time)
            case EpochMessage():
                live.rover.take_epoch(message.id, message.epoch)
            case StopAckMessage():
                live.rover.take_stop_acknowledgement(message.id, message.time)
            case ErrorMessage():
                _log.warning("the rover could not use a message: %s", message.text)
                live.rover.take_complaint(message.text, message_id=message.id)
            case _:
                raise InvalidTelemetry(f"a rover does not send {kind_of(message)}", fault="not-for-ground")

    def _take_hello(self, hello: HelloMessage) -> None:
        if self._live is not None:
            require_same_rover(hello, self._live)
        if self._hello is not None and hello.id != self._hello.id:
            self._part()  # it was started anew, behind a gateway that keeps the line
        self._hello = hello
        try:
            live = self._session()
        except FootFallError:
            self._hello = None
            raise
        if live is not None and hello.epoch is not None:
            try:
                live.rover.require_epoch(hello.epoch)
            except InvalidTelemetry:
                # linked all the same, so that it can be stopped
                self._hello = replace(hello, epoch=None)
                raise

    def _session(self) -> LiveSession | None:
        """The current session, told of this rover; None where there is none, or the rover has left."""
        with self._linking:
            return None if self._left else self._linked()

    def _linked(self) -> LiveSession | None:
        if self._hello is None:
            raise InvalidTelemetry("the first message of a rover is hello", fault="no-hello")
        live = self._sessions.current
        if live is self._live:
            return live
        if self._live is not None:
            self._live.rover.disconnected(self._send)
            # what the next session tells must not look older than what this one has told
            self._hello = replace(self._hello, epoch=max(self._live.rover.epoch, self._hello.epoch or 0))
            self._live = None
        if live is not None:
            require_same_rover(self._hello, live)
            live.rover.connected(self._send, self._hello)
            self._live = live
        return live
