"""A working folder with a thousand sessions: start, list, look, open, health, and the memory that it takes.

The server is a process of its own, as `footfall serve` starts it. Of what may not grow with what is stored the peer is
the same server over a folder with few sessions, in the same run.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx

from benchmarks.attacks import at_rest, resident
from benchmarks.soak.processes import ServerProcess
from benchmarks.timing import Figure
from footfall.api.access import BASE
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.artifacts import encode
from footfall.io.bundles import FORMAT, VERSION, Bundle
from footfall.io.robot_files import load_robot
from footfall.session.log.event import next_event
from footfall.session.storage.store import SessionStore

FEW = 20
LIST_LIMIT, LOOK_LIMIT, OPEN_LIMIT = 0.2, 0.1, 0.3
"""Longest a page of the list, a look at a session, opening one may take [s]."""
MOST_MEMORY = 64.0
"""What looking at every session, and opening every tenth, may leave in the server's memory [MiB]."""


def figures(quick: bool) -> Iterator[Figure]:
    count, events = (200, 50) if quick else (1000, 200)
    with TemporaryDirectory(prefix=".footfall-bench-", dir=os.environ.get("FOOTFALL_BENCH_DISK", ".")) as work:
        few, many = Path(work) / "few", Path(work) / "many"
        _fill(few, FEW, events)
        names = _fill(many, count, events)
        starts, health = [], []
        for data in (few, many):
            with closing(_Served(data, Path(work) / "log")) as served:
                starts.append(served.started)
                health.append(_median(served.timed("/health/ready", 10)))
                if data is few:
                    continue
                about = f"{count} sessions"
                yield Figure(f"many_sessions.page of the list, {about}", served.pages(), "s", floor=LIST_LIMIT)
                before = served.memory_at_rest
                looked = [served.timed(f"{BASE}/sessions/{name}", 1)[0] for name in names]
                yield Figure(f"many_sessions.look at one, {about}", tuple(looked), "s", floor=LOOK_LIMIT)
                opened = [served.timed(f"{BASE}/sessions", 1, {"session": name})[0] for name in names[::10]]
                yield Figure(f"many_sessions.open one, {about}", tuple(opened), "s", floor=OPEN_LIMIT)
                cost = served.memory - before
                yield Figure(f"many_sessions.memory after all were looked at, {about}", (cost,), "MiB", MOST_MEMORY)
                yield Figure("many_sessions.open files", (float(served.files),), "files")
        yield Figure(f"many_sessions.start, {count} against {FEW} sessions", (starts[1] / starts[0],), "ratio", 1.5)
        yield Figure(f"many_sessions.health, {count} against {FEW} sessions", (health[1] / health[0],), "ratio", 5.0)


class _Served:
    """A server over a data folder. started: how long it took until it was ready [s]."""

    def __init__(self, data: Path, log: Path) -> None:
        self._server = ServerProcess(data, sorted(path.name for path in data.glob("s0*"))[0], log)
        began = time.perf_counter()
        self._server.start()
        self.started = time.perf_counter() - began
        self._client = httpx.Client(base_url=self._server.url, timeout=120, trust_env=False)

    def timed(self, path: str, times: int, body: dict[str, Any] | None = None) -> tuple[float, ...]:
        """How long an answer takes. Raises where it is none."""

        def ask() -> None:
            answer = self._client.get(path) if body is None else self._client.post(path, json=body)
            answer.raise_for_status()

        return tuple(_seconds(ask) for _ in range(times))

    def pages(self) -> tuple[float, ...]:
        """How long each page of the list takes, from the first to the last."""
        times, path = [], f"{BASE}/sessions?limit=100"
        while path:
            began = time.perf_counter()
            path = self._client.get(path).raise_for_status().json()["next"]
            times.append(time.perf_counter() - began)
        return tuple(times)

    @property
    def memory(self) -> float:
        """Of the server's processes [MiB]."""
        return resident(self._server.pid)

    @property
    def memory_at_rest(self) -> float:
        """The same, once its workers have loaded what they need [MiB]."""
        return at_rest(self._server.pid)

    @property
    def files(self) -> int:
        """How many it has open."""
        return len(os.listdir(f"/proc/{self._server.pid}/fd"))

    def close(self) -> None:
        """End it."""
        self._client.close()
        self._server.end()


def _fill(data: Path, count: int, events: int) -> list[str]:
    """So many sessions of so many events; returns their ids."""
    robot = load_robot("athlete")
    content = encode(robot.description)
    names = [f"s{number:05}" for number in range(count)]
    for number, name in enumerate(names):
        about = {"format": FORMAT, "version": VERSION, "id": name, "name": name, "created": 1e9 + number}
        about |= {"robot": {"name": robot.name, "digest": robot.digest}, "software": SOFTWARE_VERSION}
        made = {"name": name, "robot": robot.digest, "robot_name": robot.name}
        log = [next_event(None, 1e9 + number, "session_created", made)]
        for noted in range(events - 1):
            log.append(next_event(log[-1], log[-1].time + 1.0, "note", {"text": f"note {noted}"}))
        records = [event.as_dict() for event in log]
        bundle = Bundle(about, records, 0, VERSION, {f"{robot.digest}.npz": lambda: content})
        SessionStore.take_in(data / name, bundle).close()
    return names


def _seconds(call: Callable[[], None]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _median(times: tuple[float, ...]) -> float:
    return sorted(times)[len(times) // 2]
