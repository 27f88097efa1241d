"""Cycles of work, trouble, recovery and comparison; the soak and the tests run the same."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import httpx

from benchmarks.soak.bad_link import BAD, Badness, linked_by
from benchmarks.soak.ledger import Ledger, Verdict, compare
from benchmarks.soak.processes import PATIENCE, Deaf, RoverProcess, ServerProcess, kill, until
from benchmarks.soak.script import Interrupted, Listener, Script
from footfall.api.access import BASE
from footfall.io.artifacts import encode
from footfall.io.terrain_files import write_terrain
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.storage.store import read_session
from footfall.telemetry.link import PATH
from footfall.terrain.generate import plane

KINDS = ("server", "rover", "worker", "link", "hang")
"""What goes wrong: one of three is killed, the link between rover and server is bad for a while, workers hang."""
MOMENTS = ("any", "command", "stop", "any")
"""When it begins: at any time, soon after the rover set out on a command, while an answered stop is in force."""
ENDS = ("command_done", "command_refused", "command_unknown")
SOON = 0.5
"""Longest time from a command's beginning, or a stop's answer, to the trouble [s]."""
BAD_FOR = 5.0
"""Longest time that a link stays bad, and so that what failed by it may wait to be told so [s]."""


@dataclass(frozen=True)
class Cycle:
    """One trouble. recovery: from it until the server answers, a rover is linked and, of workers, a plan is made [s].

    how: what was done to a link. under_way: name of the command that the rover was carrying out, or "". stopped: a stop
    that was answered was in force. during: what the client was doing. verdict: once the session has gone on. problems:
    what did not go on as it should.
    """

    kind: str
    how: str
    recovery: float
    under_way: str
    stopped: bool
    during: str
    verdict: Verdict
    problems: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing was lost or doubled and the session went on."""
        return self.verdict.ok and not self.problems


class Soak:
    """A server, its workers, a rover, a client, and one that never reads, in ``folder``; a context manager.

    hurry: how much faster than the world the rover's time runs. workers: how many the server has. server, rover: the
    processes; script: the client.
    """

    def __init__(self, folder: Path, seed: int, hurry: float, workers: int = 2) -> None:
        self._folder = folder
        self._rng = Random(seed)
        self.ledger = Ledger()
        self.data = folder / "data"
        self._dem = plane(size=8.0, resolution=0.1)
        world = folder / "world.npz"
        write_terrain(self._dem, world)
        with Sessions(self.data, jobs=InlineJobs()) as sessions:
            live = sessions.create("soak")
            live.terrains.load(self._dem, "made for the soak")
            self.session, self._robot = live.id, live.robot
        self._state = stand(self._robot, self._dem)
        self._set_up()
        legs = range(self._robot.leg_count)
        points = [contact_point(self._robot, self._state.posture, leg, self._state.T_site_base) for leg in legs]
        self.server = ServerProcess(self.data, self.session, folder / "server.log", workers)
        self.rover = RoverProcess(folder, hurry)
        self._homes = [(float(x), float(y)) for x, y, _ in points]
        self._world = world
        self._seed, self._open = seed, contextlib.ExitStack()
        self.set_up_again = 0

    def __enter__(self) -> "Soak":
        self.server.start()
        self.link = self._open.enter_context(linked_by(f"ws{self.server.url.removeprefix('http')}{PATH}", self._seed))
        self._deaf = self._never_reading()
        self.script = Script(self.server.url, self.ledger, self._rng, self._homes, self._world)
        try:
            self._listener = Listener(self.server.url, self.session, self.ledger)
            self.rover.start(self.link.url)
            until(self.script.linked, "the rover's link")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.script.client.close()
        self._deaf.close()
        self.rover.end()
        self._open.close()
        self.server.end()

    def cycle(self, kind: str, moment: str = "any", steps: bool = False) -> Cycle:
        """Work, have a ``kind`` of trouble at a ``moment``, recover, compare, and work on.

        steps: the rover carries out whole steps, and terrain is loaded; else it waits, which takes less time.
        """
        longest = SOON if moment != "any" or not steps else 12.0
        struck, struck_at = threading.Event(), list[float]()
        about = (kind, moment, steps, self._rng.uniform(0.02, longest), struck, struck_at)
        how = self._rng.choice(list(BAD)) if kind == "link" else ""
        failed: list[BaseException] = []

        def strike() -> None:
            try:
                self._strike(*about, how)
            except BaseException as err:
                failed.append(err)
            finally:
                struck.set()  # else the work would go on for ever

        trouble = threading.Thread(target=strike, daemon=True)
        trouble.start()
        during = self._work(kind, moment, steps, struck)
        trouble.join()
        if failed:
            raise failed[0]
        began, stopped = time.monotonic(), self.ledger.stopped
        self._recover(kind)
        recovery = time.monotonic() - began
        problems, verdict = self._after(steps), self.compare()
        return Cycle(kind, how, recovery, self._under_way(struck_at[0]), stopped, during, verdict, tuple(problems))

    def compare(self) -> Verdict:
        """The ledger beside what is on the disk now."""
        return compare(self.ledger, self.data, self.session, self.rover.executed())

    def _strike(
        self,
        kind: str,
        moment: str,
        steps: bool,
        delay: float,
        struck: threading.Event,
        struck_at: list[float],
        how: str,
    ) -> None:
        if moment == "command":
            before = len(self.rover.begun())
            names = {"LEG_MOVE"} if steps else {"WAIT"}
            until(lambda: names & {name for _, name, _ in self.rover.begun()[before:]}, "the beginning of a command")
        elif moment == "stop":
            until(lambda: self.ledger.stopped, "the answer to a stop")
        time.sleep(delay)
        workers = until(self.server.workers, "a worker") if kind in ("worker", "hang") else []
        struck_at.append(time.time())
        if kind == "link":
            self.link.badness = BAD[how]
            self.link.cut()  # how often it is cut counts from a connection's beginning
            time.sleep(BAD_FOR * delay / (SOON + delay))
            self.link.badness = Badness()
            if BAD[how].cut_every:  # else the connection that there is would still be cut once
                self.link.cut()
        elif kind == "hang":
            self._hang(workers, struck)
        struck.set()
        if kind in ("server", "rover", "worker"):
            for one in workers or [self.server.pid if kind == "server" else self.rover.pid]:
                kill(one)

    def _hang(self, workers: list[int], struck: threading.Event) -> None:
        """Stop all workers; once a job waits for one of them, it is cancelled as an operator would do it."""
        stopped: list[int] = []

        def hanging() -> str:
            # one that came meanwhile would do the job
            for one in {*workers, *self.server.workers()} - {*stopped}:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(one, signal.SIGSTOP)
                stopped.append(one)
            return self.script.running_job()

        job = until(hanging, "a job that hangs")
        struck.set()
        self.script.cancel(job)
        for one in stopped:
            with contextlib.suppress(ProcessLookupError):  # the server has killed it
                os.kill(one, signal.SIGCONT)

    def _under_way(self, at: float) -> str:
        begun = [(one, name) for one, name, when in self.rover.begun() if when < at]
        if not begun:
            return ""
        last, name = begun[-1]
        records = read_session(self.data / self.session).records
        ended = any(r["type"] in ENDS and r["payload"]["id"] == last and r["time"] < at for r in records)
        return "" if ended else name

    def _work(self, kind: str, moment: str, steps: bool, struck: threading.Event) -> str:
        """Go on until something fails because of the trouble; what that was."""
        while not struck.is_set():
            for name, act in self._acts(kind, moment, steps):
                try:
                    act()
                except (Interrupted, httpx.TransportError, TimeoutError) as err:
                    if not struck.wait(PATIENCE if kind == "link" else 1.0):
                        raise
                    return f"{name}: {err}"
                if struck.is_set():
                    return f"after {name}"
        return "between two acts"

    def _acts(self, kind: str, moment: str, steps: bool) -> Iterator[tuple[str, Callable[[], object]]]:
        script = self.script
        yield "note", script.note
        if kind == "hang":
            yield "plan", script.plan
        if self.ledger.stopped:  # left in force for the trouble: nothing moves
            return
        if steps:
            if self._rng.random() < 0.2:
                yield "terrain", script.load_terrain
            yield "step", script.step
        elif kind == "worker" and moment != "command":
            yield "plan", script.plan
        else:
            yield "waits", script.wait_on_rover
            yield "note", script.note
        if moment == "stop":
            yield "stop", script.stop
        elif self._rng.random() < 0.2:
            yield "stop", script.stop
            yield "clearing", script.clear_stop

    def _recover(self, kind: str) -> None:
        script = self.script
        if kind == "server":
            self.server.end()
            self._listener.end()
            self.server.start()
            self._listener = Listener(self.server.url, self.session, self.ledger)
            self._deaf.close()
            self._deaf = self._never_reading()
        elif kind == "rover":
            self.rover.end()
            until(lambda: not script.linked(), "the loss of the link")
            self.rover.start(self.link.url)
        until(script.linked, "the rover's link")
        if kind in ("worker", "hang"):
            script.plan()

    def _never_reading(self) -> Deaf:
        return Deaf(self.server.port, f"{BASE}/sessions/{self.session}/events/line?rate=20")

    def _after(self, steps: bool) -> list[str]:
        """The session goes on: what was stopped is stopped, what was open has an end, and new work is done."""
        script = self.script
        problems = []
        if self.ledger.stopped and not script.stop_in_force():
            problems.append("a stop that was answered is not in force any more")
        if self.ledger.stopped and script.lets_move():
            problems.append("a sequence was armed while a stop was in force")
        with contextlib.suppress(TimeoutError):
            until(lambda: not script.settled(), "the end of the run", PATIENCE)
        problems += script.settled()
        if script.stop_in_force():
            script.clear_stop()
        script.note()
        if steps:
            self._step_on()
        else:
            script.wait_on_rover()
        return problems

    def _step_on(self) -> None:
        """A whole step; where a leg was left in the air so that no step is possible, the rover is set up anew."""
        try:
            self.script.step()
        except Interrupted:
            self.set_up_again += 1
            self.rover.end()
            until(lambda: not self.script.linked(), "the loss of the link")
            self._set_up()
            self.rover.start(self.link.url)
            until(self.script.linked, "the rover's link")
            self.script.step()

    def _set_up(self) -> None:
        (self._folder / "state.npz").write_bytes(encode(self._state))
