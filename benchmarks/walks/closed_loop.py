"""Walks in a closed loop over rocks, nothing known of the ground but images, carried out by the rover in physics.

``python -m benchmarks.walks.closed_loop --walks 1 --metres 1`` prints what was decided, a row for each walk, and how
many arrived. Images are ray cast on the processor, which takes most of the time: ``--scale`` makes them smaller. With
``--kinematic`` the simulated rover walks: it moves as commanded, and tips where no forces of its feet hold it up; it
neither slips nor runs into anything.
"""

import argparse
import queue
import sys
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

import footfall
from benchmarks.referee import at_rest
from benchmarks.scenes import robot
from benchmarks.walks.diary import Diary
from footfall.core.errors import FootFallError, InvalidInput
from footfall.planning.choice.onward import CHOOSERS, PLANNER
from footfall.planning.route.problem import RouteSettings
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk_execution.decision import WayOnSettings
from footfall.sequence.commands import Sequence
from footfall.sequence.moved_legs import moved_legs
from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.loop_settings import LoopSettings
from footfall.session.registry import Sessions
from footfall.sim.physics.physics_settings import TIME_STEP, PhysicsSettings
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.run_observer import RunObserver
from footfall.sim.render import render_snapshot
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import CommandMessage, ImageRequestMessage, QueryMessage, StopMessage, decode
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field
from footfall.terrain.terrain_settings import TerrainSettings

PERIOD = 0.1
"""Of telemetry, by the rover's clock [s]."""
RESTS = 2.0
"""So long after its last command the rover is at rest, and its clock stands still until the next [s]."""
PLACES = 8
"""Places to stand that are tried for one walk."""

Rover = PhysicalRover | SimulatedRover


class LinkedRover:
    """A rover at the end of a session's link, in a thread of its own, as fast as the machine lets it be.

    watch: sees what the rover in physics does; None of one that has none.
    """

    def __init__(self, live: LiveSession, rover: Rover, diary: Diary, seed: int, scale: float) -> None:
        self._live, self._rover, self._diary, self._seed, self._scale = live, rover, diary, seed, scale
        self.watch = RunObserver(rover, {}) if isinstance(rover, PhysicalRover) else None
        self._inbox: queue.Queue[str] = queue.Queue()
        self._closing = threading.Event()
        self._images = self._told = 0
        # telemetry is as old as the rover says, however slow the machine is
        live.rover.link._clock = lambda: PERIOD * self._told
        # and a row is given up on after so long by the rover's clock
        live.rover.commanding.gate._clock = live.rover.link._clock
        self._thread = threading.Thread(target=self._run, name="rover")

    def __enter__(self) -> Self:
        self._live.rover.connected(self._inbox.put)
        self._live.rover.take_telemetry(self._rover.frame())
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        moved_at = self._rover.time
        while not self._closing.is_set():
            while not self._inbox.empty():
                self._hear(self._inbox.get())
            if self._rover.mode == "moving":
                moved_at = self._rover.time
            if self._rover.time - moved_at < RESTS:
                with self._diary.rovers("motion", time.thread_time):
                    self._goes_on()
            else:
                self._closing.wait(PERIOD)
            self._told += 1
            self._live.rover.take_telemetry(self._rover.frame())

    def _goes_on(self) -> None:
        step = TIME_STEP if self.watch else PERIOD
        for _ in range(round(PERIOD / step)):
            for said in self._rover.step(step):
                self._live.rover.take_acknowledgement(said.id, said.state, said.reason, said.time)
            if self.watch:
                self.watch.look()

    def _hear(self, text: str) -> None:
        message, rover, live = decode(text), self._rover, self._live
        if isinstance(message, CommandMessage):
            sequence = live.get(message.sequence)
            if self.watch and isinstance(sequence, Sequence):
                swings = sequence.commands[message.row].phase == "swing"
                self.watch.row(message.row, moved_legs(sequence)[message.row], swings)
            for said in rover.command(message):
                live.rover.take_acknowledgement(said.id, said.state, said.reason, said.time)
        elif isinstance(message, ImageRequestMessage):
            self._images += 1
            seed = 1000 * self._seed + self._images
            # nothing else is at work meanwhile, and the rays have threads of their own
            with self._diary.rovers("images", time.process_time):
                taken = render_snapshot(
                    rover.robot, rover.state(), rover.dem, seed=seed, pairs=message.pairs, scale=self._scale
                )
            live.rover.take_images(taken)
        elif isinstance(message, QueryMessage):
            said = rover.became(message.id)
            live.rover.take_acknowledgement(said.id, said.state, said.reason, said.time)
        elif isinstance(message, StopMessage):
            rover.stop(message.epoch)
            live.rover.take_stop_acknowledgement(message.id, rover.time)


@dataclass(frozen=True)
class Walked:
    """What came of a walk. left: from where the chassis ended to the goal, seen from above [m]. contacts: that nobody
    planned. slip: the most that a wheel slipped while it stood [m]; drag: as it was put down. rover, clock: time it
    took [s].

    Of a rover without physics nobody knows contacts, 0 stands for them, slip and drag, which are NaN.
    """

    number: int
    outcome: str
    reason: str
    metres: float
    left: float
    foot_moves: int
    looks: int
    plans: int
    tipped: bool
    contacts: int
    slip: float
    drag: float
    rover: float
    clock: float

    def __str__(self) -> str:
        known = (
            f"unplanned contacts {self.contacts}, slip {1000 * self.slip:.1f} mm, dragged {1000 * self.drag:.1f} mm; "
        )
        known = known if np.isfinite(self.slip) else ""
        return (
            f"walk {self.number}: {self.outcome} ({self.reason}); went {self.metres:.2f} m, {self.left:.2f} m left; "
            f"{self.foot_moves} parts of walks, {self.looks} looks, {self.plans} plans; "
            f"{'TIPPED; ' if self.tipped else ''}{known}"
            f"{self.rover:.0f} s of the rover, {self.clock:.0f} s by the clock"
        )


def walked(
    number: int,
    metres: float,
    settings: LoopSettings,
    scale: float,
    minutes: float,
    folder: Path | None,
    kinematic: bool = False,
) -> Walked:
    """One walk straight on, by its number, ended after so many minutes; its session is kept in ``folder``.

    Raises InvalidInput where the rover can stand in none of the places.
    """
    world = rock_field(size=metres + 12.0, resolution=0.04, abundance=0.03, smallest=0.1, largest=0.4, seed=number)
    rover = _standing(world, -metres / 2.0, kinematic)
    start = rover.T_site_base[:2, 3]
    goal = WalkGoal(float(start[0]) + metres, float(start[1]))
    began, at = time.perf_counter(), rover.time
    with tempfile.TemporaryDirectory() as made, Sessions(folder or made, InlineJobs(), rover.robot) as sessions:
        live = sessions.create(f"closed loop {number}")
        with Diary(live, rover) as diary, LinkedRover(live, rover, diary, number, scale) as linked:
            loop = live.walk_to(goal, settings)
            in_time = loop.wait(60.0 * minutes)
            if not in_time:
                # it may end by itself just now
                with suppress(FootFallError):
                    loop.cancel()
                loop.wait()
        print(diary.in_words(loop.foot_moves), flush=True)
        there = rover.T_site_base[:2, 3]
        watch = linked.watch
        return Walked(
            number=number,
            outcome=loop.outcome,
            reason=loop.reason if in_time else f"after {minutes:g} minutes, {loop.reason}",
            metres=float(np.linalg.norm(there - start)),
            left=float(np.linalg.norm(there - (goal.x, goal.y))),
            foot_moves=loop.foot_moves,
            looks=loop.decided["look"],
            plans=loop.decided["replan"],
            tipped=rover.mode == "fault",
            contacts=len(watch.contacts) if watch else 0,
            slip=float(watch.slip.max()) if watch else np.nan,
            drag=float(watch.drag.max()) if watch else np.nan,
            rover=rover.time - at,
            clock=time.perf_counter() - began,
        )


def _standing(world: Dem, x: float, kinematic: bool) -> Rover:
    reason = ""
    for place in range(PLACES):
        try:
            stood = footfall.stand(robot(), world, x + 0.1 * place, 0.0, 0.0)
            stood = replace(stood, time=time.time())
            if kinematic:
                return SimulatedRover(robot(), world, stood)
            return at_rest(robot(), world, stood, PhysicsSettings())
        except InvalidInput as error:
            reason = error.message
    raise InvalidInput(f"the rover can stand in none of {PLACES} places: {reason}")


def main() -> None:
    """Walk, a row for each walk as it ends, then how many arrived."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--walks", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="number of the first walk")
    parser.add_argument("--metres", type=float, default=5.0)
    parser.add_argument("--look-every", type=int, default=1, help="foot moves between two looks")
    parser.add_argument("--minutes", type=float, default=60.0, help="of one walk, by the clock; then it is ended")
    parser.add_argument("--keep", type=Path, help="folder in which the sessions are kept")
    parser.add_argument("--scale", type=float, default=0.5, help="of the cameras' resolution")
    parser.add_argument("--time-limit", type=float, default=60.0, help="of one plan [s]")
    parser.add_argument("--choose-by", choices=tuple(CHOOSERS), default=PLANNER, help="how each piece is gone")
    parser.add_argument("--along", action="store_true", help="go along a route, planned anew before each walk")
    parser.add_argument("--kinematic", action="store_true", help="the rover has no physics")
    parser.add_argument("--pairs", nargs="*", help="cameras that take images; all where none is named")
    asked = parser.parse_args()
    settings = LoopSettings(
        way_on=WayOnSettings(look_every=asked.look_every),
        walk=WalkSettings(seed=1, time_limit=asked.time_limit),
        terrain=TerrainSettings(resolution=0.04, keep=True),
        pairs=None if asked.pairs is None else tuple(asked.pairs),
        choose_by=asked.choose_by,
        route=RouteSettings() if asked.along else None,
    )
    found = []
    for number in range(asked.first, asked.first + asked.walks):
        found.append(
            walked(number, asked.metres, settings, asked.scale, asked.minutes, asked.keep, kinematic=asked.kinematic)
        )
        print(found[-1], flush=True)
    arrived, tipped = sum(one.outcome == "arrived" for one in found), sum(one.tipped for one in found)
    print(f"{arrived} of {len(found)} arrived, {tipped} tipped")
    if not asked.kinematic:
        contacts = sum(one.contacts for one in found)
        slip, drag = 1000 * max(one.slip for one in found), 1000 * max(one.drag for one in found)
        print(f"{contacts} unplanned contacts, slip at most {slip:.1f} mm, dragged as they were put down {drag:.1f} mm")


if __name__ == "__main__":
    sys.exit(main())
