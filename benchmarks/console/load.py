"""Telemetry at 10 Hz to five clients, one of them a real page: who gets what when, and what it costs the server."""

import contextlib
import json
import multiprocessing
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, pairwise
from multiprocessing.connection import Connection as Pipe
from typing import Protocol

import numpy as np
from playwright.sync_api import Browser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from benchmarks.console.apart import Apart, served_apart
from benchmarks.console.page import chromium
from benchmarks.timing import Figure
from footfall.core.collector import leave_out_what_is_loaded

CLIENTS = 4
"""Beside the page."""
SETTLING = 20.0
"""Not measured: the page loads, the server's memory fills [s]."""


NOW = "performance.now() / 1000"
OVERHEARD = """window.overheard = [];
window.WebSocket = class extends WebSocket {
  constructor(...asked) {
    super(...asked);
    this.addEventListener("message", ({ data }) => {
      const said = typeof data === "string" && data.startsWith("{") ? JSON.parse(data) : {};
      if (said.type === "telemetry")
        window.overheard.push([said.data.number, performance.now() / 1000, said.data.age_s]);
    });
  }
};"""


class Listener(Protocol):
    """Somebody who follows a session. heard: (number of the frame, when the server took it, when it came) [s]."""

    @property
    def heard(self) -> Sequence[tuple[int, float, float]]: ...


class Client:
    """A listener in a process of its own, as programs of others are: it waits for nothing of this one. address: ws://…"""

    def __init__(self, address: str) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_listen, args=(address, theirs), daemon=True)
        self._process.start()
        theirs.close()

    @property
    def heard(self) -> Sequence[tuple[int, float, float]]:
        self._pipe.send("what was heard")
        return self._pipe.recv()

    def close(self) -> None:
        """Hang up."""
        self._pipe.close()
        self._process.join()


def _listen(address: str, pipe: Pipe) -> None:
    """Listen until the pipe closes; say what was heard whenever asked."""
    heard: list[tuple[int, float, float]] = []

    def listen() -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                message = json.loads(socket.recv())
                if message["type"] == "telemetry":
                    now, frame = time.monotonic(), message["data"]
                    heard.append((frame["number"], now - frame["age_s"], now))
                    socket.send(json.dumps({"heard": frame["number"]}))

    leave_out_what_is_loaded()
    with connect(address, proxy=None) as socket, contextlib.suppress(EOFError):
        threading.Thread(target=listen, daemon=True).start()
        while True:
            pipe.recv()
            pipe.send(tuple(heard))


class RealPage:
    """The operator's page as a listener: what its own line brought, when its script could hear it. address: http://…"""

    def __init__(self, browser: Browser, address: str) -> None:
        self.page = browser.new_page(viewport={"width": 1280, "height": 720})
        self.page.add_init_script(OVERHEARD)
        self.page.goto(address)
        # the least of a few errs by less than half of it
        asked = [(time.monotonic(), self.page.evaluate(NOW), time.monotonic()) for _ in range(20)]
        before, then, after = min(asked, key=lambda one: one[2] - one[0])
        self._ahead = 0.5 * (before + after) - then

    @property
    def heard(self) -> Sequence[tuple[int, float, float]]:
        came = [(int(number), at + self._ahead, age) for number, at, age in self.page.evaluate("window.overheard")]
        return [(number, at - age, at) for number, at, age in came]


def delays(clients: Sequence[Listener], since: float) -> list[float]:
    """For each client the longest time that a frame, or a newer one, took to it [s].

    When the server took the frames that no client was sent is read between those that some were.
    """
    # what comes while this computes was not measured, and would be held against the latest that was
    heard = [tuple(client.heard) for client in clients]
    taken: dict[int, float] = {}
    for number, at, _ in chain.from_iterable(heard):
        taken[number] = min(at, taken.get(number, at))
    known = sorted(taken)
    times = [taken[number] for number in known]
    worst = []
    for frames in heard:
        late = [0.0]
        for (before, _, _), (number, _, came) in pairwise(one for one in frames if one[2] >= since):
            late.append(came - float(np.interp(before + 1, known, times)) if number > before else 0.0)
        worst.append(max(late))
    return worst


def figures(quick: bool) -> Iterator[Figure]:
    seconds = 30.0 if quick else 600.0
    with served_apart() as served, chromium() as browser:
        page = RealPage(browser, f"{served.url}/?fixedDpr=0.5")
        line = served.line("/api/v1/sessions/current/events/line?ahead=2")
        clients = [Client(line) for _ in range(CLIENTS)]
        page.page.wait_for_timeout(1000 * SETTLING)
        yield from measured(served, [*clients, page], lambda: page.page.wait_for_timeout(1000 * seconds))
        stale = page.page.locator("#status-link").get_attribute("data-state")
        yield Figure("console.load.page_is_up_to_date", (float(stale == "good"),), "yes=1", 1.0, at_most=False)
        for client in clients:
            client.close()


def measured(served: Apart, clients: Sequence[Listener], wait: Callable[[], object]) -> Iterator[Figure]:
    with served.client() as client:
        before = client.get("/sessions/current").json()["link"]
        begin, used, memory = time.monotonic(), served.processor_seconds(), served.memory()
        wait()
        took = time.monotonic() - begin
        after = client.get("/sessions/current").json()["link"]
    lost = sum(after[one] - before[one] for one in ("gaps", "late", "restarts"))
    yield Figure("console.load.frames", ((after["frames"] - before["frames"]) / took,), "1/s")
    yield Figure("console.load.frames_lost", (float(lost),), "frames", 0.0)
    worst = delays(clients, begin)
    yield Figure("console.load.longest_delay", (max(worst),), "s", 0.2)
    yield Figure("console.load.longest_delay_of_the_page", (worst[-1],), "s", 0.2)
    yield Figure("console.load.server_core", ((served.processor_seconds() - used) / took,), "cores", 0.25)
    yield Figure("console.load.memory_growth", (served.memory() / memory - 1.0,), "ratio", 0.05)
