"""What the server answers to a click: the footfall's verdict, another layer on the ground."""

import threading
import time
from collections.abc import Iterator

import httpx
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from benchmarks.console.apart import Apart, served_apart
from benchmarks.timing import Figure

SESSION = "/sessions/current"
QUIET = 1.0
"""The scene has said what it had to say when it was silent this long [s]."""
LAYERS = ("footing", "slope")


class Overheard:
    """Counts the bytes that the scene sends to one browser."""

    def __init__(self, socket: Connection) -> None:
        self.count = 0
        self._socket = socket
        self._last = time.monotonic()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        try:
            while True:
                self.count += len(self._socket.recv())
                self._last = time.monotonic()
        except ConnectionClosed:
            return

    def settled(self) -> int:
        """The count, once nothing more comes."""
        self._last = time.monotonic()
        while time.monotonic() - self._last < QUIET:
            time.sleep(0.05)
        return self.count


def figures(quick: bool) -> Iterator[Figure]:
    with served_apart(rover=False) as served, served.client() as client:
        mapped(client)
        yield Figure(
            "console.footfall_answer", tuple(answer(client, i) for i in range(20 if quick else 200)), "s", 0.06
        )
        yield Figure("console.layer_switch", tuple(switches(served, client, 3 if quick else 10)), "bytes", 2048)


def mapped(client: httpx.Client) -> None:
    """Maps of leg 2, and the layers shown once."""
    job = client.post(f"{SESSION}/maps", json={"leg": 2})
    job.raise_for_status()
    while (state := client.get(f"/jobs/{job.json()['id']}").json()["state"]) != "done":
        if state not in ("queued", "running"):
            raise RuntimeError(f"the maps are {state}")
        time.sleep(0.1)


def answer(client: httpx.Client, i: int) -> float:
    """Seconds from a click on the ground to what is known of the footfall there."""
    at = {"leg": 2, "x": 1.0 + 0.02 * (i % 20), "y": 2.0 + 0.02 * (i % 7)}
    begin = time.perf_counter()
    client.post(f"{SESSION}/footfalls", json=at).raise_for_status()
    return time.perf_counter() - begin


def switches(served: Apart, client: httpx.Client, count: int) -> Iterator[float]:
    """Bytes to one browser for showing a layer that it has had before; no rover moves meanwhile."""
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    line, origin = served.line("/scene"), Origin(served.url)
    with connect(line, subprotocols=[protocol], proxy=None, max_size=None, origin=origin) as socket:
        heard = Overheard(socket)
        for layer in LAYERS:
            client.put(f"{SESSION}/view", json={"leg": 2, "layer": layer}).raise_for_status()
            heard.settled()
        for i in range(count):
            before = heard.settled()
            client.put(f"{SESSION}/view", json={"layer": LAYERS[i % 2]}).raise_for_status()
            yield float(heard.settled() - before)
