"""The rover's end of the link: one WebSocket, telemetry and images up, commands down.

A message that can't be used is counted and answered with what was wrong with it; the connection stays,
because a rover that sends one bad frame is still a rover that must be stoppable.
"""

import asyncio
import contextlib
import logging
import time
from typing import Any

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.types import Message

from footfall.core.errors import FootFallError, InvalidTelemetry
from footfall.io.link_images import decode_images
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.telemetry.link import (
    SUBPROTOCOL,
    AckMessage,
    ErrorMessage,
    HelloMessage,
    StopAckMessage,
    decode,
    encode,
)
from footfall.telemetry.state import TelemetryFrame

router = APIRouter()
_log = logging.getLogger(__name__)

GIVEN_UP_AFTER = 3.0
"""A rover that has said nothing for this long [s] gives way to one that knocks: it may be the same, come back."""
FOLLOW_PERIOD = 0.2
"""How often a silent rover is moved to the session that became the current one [s]."""
LONGEST_INBOX = 64
"""Messages of the rover that wait to be read; beyond that its own end of the line has to wait."""


class RoverDoor:
    """At most one rover at a time, and what was wrong with what it sent."""

    def __init__(self) -> None:
        self.inside: _Connection | None = None
        self.bad_frames = 0
        self.last_fault = ""

    def as_dict(self) -> dict[str, Any]:
        return {"linked": self.inside is not None, "bad_frames": self.bad_frames, "last_fault": self.last_fault}


@router.websocket("/rover")
async def rover(socket: WebSocket) -> None:
    door: RoverDoor = socket.app.state.rover_door
    if SUBPROTOCOL not in socket.scope["subprotocols"]:
        await socket.close(1008, f"the rover link needs the sub-protocol {SUBPROTOCOL}")
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


class _Connection:
    """One rover. It belongs to the current session, and follows when another becomes current."""

    def __init__(self, socket: WebSocket, sessions: Sessions, door: RoverDoor) -> None:
        self._socket = socket
        self._sessions = sessions
        self._door = door
        self._loop = asyncio.get_running_loop()
        self._outbox: asyncio.Queue[str] = asyncio.Queue()
        self._inbox: asyncio.Queue[tuple[Message, float]] = asyncio.Queue(LONGEST_INBOX)
        self._heard_at = time.monotonic()
        self._hello: HelloMessage | None = None
        self._live: LiveSession | None = None
        # one object for all sessions: they tell links apart by it
        self._send = self._post
        # a thread of its own, one call after the other: frames keep their order and never wait for the shared pool
        self._thread = CapacityLimiter(1)
        self._pictures = CapacityLimiter(1)
        self._tasks: list[asyncio.Task[None]] = []

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
                    return
                self._heard_at = time.monotonic()
                # stamped here: what waits in the inbox must not look fresh
                await self._inbox.put((message, self._heard_at))
        except WebSocketDisconnect:
            return
        finally:
            await self._end()

    async def give_way(self) -> None:
        """Leave the session and close: another connection takes over."""
        await self._end()
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await self._socket.close(1001, "the rover fell silent, and another connection took over")

    async def _end(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await to_thread.run_sync(self._leave, limiter=self._thread)

    def _leave(self) -> None:
        live, self._live, self._hello = self._live, None, None
        if live is not None:
            live.rover_disconnected(self._send)

    async def _write(self) -> None:
        try:
            while True:
                await self._socket.send_text(await self._outbox.get())
        except (WebSocketDisconnect, RuntimeError):
            return  # the reader sees the same end

    async def _work(self) -> None:
        while True:
            message, at = await self._inbox.get()
            if message.get("text") is not None:
                await to_thread.run_sync(self._take, self._take_text, message["text"], at, limiter=self._thread)
            else:
                # decoding and storing pictures takes seconds; telemetry and acknowledgements go on meanwhile
                task = asyncio.create_task(
                    to_thread.run_sync(self._take, self._take_images, message["bytes"], at, limiter=self._pictures)
                )
                self._tasks = [*(one for one in self._tasks if not one.done()), task]

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(FOLLOW_PERIOD)
            if self._hello is not None and self._sessions.current is not self._live:
                with contextlib.suppress(FootFallError):
                    await to_thread.run_sync(self._session, limiter=self._thread)

    def _post(self, text: str) -> None:
        """Thread-safe, does not block: sessions call it with their lock held."""
        try:
            self._loop.call_soon_threadsafe(self._outbox.put_nowait, text)
        except RuntimeError:
            _log.warning("the rover link has ended; a message was not sent")

    def _take(self, take: Any, content: str | bytes, at: float) -> None:
        try:
            take(content, at)
        except FootFallError as error:
            self._refuse(error.message)
        except Exception:
            _log.exception("a message of the rover met an unexpected error")
            self._refuse("the server met an unexpected error with this message; its log says more")

    def _refuse(self, text: str) -> None:
        self._door.bad_frames += 1
        self._door.last_fault = text
        self._send(encode(ErrorMessage("", text)))
        live = self._live
        if live is not None:
            live.take_complaint(text, about_rover=True)

    def _take_images(self, content: bytes, at: float) -> None:
        live = self._live
        if self._hello is None or live is None:
            raise InvalidTelemetry("the first message of a rover is hello")
        _, snapshot = decode_images(content, live.robot.leg_count)
        live.take_images(snapshot)
        for reason in snapshot.left_out.values():
            self._refuse(reason)

    def _take_text(self, text: str, at: float) -> None:
        legs = None if self._hello is None else self._hello.legs
        message = decode(text, legs)
        if isinstance(message, HelloMessage):
            self._hello = message
            try:
                self._session()
            except FootFallError:
                self._hello = None
                raise
            return
        live = self._session()
        if live is None:
            return
        match message:
            case TelemetryFrame():
                live.take_telemetry(message, at)
            case AckMessage():
                live.take_acknowledgement(message.id, message.state, message.reason)
            case StopAckMessage():
                live.take_stop_acknowledgement(message.id)
            case ErrorMessage():
                _log.warning("the rover could not use a message: %s", message.text)
                live.take_complaint(message.text, message_id=message.id)
            case _:
                raise InvalidTelemetry(f"a rover does not send {type(message).__name__}")

    def _session(self) -> LiveSession | None:
        """The current session, told that this rover is linked to it."""
        if self._hello is None:
            raise InvalidTelemetry("the first message of a rover is hello")
        live = self._sessions.current
        if live is self._live:
            return live
        if self._live is not None:
            self._live.rover_disconnected(self._send)
            self._live = None
        if live is not None:
            if (self._hello.robot, self._hello.legs) != (live.robot.name, live.robot.leg_count):
                raise InvalidTelemetry(
                    f"this session is for {live.robot.name} with {live.robot.leg_count} legs, "
                    f"the rover is {self._hello.robot} with {self._hello.legs}"
                )
            live.rover_connected(self._send)
            self._live = live
        return live
