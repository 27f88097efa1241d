"""A recording as a client of the rover link: what a rover said is said again, at any rate.

Frames and images go out as they were recorded, with their own numbers and times. Nothing can be commanded: commands
are refused. A stop pauses the recording until it is cleared, and so does ``pause``.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from footfall.core.errors import Conflict, InvalidInput, InvalidTelemetry
from footfall.io.recordings.reading import Recording, Said
from footfall.io.ros2_messages import NS
from footfall.sim.door import DoorOptions
from footfall.telemetry.link import (
    MAX_TEXT_FRAME,
    SUBPROTOCOL,
    AckMessage,
    ClearStopMessage,
    CommandMessage,
    EpochMessage,
    ErrorMessage,
    HelloMessage,
    ImageRequestMessage,
    Message,
    QueryMessage,
    StopAckMessage,
    StopMessage,
    decode,
    encode,
)
from footfall.telemetry.state import TelemetryFrame

log = logging.getLogger("footfall.play")

SLOWEST, FASTEST = 0.1, 100.0
PATIENCE, PAUSE = 5.0, 0.2
"""How long, and how often, a server that can't be reached or has another rover is asked again [s]."""
LINGER = 1.0
"""The connection is closed so long after the last message [s]: a server drops what it has not read by then."""
REFUSAL = "this is a recording that is played, which can't be commanded"


LINK, PAUSED, STOPPED = "link", "pause", "stop"
"""Why a playback is held."""


class Playback:
    """Where a recording is: ``rate`` seconds of it pass in a second, none while it is held.

    At first it is held for want of a LINK.

    Raises InvalidInput for a rate beyond SLOWEST…FASTEST.
    """

    def __init__(self, rate: float = 1.0, position: float = 0.0, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._rate = _rate(rate)
        self._position = position
        self._since = clock()
        self._holds = {LINK}

    @property
    def position(self) -> float:
        """Seconds from its beginning."""
        passed = 0.0 if self._holds else (self._clock() - self._since) * self._rate
        return self._position + passed

    @property
    def held(self) -> bool:
        """Whether it stands."""
        return bool(self._holds)

    def wait(self, until: float) -> float | None:
        """How long it takes to come to ``until`` [s]; None while it is held."""
        return None if self._holds else max(0.0, (until - self.position) / self._rate)

    def seek(self, position: float) -> None:
        """Go on from there."""
        self._position, self._since = position, self._clock()

    def set_rate(self, rate: float) -> None:
        """Raises InvalidInput."""
        rate = _rate(rate)
        self.seek(self.position)
        self._rate = rate

    def hold(self, why: str) -> None:
        """Stand still because of ``why``."""
        self.seek(self.position)
        self._holds.add(why)

    def release(self, why: str) -> None:
        """Go on, unless it is held because of something else."""
        self.seek(self.position)
        self._holds.discard(why)


def _rate(rate: float) -> float:
    if not SLOWEST <= rate <= FASTEST:
        raise InvalidInput(f"a recording is played {SLOWEST:g} to {FASTEST:g} times as fast as it was made", rate=rate)
    return rate


@dataclass
class Played:
    """frames, images: how many went out; connections: one, and one more for each time it went back."""

    frames: int = 0
    images: int = 0
    connections: int = 0


class Player:
    """Plays one recording; :meth:`run` ends with it. All of it in one event loop.

    The server takes a frame that is older by number and time than the one before for a straggler. So the player
    connects anew where the recording, or a seek, goes back: a rover that connects may begin anew. door: how it opens
    that of the server.
    """

    def __init__(self, url: str, recording: Recording, playback: Playback, door: DoorOptions | None = None) -> None:
        self._url = url
        self._door: DoorOptions = door or {}
        self._recording = recording
        self._playback = playback
        self._changed = asyncio.Event()
        self._sought: float | None = playback.position
        self._said: Iterator[Said] = iter(())
        self._next: Said | None = None
        self._latest: TelemetryFrame | None = None
        self._outbox: asyncio.Queue[str] = asyncio.Queue()
        self.played = Played()

    def control(self, line: str) -> None:
        """``pause``, ``go``, ``seek SECONDS`` or ``rate FACTOR``. Raises InvalidInput."""
        match line.split():
            case ["pause"]:
                self._playback.hold(PAUSED)
            case ["go"]:
                self._playback.release(PAUSED)
            case ["seek", number]:
                self._sought = min(max(0.0, _number(number)), self._recording.duration)
                self._playback.seek(self._sought)
            case ["rate", number]:
                self._playback.set_rate(_number(number))
            case _:
                raise InvalidInput("say pause, go, seek SECONDS or rate FACTOR", line=line)
        self._changed.set()

    async def run(self) -> Played:
        """Raises Conflict where the server can't be reached, has another rover, or closes the link; InvalidInput."""
        recording = self._recording
        while True:
            socket = await self._connect()
            tasks = [asyncio.create_task(self._listen(socket)), asyncio.create_task(self._answer(socket))]
            try:
                await socket.send(encode(HelloMessage(recording.robot, recording.legs, described=recording.described)))
                self._playback.release(LINK)
                ended = await self._play(socket)
                self._playback.hold(LINK)
                await asyncio.sleep(LINGER)
            except ConnectionClosed as err:
                raise Conflict(f"the server closed the link: {socket.close_reason or err}") from err
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
                await socket.close()
            if ended:
                return self.played

    async def _connect(self) -> ClientConnection:
        end = time.monotonic() + PATIENCE
        while True:
            try:
                socket = await connect(
                    self._url,
                    subprotocols=[Subprotocol(SUBPROTOCOL)],
                    compression=None,
                    max_size=MAX_TEXT_FRAME,
                    proxy=None,
                    **self._door,
                )
            except (OSError, TimeoutError, WebSocketException) as err:
                if time.monotonic() > end:
                    raise Conflict(
                        f"no link to {self._url} ({err}); does the server run, without another rover (serve --no-sim)?"
                    ) from err
                await asyncio.sleep(PAUSE)
                continue
            self.played.connections += 1
            self._latest = None
            return socket

    async def _play(self, socket: ClientConnection) -> bool:
        """Say what is due until the recording ends (True), or goes back (False)."""
        while True:
            self._changed.clear()
            if socket.close_code is not None:
                raise Conflict(f"the server closed the link: {socket.close_reason or socket.close_code}")
            if self._sought is not None:
                self._said, self._sought = self._recording.said(self._sought), None
                self._next = next(self._said, None)
            one = self._next
            if one is None:
                return True
            if not await self._due((one.at - self._recording.start) / NS):
                continue
            if isinstance(one.content, TelemetryFrame):
                if self._goes_back(one.content):
                    return False
                await socket.send(encode(one.content))
                self._latest = one.content
                self.played.frames += 1
            elif isinstance(one.content, bytes):
                await socket.send(one.content)
                self.played.images += 1
            self._next = next(self._said, None)

    async def _due(self, position: float) -> bool:
        """Wait until the recording is there; False where it was sought, paused or changed meanwhile."""
        wait = self._playback.wait(position)
        if wait == 0.0:
            await asyncio.sleep(0)  # let the listener hear a stop
            return not self._playback.held and self._sought is None
        try:
            await asyncio.wait_for(self._changed.wait(), wait)
        except TimeoutError:
            return True
        return False

    def _goes_back(self, frame: TelemetryFrame) -> bool:
        latest = self._latest
        return latest is not None and frame.number <= latest.number and frame.state.time <= latest.state.time

    async def _listen(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for text in socket:
                for message in self._answers(text):
                    self._outbox.put_nowait(encode(message))
        self._changed.set()  # the server has closed the link

    async def _answer(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await socket.send(await self._outbox.get())

    def _answers(self, text: str | bytes) -> list[Message]:
        now = 0.0 if self._latest is None else self._latest.state.time
        try:
            message = decode(text, described=self._recording.described)
        except InvalidTelemetry as err:
            return [ErrorMessage("", err.message)]
        match message:
            case EpochMessage():
                return [message]
            case CommandMessage():
                return [AckMessage(message.id, "refused", REFUSAL, now)]
            case QueryMessage():
                return [AckMessage(message.id, "unknown", REFUSAL, now)]
            case StopMessage():
                self._playback.hold(STOPPED)
                self._changed.set()
                return [StopAckMessage(message.id, now)]
            case ClearStopMessage():
                self._playback.release(STOPPED)
                self._changed.set()
            case ImageRequestMessage():
                return [ErrorMessage(message.id, "this is a recording that is played; it takes no new images")]
            case ErrorMessage():
                log.warning("the server could not use a message: %s", message.text)
        return []


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as err:
        raise InvalidInput(f"{text!r} is no number") from err
