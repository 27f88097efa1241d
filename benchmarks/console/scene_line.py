"""One browser's line to the scene of a server, as far as benchmarks need it: what is sent, and layers switched."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import msgspec
import viser
from viser._messages import ViewerCameraMessage
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from benchmarks.console.apart import Apart

SESSION = "/sessions/current"
PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
CAMERA = ViewerCameraMessage((1, 0, 0, 0), (0, -5, 3), 1.0, 0.1, 100.0, 480, 640, (0, 0, 0), (0, 0, 1))
"""Where a page says that it looks from: before that it has no scene."""
PAGE = "switches"
QUIET = 1.0
"""The scene has said what it had to say when it was silent this long [s]."""
LONGEST = 120.0
"""Wait for what must come [s]."""
LAYERS = ("footing", "slope")


class Overheard:
    """Counts the bytes that the scene sends to one browser. last: when the latest came, on the monotonic clock."""

    def __init__(self, socket: Connection) -> None:
        self.count = 0
        self._socket = socket
        self.last = time.monotonic()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        try:
            while True:
                self.count += len(self._socket.recv())
                self.last = time.monotonic()
        except ConnectionClosed:
            return

    def settled(self) -> int:
        """The count, once nothing more comes."""
        begin = time.monotonic()
        while time.monotonic() - max(self.last, begin) < QUIET:
            time.sleep(0.05)
        return self.count

    def more_than(self, count: int) -> int:
        """The count, once it is larger and nothing more comes. Raises RuntimeError where nothing does."""
        begin = time.monotonic()
        while self.count <= count:
            if time.monotonic() - begin > LONGEST:
                raise RuntimeError(f"the scene sent nothing within {LONGEST:g} s")
            time.sleep(0.01)
        return self.settled()


class Switching:
    """Switches layers, and moves the ghost, for the page that listens; each layer was shown before."""

    def __init__(self, client: httpx.Client, heard: Overheard) -> None:
        self._client, self._heard = client, heard
        heard.more_than(0)
        for layer in LAYERS[::-1]:
            self.switched(layer)

    def switched(self, layer: str) -> tuple[int, float]:
        """Bytes that showing another layer sent, and seconds until the last of them came."""
        return self._shown({"leg": 2, "layer": layer})

    def moved(self, place: float) -> tuple[int, float]:
        """Bytes that the ghost at another place of its way, 0…1, sent, and seconds until the last of them came."""
        return self._shown({"show_ghost": True, "scrub": place})

    def _shown(self, view: dict[str, Any]) -> tuple[int, float]:
        before, begin = self._heard.settled(), time.monotonic()
        self._client.put(f"{SESSION}/view", json=view, headers={"FootFall-Page": PAGE}).raise_for_status()
        after = self._heard.more_than(before)
        return after - before, self._heard.last - begin


@contextmanager
def looking(url: str, page: str) -> Iterator[Overheard]:
    """A page of the server at ``url`` that looks at its scene: without one nothing is drawn."""
    line, origin = f"ws{url.removeprefix('http')}/scene?page={page}", Origin(url)
    with connect(line, subprotocols=[PROTOCOL], proxy=None, max_size=None, origin=origin) as socket:
        heard = Overheard(socket)
        socket.send(msgspec.msgpack.encode(CAMERA.as_serializable_dict()))
        yield heard


@contextmanager
def switching(served: Apart, client: httpx.Client) -> Iterator[Switching]:
    """A page of that server, for a client of it."""
    with looking(served.url, PAGE) as heard:
        yield Switching(client, heard)
