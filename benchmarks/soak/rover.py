"""The simulated rover, with a journal of its own of what it carries out: ``python -m benchmarks.soak.rover``.

The journal is the second witness beside the session's log: a line for each command on which the rover sets out (its
id, its name, when), written before a joint moves. What stands in it outlives SIGKILL, and so do the joint angles and
the pose of the rover: its computer dies, its legs stay where they are. Its memory of command ids does not outlive it.
"""

import argparse
import asyncio
import os
import time
from pathlib import Path

from footfall.io.artifacts import decode, encode
from footfall.io.robot_files import load_robot
from footfall.io.terrain_files import read_terrain
from footfall.robot.model import Robot
from footfall.sim.imager import Imager
from footfall.sim.process import RoverClient
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem


class JournalledRover(SimulatedRover):
    """A simulated rover that notes what it carries out in ``journal`` and keeps its state in ``kept``.

    hurry: how much faster than the world's its time runs.
    """

    def __init__(self, robot: Robot, dem: Dem, kept: Path, journal: Path, hurry: float) -> None:
        state = decode(kept.read_bytes())
        if not isinstance(state, RobotState):
            raise TypeError(f"{kept} holds no state of a robot")
        super().__init__(robot, dem, state)
        self._kept, self._hurry = kept, hurry
        self._journal = os.open(journal, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def _begin(self, command: CommandMessage):
        os.write(self._journal, f"{command.id} {command.name} {time.time()}\n".encode())
        return super()._begin(command)

    def step(self, dt: float) -> list[AckMessage]:
        return super().step(self._hurry * dt)

    def frame(self) -> TelemetryFrame:
        frame = super().frame()
        being_written = self._kept.with_suffix(".new")
        being_written.write_bytes(encode(frame.state))
        being_written.replace(self._kept)
        return frame


def main() -> None:
    """Run until killed, or until the process that started this one is gone."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", required=True)
    for name in ("terrain", "state", "journal"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--hurry", type=float, default=1.0)
    options = parser.parse_args()
    robot, dem = load_robot("athlete"), read_terrain(options.terrain)
    rover = JournalledRover(robot, dem, options.state, options.journal, options.hurry)
    asyncio.run(_run(RoverClient(options.url, rover, Imager(robot, dem, 0))))


async def _run(client: RoverClient) -> None:
    parent, running = os.getppid(), asyncio.create_task(client.run())
    while os.getppid() == parent and not running.done():
        await asyncio.sleep(0.5)
    running.cancel()


if __name__ == "__main__":
    main()
