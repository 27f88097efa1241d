"""The rover's end of the link: one WebSocket, telemetry and images up, commands down.

A message that can't be used is counted and answered with what was wrong with it; the connection stays,
because a rover that sends one bad frame is still a rover that must be stoppable.
"""

import asyncio
import logging
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


class RoverDoor:
    """At most one rover at a time, and what was wrong with what it sent."""

    def __init__(self) -> None:
        self.taken = False
        self.bad_frames = 0
        self.last_fault = ""

    def as_dict(self) -> dict[str, Any]:
        return {"linked": self.taken, "bad_frames": self.bad_frames, "last_fault": self.last_fault}


@router.websocket("/rover")
async def rover(socket: WebSocket) -> None:
    door: RoverDoor = socket.app.state.rover_door
    if SUBPROTOCOL not in socket.scope["subprotocols"]:
        await socket.close(1008, f"the rover link needs the sub-protocol {SUBPROTOCOL}")
        return
    if door.taken:
        await socket.close(1008, "another rover is linked")
        return
    door.taken = True
    try:
        await socket.accept(SUBPROTOCOL)
        await _Connection(socket, socket.app.state.sessions, door).run()
    finally:
        door.taken = False


class _Connection:
    """One rover. It belongs to the current session, and follows when another becomes current."""

    def __init__(self, socket: WebSocket, sessions: Sessions, door: RoverDoor) -> None:
        self._socket = socket
        self._sessions = sessions
        self._door = door
        self._loop = asyncio.get_running_loop()
        self._outbox: asyncio.Queue[str] = asyncio.Queue()
        self._hello: HelloMessage | None = None
        self._live: LiveSession | None = None
        # one object for all sessions: they tell links apart by it
        self._send = self._post
        # a thread of its own, one call after the other: frames keep their order and never wait for the shared pool
        self._thread = CapacityLimiter(1)

    async def run(self) -> None:
        writer = asyncio.create_task(self._write())
        try:
            while True:
                message = await self._socket.receive()
                if message["type"] == "websocket.disconnect":
                    return
                await to_thread.run_sync(self._take, message, limiter=self._thread)
        except WebSocketDisconnect:
            return
        finally:
            writer.cancel()
            if self._live is not None:
                await to_thread.run_sync(self._live.rover_disconnected, self._send, limiter=CapacityLimiter(1))

    async def _write(self) -> None:
        try:
            while True:
                await self._socket.send_text(await self._outbox.get())
        except (WebSocketDisconnect, RuntimeError):
            return  # the reader sees the same end

    def _post(self, text: str) -> None:
        """Thread-safe, does not block: sessions call it with their lock held."""
        try:
            self._loop.call_soon_threadsafe(self._outbox.put_nowait, text)
        except RuntimeError:
            _log.warning("the rover link has ended; a message was not sent")

    def _take(self, message: Message) -> None:
        try:
            if message.get("text") is not None:
                self._take_text(message["text"])
            else:
                live = self._session()
                if live is not None:
                    _, snapshot = decode_images(message["bytes"], live.robot.leg_count)
                    live.take_images(snapshot)
        except FootFallError as error:
            self._refuse(error.message)
        except Exception:
            _log.exception("a message of the rover met an unexpected error")
            self._refuse("the server met an unexpected error with this message; its log says more")

    def _refuse(self, text: str) -> None:
        self._door.bad_frames += 1
        self._door.last_fault = text
        self._send(encode(ErrorMessage("", text)))

    def _take_text(self, text: str) -> None:
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
                live.take_telemetry(message)
            case AckMessage():
                live.take_acknowledgement(message.id, message.state, message.reason)
            case StopAckMessage():
                live.take_stop_acknowledgement()
            case ErrorMessage():
                _log.warning("the rover could not use a message: %s", message.text)
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
