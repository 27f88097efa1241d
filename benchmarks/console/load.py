"""Telemetry at 10 Hz to five clients, one of them a real page: who gets what when, and what it costs the server."""

import gc
import json
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, pairwise
from typing import Protocol

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from benchmarks.console.apart import Apart, served_apart
from benchmarks.console.page import chromium
from benchmarks.timing import Figure
from footfall.core.collector import leave_out_what_is_loaded

CLIENTS = 4
"""Beside the page."""
SETTLING = 20.0
"""Not measured: the page loads, the server's memory fills [s]."""


class Listener(Protocol):
    """Somebody who follows a session. heard: (number of the frame, when the server took it, when it came) [s]."""

    @property
    def heard(self) -> Sequence[tuple[int, float, float]]: ...


class Client:
    """A listener over a socket of its own."""

    def __init__(self, socket: Connection) -> None:
        self.heard: list[tuple[int, float, float]] = []
        self._socket = socket
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        try:
            while True:
                message = json.loads(self._socket.recv())
                if message["type"] == "telemetry":
                    now, frame = time.monotonic(), message["data"]
                    self.heard.append((frame["number"], now - frame["age_s"], now))
                    self._socket.send(json.dumps({"heard": frame["number"]}))
        except ConnectionClosed:
            return


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
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(f"{served.url}/?fixedDpr=0.5")
        sockets = [
            connect(served.line("/api/v1/sessions/current/events/line?ahead=2"), proxy=None) for _ in range(CLIENTS)
        ]
        clients = [Client(socket) for socket in sockets]
        page.wait_for_timeout(1000 * SETTLING)
        # the listeners here are to be as awake as programs of their own
        gc.collect()
        leave_out_what_is_loaded()
        yield from measured(served, clients, lambda: page.wait_for_timeout(1000 * seconds))
        stale = page.locator("#status-link").get_attribute("data-state")
        yield Figure("console.load.page_is_up_to_date", (float(stale == "good"),), "yes=1", 1.0, at_most=False)
        for socket in sockets:
            socket.close()


def measured(served: Apart, clients: list[Client], wait: Callable[[], object]) -> Iterator[Figure]:
    with served.client() as client:
        before = client.get("/sessions/current").json()["link"]
        begin, used, memory = time.monotonic(), served.processor_seconds(), served.memory()
        wait()
        took = time.monotonic() - begin
        after = client.get("/sessions/current").json()["link"]
    lost = sum(after[one] - before[one] for one in ("gaps", "late", "restarts"))
    yield Figure("console.load.frames", ((after["frames"] - before["frames"]) / took,), "1/s")
    yield Figure("console.load.frames_lost", (float(lost),), "frames", 0.0)
    yield Figure("console.load.longest_delay", (max(delays(clients, begin)),), "s", 0.2)
    yield Figure("console.load.server_core", ((served.processor_seconds() - used) / took,), "cores", 0.25)
    yield Figure("console.load.memory_growth", (served.memory() / memory - 1.0,), "ratio", 0.05)
