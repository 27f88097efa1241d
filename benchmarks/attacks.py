"""How long a stop takes while others do their worst, and what memory that costs: one row an attack, and one of none.

The server is a process of its own, as `footfall serve` starts it; so is who attacks. Stops come by request, each on a
connection of its own, and by the page's line, in turn.
"""

import contextlib
import json
import multiprocessing
import threading
import time
from collections.abc import Iterator
from multiprocessing.synchronize import Event
from pathlib import Path
from tempfile import TemporaryDirectory

from websockets.sync.client import connect
from websockets.sync.connection import Connection

from benchmarks.attackers import ATTACKS, Attack, answer_of, begun
from benchmarks.soak.processes import ServerProcess
from benchmarks.timing import Figure
from footfall.api.access import BASE
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import rock_field

LIMIT = 0.5
"""What a stop may take, under every attack [s]."""
MOST_MEMORY = 1024.0
"""What an attack may cost beside the idle server [MiB]."""
AT_ONCE = 4
"""Who attacks does it from so many connections, where the attack names no other number."""
SESSION = f"{BASE}/sessions/current"


def figures(quick: bool) -> Iterator[Figure]:
    count = 20 if quick else 100
    with TemporaryDirectory(prefix=".footfall-bench-", dir=".") as work:
        data = Path(work) / "data"
        with Sessions(data, InlineJobs()) as sessions:
            live = sessions.create("attacked")
            live.terrains.load(rock_field(size=40.0, resolution=0.04, seed=3), "made for the benchmark")
            name = live.id
        server = ServerProcess(data, name, Path(work) / "log")
        server.start()
        try:
            with connect(f"ws://127.0.0.1:{server.port}{BASE}/stop/line", proxy=None) as line:
                _stops(server.port, line, 5)
                idle = at_rest(server.pid)
                for told, attack in ATTACKS.items():
                    with _attacked(attack, server.port), _peak(server.pid) as memory:
                        times = _stops(server.port, line, count)
                    yield Figure(f"attacks.stop, {told}", times, "s", floor=LIMIT, p95_at_most=LIMIT)
                    cost = max(memory) - idle
                    yield Figure(f"attacks.memory, {told}", (cost,), "MiB", floor=MOST_MEMORY)
        finally:
            server.end()


def _stops(port: int, line: Connection, count: int) -> tuple[float, ...]:
    """How long each stop takes until it is answered, by request and by line in turn."""
    times = []
    for number in range(count):
        begin = time.perf_counter()
        if number % 2:
            line.send("{}")
            stopped = json.loads(line.recv(timeout=120))["stopped"]
        else:
            with begun(port, f"{BASE}/stop", b"{}", len(b"{}")) as raw:
                stopped = b'"stopped":true' in answer_of(raw)
        times.append(time.perf_counter() - begin)
        if not stopped:
            raise RuntimeError("a stop was not answered as one")
        time.sleep(0.05)
    return tuple(times)


def at_rest(pid: int) -> float:
    """Memory of a server once its workers have loaded what they need, as seen by its ceasing to grow [MiB]."""
    before, now = 0.0, resident(pid)
    while now > before + 1.0:
        time.sleep(5.0)
        before, now = now, resident(pid)
    return now


def resident(pid: int) -> float:
    """Memory of a process and of those that it started, shared pages once [MiB]; one that ended has none."""
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
        shares = [int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")]
        threads = list(Path(f"/proc/{pid}/task").iterdir())
        started = [child for one in threads for child in (one / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return sum(shares) / 1024 + sum(resident(int(child)) for child in started)


@contextlib.contextmanager
def _peak(pid: int) -> Iterator[list[float]]:
    found, over = [resident(pid)], threading.Event()

    def look() -> None:
        while not over.wait(0.1):
            found.append(resident(pid))

    looking = threading.Thread(target=look)
    looking.start()
    try:
        yield found
    finally:
        over.set()
        looking.join()


@contextlib.contextmanager
def _attacked(attack: Attack, port: int) -> Iterator[None]:
    context = multiprocessing.get_context("spawn")
    going, over = context.Event(), context.Event()
    process = context.Process(target=_go, args=(attack, port, going, over), daemon=True)
    process.start()
    if not going.wait(120):
        raise RuntimeError("the attack did not begin")
    try:
        yield
    finally:
        over.set()
        process.join(5)
        process.kill()


def _go(attack: Attack, port: int, going: Event, over: Event) -> None:
    def again() -> None:
        while not over.is_set():
            with contextlib.suppress(Exception):  # it is refused in many ways, and goes on
                attack(port)
            going.set()
            time.sleep(0.01)

    for _ in range(AT_ONCE):
        threading.Thread(target=again, daemon=True).start()
    time.sleep(1.0)  # one that never ends is going by now
    going.set()
    over.wait()
