"""The rover standing on flat ground, and a real server for its link."""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from footfall.core.frames import transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.link import MAX_BINARY_FRAME, SUBPROTOCOL
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from tests.support.waiting import BOUND


@pytest.fixture(scope="session")
def flat() -> Dem:
    grid = GridGeometry(-8.0, -8.0, 0.1, 161, 161)
    return Dem(np.zeros(grid.shape, np.float32), grid, "flat", Provenance({}))


@pytest.fixture(scope="session")
def standing(athlete) -> RobotState:
    posture = athlete.posture("stand")
    height = athlete.wheel_radius - wheel_centers(athlete, posture)[:, 2].min()
    return RobotState(
        robot="athlete",
        time=1000.0,
        posture=posture,
        T_site_base=transform(translation=(0.0, 0.0, height)),
        wheel_forces=np.zeros((6, 3)),
        joint_torques=np.zeros(36),
        mode="idle",
    )


class LinkServer:
    """A websocket server in its own thread that keeps every frame it gets; the other end of the rover link."""

    def __init__(self) -> None:
        self.frames: list[str | bytes] = []
        self.connections = 0
        self.url = ""
        self._changed = threading.Condition()
        self._socket: ServerConnection | None = None
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._started.wait(BOUND)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        self._end = asyncio.Event()
        options = {"subprotocols": [Subprotocol(SUBPROTOCOL)], "max_size": MAX_BINARY_FRAME}
        async with serve(self._talk, "127.0.0.1", 0, **options) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            self.url = f"ws://127.0.0.1:{port}/api/v1/rover"
            self._started.set()
            await self._end.wait()

    async def _talk(self, socket: ServerConnection) -> None:
        with self._changed:
            self._socket = socket
            self.connections += 1
        with contextlib.suppress(ConnectionClosed):
            async for frame in socket:
                with self._changed:
                    self.frames.append(frame)
                    self._changed.notify_all()

    def send(self, text: str) -> None:
        """One text frame to the rover that connected last."""
        assert self._socket is not None
        asyncio.run_coroutine_threadsafe(self._socket.send(text), self._loop).result(10)

    def drop(self) -> None:
        """Close the connection, as a bad line would."""
        assert self._socket is not None
        asyncio.run_coroutine_threadsafe(self._socket.close(), self._loop).result(10)

    def wait_for(self, wanted: Callable[[list[str | bytes]], object], timeout: float = 60.0):
        """What ``wanted`` returns for all frames so far, as soon as it is true."""
        found = None

        def look() -> object:
            nonlocal found
            found = wanted(self.frames)
            return found

        with self._changed:
            assert self._changed.wait_for(look, timeout), "the rover did not send what was waited for"
        return found

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()


@pytest.fixture
def link_server() -> Iterator[LinkServer]:
    server = LinkServer()
    yield server
    server.close()
