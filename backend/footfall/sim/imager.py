"""Taking the simulated rover's images in a process of its own, so that telemetry and stop never wait for them."""

from multiprocessing import get_context
from multiprocessing.connection import Connection

from footfall.core.errors import FootFallError, WorkerLost
from footfall.io.link_images import encode_images
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sim.render import render_snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


class Imager:
    """One worker process that holds the robot and its world. Starts at the first image; close it when done."""

    def __init__(self, robot: Robot | LeggedRobot, dem: Dem, seed: int) -> None:
        self._world = robot, dem, seed
        self._closed = False
        self._worker = None

    def take(self, request_id: str, state: RobotState, pairs: tuple[str, ...] | None) -> bytes:
        """Binary frame of the images at one state; blocks while they are taken, for one caller at a time.

        Raises NotFound for an unknown camera pair, WorkerLost where the worker did not start or died (the next call has
        a new one).
        """
        if self._closed:
            raise WorkerLost("the camera process is closed")
        if self._worker is None:
            try:
                self._worker = self._start()
            except OSError as err:
                raise WorkerLost(f"the camera process can't be started: {err}") from err
        _, connection = self._worker
        try:
            connection.send((request_id, state, pairs))
            answer = connection.recv()
        except (EOFError, OSError) as err:
            self._worker = None
            raise WorkerLost("the camera process ended while it took images") from err
        if isinstance(answer, FootFallError):
            raise answer
        return answer

    def close(self) -> None:
        """End the worker; an image under way is given up."""
        self._closed = True
        if self._worker is not None:
            process, connection = self._worker
            process.terminate()
            process.join()
            connection.close()

    def _start(self):
        # spawn: a forked child would share the event loop's sockets
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, *self._world), daemon=True, name="footfall-cameras")
        process.start()
        theirs.close()
        return process, ours


def _work(connection: Connection, robot: Robot | LeggedRobot, dem: Dem, seed: int) -> None:
    while True:
        try:
            request_id, state, pairs = connection.recv()
        except EOFError:
            return
        try:
            connection.send(encode_images(request_id, render_snapshot(robot, state, dem, seed=seed, pairs=pairs)))
        except FootFallError as err:
            connection.send(err)
