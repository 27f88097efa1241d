"""The simulated rover as a client of the rover link: telemetry up, commands down, images on request.

It keeps running without a link: it finishes the command under way, starts nothing new, keeps the
acknowledgements that it could not deliver, and knocks again with growing pauses.
"""

import asyncio
import contextlib
import logging
import os
import secrets
import signal
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from footfall.core.errors import FootFallError, InvalidInput, InvalidTelemetry
from footfall.io.terrain_files import read_terrain
from footfall.planning.body.stand import stand
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sim.door import DoorOptions, door_options
from footfall.sim.imager import Imager
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.fields import parse_object
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
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

if TYPE_CHECKING:
    from footfall.sim.legged_rover import SimulatedLeggedRover

    AnyRover = SimulatedRover | PhysicalRover | SimulatedLeggedRover

log = logging.getLogger("footfall.sim")

TELEMETRY_PERIOD = 0.1
STEP_PERIOD = 0.05
LONGEST_STEP = 0.25
"""Where the machine is slower than the world, the rover's clock falls behind rather than its answers: at most this much
is simulated at once [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 5.0
"""Seconds between two attempts to connect: doubled from the first to the longest."""


@dataclass(frozen=True)
class Start:
    """Where and how the rover stands at first: site frame [m], [rad], a named posture."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    posture: str = "stand"


def run_rover(
    url: str,
    terrain: str | Path | Dem,
    robot: str | LeggedRobot = "athlete",
    seed: int = 0,
    *,
    start: Start | RobotState | None = None,
    physics: PhysicsSettings | None = None,
    with_parent: bool = False,
    certificate: Path | None = None,
) -> None:
    """Run one simulated rover until SIGINT or SIGTERM.

    url: of the server's rover link, ``ws://127.0.0.1:8080/api/v1/rover``. terrain: its world, a file or a Dem.
    seed: of the cameras' noise. start: where it stands, or exactly in which state (default: the origin).
    physics: of a rover with masses and springs; None: a kinematic one, whose joints are where they are told to be. Of
    robots that others described there are kinematic ones alone.
    with_parent: end when the process that started this one is gone.
    certificate: see :func:`footfall.sim.door.door_options`, which also says where the token is from.

    Raises what loading the robot and the terrain and standing on it raise.
    """
    # what reads URDFs takes a second to load, and only robots that have one need it
    from footfall.io.any_robot import load_robot

    body = load_robot(robot) if isinstance(robot, str) else robot
    dem = terrain if isinstance(terrain, Dem) else read_terrain(terrain)
    state = start if isinstance(start, RobotState) else _standing(body, dem, start or Start())
    imager = Imager(body, dem, seed) if body.description.cameras else None
    client = RoverClient(url, _rover(body, dem, state, physics), imager, door_options(url, certificate))
    asyncio.run(_run(client, imager, with_parent))


def _rover(robot: Robot | LeggedRobot, dem: Dem, state: RobotState, physics: PhysicsSettings | None) -> "AnyRover":
    if isinstance(robot, LeggedRobot):
        if physics is not None:
            raise InvalidInput(f"{robot.name} has no masses and springs on the link: run it with --kinematic")
        # a rover of ATHLETE is started anew with each session, and needs nothing that plans for other legs
        from footfall.sim.legged_rover import SimulatedLeggedRover

        return SimulatedLeggedRover(robot, dem, _now(state))
    if physics is None:
        return SimulatedRover(robot, dem, _now(state))
    rover = PhysicalRover(robot, dem, _now(state), physics)
    moved = rover.settled
    log.info(
        "in physics the rover came to rest %.1f mm and %.2f° from where it was to stand, its joints within %.4f rad",
        1000 * float(np.linalg.norm(moved.moved)),
        np.rad2deg(moved.turned),
        moved.joints,
    )
    return rover


def _standing(robot: Robot | LeggedRobot, dem: Dem, start: Start) -> RobotState:
    if isinstance(robot, LeggedRobot):
        from footfall.planning.legged.measured import measured_at_rest

        return measured_at_rest(robot, dem, start.x, start.y, start.yaw)
    return stand(robot, dem, x=start.x, y=start.y, yaw=start.yaw, posture=start.posture)


def _now(state: RobotState) -> RobotState:
    """The same state at the present time: a recorded one would begin in the past."""
    return replace(state, time=time.time(), mode="idle")


async def _run(client: "RoverClient", imager: Imager | None, with_parent: bool) -> None:
    ended = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):
            asyncio.get_running_loop().add_signal_handler(number, ended.set)
    tasks = [asyncio.create_task(client.run()), asyncio.create_task(ended.wait())]
    if with_parent:
        tasks.append(asyncio.create_task(_parent_gone(os.getppid())))
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        if imager is not None:
            imager.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _parent_gone(parent: int) -> None:
    while os.getppid() == parent:
        await asyncio.sleep(0.5)


class RoverClient:
    """The rover's end of the link; :meth:`run` never returns by itself."""

    def __init__(
        self,
        url: str,
        rover: "AnyRover",
        imager: Imager | None,
        door: DoorOptions | None = None,
    ) -> None:
        self._url = url
        self._door: DoorOptions = door or {}
        self._rover = rover
        self._imager = imager
        self._unsent: deque[str | bytes] = deque()
        self._something_unsent = asyncio.Event()
        self._taking: asyncio.Task[None] | None = None
        self._moved_at = time.monotonic()

    async def run(self) -> None:
        """Move the rover and keep the link up."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._move())
            group.create_task(self._stay_connected())

    async def _move(self) -> None:
        while True:
            await asyncio.sleep(STEP_PERIOD)
            self._catch_up()

    def _catch_up(self) -> None:
        """Move the rover on to this moment."""
        now = time.monotonic()
        elapsed, self._moved_at = now - self._moved_at, now
        self._say(*self._rover.step(min(elapsed, LONGEST_STEP)))

    async def _stay_connected(self) -> None:
        pause = FIRST_PAUSE
        while True:
            try:
                async with connect(
                    self._url,
                    subprotocols=[Subprotocol(SUBPROTOCOL)],
                    compression=None,
                    max_size=MAX_TEXT_FRAME,
                    proxy=None,
                    **self._door,
                ) as socket:
                    if socket.subprotocol != SUBPROTOCOL:
                        raise InvalidTelemetry(f"the server does not speak {SUBPROTOCOL}")
                    log.info("connected to %s", self._url)
                    pause = FIRST_PAUSE
                    await self._serve(socket)
            except (OSError, TimeoutError, WebSocketException, InvalidTelemetry) as err:
                log.info("no link to %s (%s); trying again in %.1f s", self._url, err, pause)
            await asyncio.sleep(pause)
            pause = min(2 * pause, LONGEST_PAUSE)

    async def _serve(self, socket: ClientConnection) -> None:
        """Talk until the connection closes."""
        rover, greeting = self._rover, secrets.token_hex(8)
        rover.greets(greeting)
        legs, named = len(rover.robot.legs), rover.described
        hello = HelloMessage(rover.robot.name, legs, id=greeting, epoch=rover.epoch, described=named)
        await socket.send(encode(hello))
        senders = [asyncio.create_task(self._send_telemetry(socket)), asyncio.create_task(self._send_rest(socket))]
        try:
            async for frame in socket:
                self._take(frame)
        finally:
            for task in senders:
                task.cancel()
            await asyncio.gather(*senders, return_exceptions=True)

    async def _send_telemetry(self, socket: ClientConnection) -> None:
        clock = asyncio.get_running_loop().time
        due = clock()
        with contextlib.suppress(ConnectionClosed):
            while True:
                self._catch_up()
                await socket.send(encode(self._rover.frame()))
                # a late frame is not made up for by a burst
                due = max(due + TELEMETRY_PERIOD, clock())
                await asyncio.sleep(due - clock())

    async def _send_rest(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                while self._unsent:
                    await socket.send(self._unsent[0])
                    self._unsent.popleft()
                self._something_unsent.clear()
                await self._something_unsent.wait()

    def _say(self, *messages: Message | bytes) -> None:
        if messages:
            self._unsent.extend(one if isinstance(one, bytes) else encode(one) for one in messages)
            self._something_unsent.set()

    def _take(self, frame: str | bytes) -> None:
        if isinstance(frame, bytes):
            self._say(ErrorMessage("", "this rover takes text frames only"))
            return
        try:
            message = decode(frame, described=self._rover.described)
        except InvalidTelemetry as err:
            self._say(self._complaint(frame, err.message))
            return
        self._catch_up()
        self._do(message)

    def _do(self, message: Message) -> None:
        match message:
            case EpochMessage():
                self._rover.hear_epoch(message.id, message.epoch)
                self._tell_epoch(message.id)
            case CommandMessage():
                said = self._rover.command(message)
                self._say(*said)
                if said[-1].state == "outdated":
                    self._tell_epoch(message.id)
            case QueryMessage():
                self._say(self._rover.became(message.id))
            case StopMessage():
                self._say(*self._rover.stop(message.epoch), StopAckMessage(message.id, self._rover.time))
            case ClearStopMessage():
                if outdated := self._rover.clear_stop(message.epoch):
                    self._say(ErrorMessage(message.id, f"the stop was not cleared: {outdated}"))
                    self._tell_epoch(message.id)
            case ImageRequestMessage():
                self._take_images(message)
            case ErrorMessage():
                log.warning("the server could not use a message: %s", message.text)
            case _:
                self._say(ErrorMessage(getattr(message, "id", ""), "only the rover sends this message"))

    def _tell_epoch(self, about: str) -> None:
        """The ground hears which epoch it has come to: it may be older than what another one told."""
        if self._rover.epoch is not None:
            self._say(EpochMessage(about, self._rover.epoch))

    def _complaint(self, frame: str, reason: str) -> AckMessage | ErrorMessage:
        """A command that can't be read is refused under its id, so that the sender knows its fate."""
        try:
            body = parse_object(frame)
        except InvalidTelemetry:
            body = {}
        message_id = body.get("id")
        if not isinstance(message_id, str) or not 0 < len(message_id) <= 64:
            return ErrorMessage("", reason)
        if body.get("type") == "command":
            return self._rover.refuse(message_id, reason)
        return ErrorMessage(message_id, reason)

    def _take_images(self, request: ImageRequestMessage) -> None:
        if self._imager is None:
            self._say(ErrorMessage(request.id, f"{self._rover.robot.name} has no cameras: its description names none"))
            return
        if self._taking is not None and not self._taking.done():
            self._say(ErrorMessage(request.id, "the cameras are busy with another request"))
            return
        self._taking = asyncio.create_task(self._images(self._imager, request, self._rover.state()))

    async def _images(self, imager: Imager, request: ImageRequestMessage, state: RobotState) -> None:
        try:
            self._say(await asyncio.to_thread(imager.take, request.id, state, request.pairs))
        except FootFallError as err:
            self._say(ErrorMessage(request.id, err.message))
        except Exception as err:
            # nobody waits for this task: without an answer the ground would wait for images for ever
            log.exception("the cameras failed")
            self._say(ErrorMessage(request.id, f"the cameras failed: {type(err).__name__}: {err}"))
