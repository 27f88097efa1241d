"""Cycles of work, kill, restart and comparison; the soak and the tests run the same."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import httpx

from benchmarks.soak.ledger import Ledger, Verdict, compare
from benchmarks.soak.processes import RoverProcess, ServerProcess, kill, until
from benchmarks.soak.script import Interrupted, Listener, Script
from footfall.io.artifacts import encode
from footfall.io.terrain_files import write_terrain
from footfall.planning.stance.stand import stand
from footfall.robot.ik import contact_point
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import plane

KINDS = ("server", "rover", "worker")


@dataclass(frozen=True)
class Cycle:
    """One kill. recovery: from it until the server answers, a rover is linked and, of a worker, a plan is made [s].

    during: what was under way. verdict: right after the recovery. problems: what did not go on as it should.
    """

    kind: str
    recovery: float
    during: str
    verdict: Verdict
    problems: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing was lost or doubled and the session went on."""
        return self.verdict.ok and not self.problems


class Soak:
    """A server, its workers, a rover and a client in ``folder``; a context manager.

    light: notes, waits on the rover and plans; else whole steps, terrain and stops too. hurry: of the rover's time.
    """

    def __init__(self, folder: Path, seed: int, light: bool, hurry: float) -> None:
        self._folder, self._light = folder, light
        self._rng = Random(seed)
        self.ledger = Ledger()
        self.data = folder / "data"
        self._dem = plane(size=8.0, resolution=0.1)
        world = folder / "world.npz"
        write_terrain(self._dem, world)
        with Sessions(self.data, jobs=InlineJobs()) as sessions:
            live = sessions.create("soak")
            live.load_terrain(self._dem, "made for the soak")
            self.session, self._robot = live.id, live.robot
        self._state = stand(self._robot, self._dem)
        self._set_up()
        legs = range(self._robot.leg_count)
        points = [contact_point(self._robot, self._state.posture, leg, self._state.T_site_base) for leg in legs]
        self._server = ServerProcess(self.data, self.session, folder / "server.log")
        self._rover = RoverProcess(folder, hurry)
        self._homes = [(float(x), float(y)) for x, y, _ in points]
        self._world = world
        self.set_up_again = 0

    def __enter__(self) -> "Soak":
        self._server.start()
        self._script = Script(self._server.url, self.ledger, self._rng, self._homes, self._world)
        try:
            self._listener = Listener(self._server.url, self.session, self.ledger)
            self._rover.start(self._server.url)
            until(self._script.linked, "the rover's link")
            if self._light:
                self._script.make_waits()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._script.client.close()
        self._rover.end()
        self._server.end()

    def cycle(self, kind: str) -> Cycle:
        """Work, kill a ``kind`` at a random moment, restart it, compare, and work on."""
        longest = 1.0 if self._light else 12.0
        struck = threading.Event()
        killer = threading.Timer(self._rng.uniform(0.02, longest), self._strike, (kind, struck))
        killer.start()
        during = self._work(kind, struck)
        killer.join()
        began = time.monotonic()
        self._recover(kind)
        recovery = time.monotonic() - began
        problems = self._after()
        return Cycle(kind, recovery, during, self.compare(), tuple(problems))

    def compare(self) -> Verdict:
        """The ledger beside what is on the disk now."""
        return compare(self.ledger, self.data, self.session, self._rover.executed())

    def _strike(self, kind: str, struck: threading.Event) -> None:
        struck.set()
        if kind == "worker":
            workers = until(self._server.workers, "a worker")
            for one in workers:
                kill(one)
        else:
            kill(self._server.pid if kind == "server" else self._rover.pid)

    def _work(self, kind: str, struck: threading.Event) -> str:
        """Go on until something fails because of the kill; what that was."""
        while not struck.is_set():
            for name, act in self._acts(kind):
                try:
                    act()
                except (Interrupted, httpx.TransportError, TimeoutError) as err:
                    if not struck.wait(1.0):
                        raise
                    return f"{name}: {err}"
                if struck.is_set():
                    return f"after {name}"
        return "between two acts"

    def _acts(self, kind: str) -> Iterator[tuple[str, Callable[[], object]]]:
        script = self._script
        yield "note", script.note
        if self._light and kind == "worker":
            yield "plan", script.plan
        elif self._light:
            yield "waits", script.wait_on_rover
            yield "note", script.note
        else:
            if self._rng.random() < 0.2:
                yield "terrain", script.load_terrain
            yield "step", script.step
        if self._rng.random() < 0.2:
            yield "stop", script.stop

    def _recover(self, kind: str) -> None:
        script = self._script
        if kind == "server":
            self._server.end()
            self._listener.end()
            self._server.start()
            self._listener = Listener(self._server.url, self.session, self.ledger)
        elif kind == "rover":
            self._rover.end()
            until(lambda: not script.linked(), "the loss of the link")
            self._rover.start(self._server.url)
        until(script.linked, "the rover's link")
        if kind == "worker":
            script.plan()

    def _after(self) -> list[str]:
        """The session goes on: what was stopped is stopped, what was open has an end, and new work is done."""
        script = self._script
        problems = []
        if self.ledger.stopped and not script.stop_in_force():
            problems.append("a stop that was answered is not in force any more")
        with contextlib.suppress(TimeoutError):
            until(lambda: not script.settled(), "the end of the run", 20.0)
        problems += script.settled()
        if script.stop_in_force():
            script.clear_stop()
        script.note()
        if self._light:
            script.wait_on_rover()
        else:
            self._step_on()
        return problems

    def _step_on(self) -> None:
        """A whole step; where a leg was left in the air so that no step is possible, the rover is set up anew."""
        try:
            self._script.step()
        except Interrupted:
            self.set_up_again += 1
            self._rover.end()
            until(lambda: not self._script.linked(), "the loss of the link")
            self._set_up()
            self._rover.start(self._server.url)
            until(self._script.linked, "the rover's link")
            self._script.step()

    def _set_up(self) -> None:
        (self._folder / "state.npz").write_bytes(encode(self._state))
