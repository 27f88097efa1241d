"""A man in the middle of the rover link who loses, repeats, delays, reorders and cuts, by a seed."""

import asyncio
import contextlib
import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

from websockets.asyncio.client import connect
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from footfall.telemetry.link import MAX_BINARY_FRAME, SUBPROTOCOL


@dataclass(frozen=True)
class Badness:
    """What is done to each message, both ways. ``hello`` alone, which opens a connection, is carried as it is.

    lose, repeat: probabilities. delay: longest wait, each message its own [s]; in order unless ``reorder``.
    cut_every: the connection is closed so often [s]; 0: never.
    """

    lose: float = 0.0
    repeat: float = 0.0
    delay: float = 0.0
    reorder: bool = False
    cut_every: float = 0.0


class BadLink:
    """Stands at ``url`` before the server's rover link ``upstream``; use it as an async context manager.

    Rover and server each have a WebSocket of their own to it. badness: may be changed; when to cut, from the next
    connection on. done: how many messages were carried, lost, repeated, and how often it was cut. holding: whether
    commands are held back, in ``held``, until :meth:`let_go`.
    """

    def __init__(self, upstream: str, badness: Badness, seed: int) -> None:
        self.badness = badness
        self._upstream, self._random = upstream, Random(seed)
        self._server: Server | None = None
        self._late: set[asyncio.Task[None]] = set()
        self._loop = asyncio.get_running_loop()
        self._rover: ServerConnection | None = None
        self.holding = False
        self.held: list[str] = []
        self.done: Counter[str] = Counter()

    @property
    def url(self) -> str:
        """Where the rover connects to."""
        assert self._server is not None
        return f"ws://127.0.0.1:{next(iter(self._server.sockets)).getsockname()[1]}/"

    def let_go(self) -> None:
        """What is held back reaches the rover that is there now; from another thread than the link's."""
        assert self._rover is not None
        self.holding = False
        while self.held:
            asyncio.run_coroutine_threadsafe(self._rover.send(self.held.pop(0)), self._loop).result(10)

    def cut(self) -> None:
        """Close the connection that there is; from another thread than the link's."""
        if self._rover is not None:
            asyncio.run_coroutine_threadsafe(self._rover.close(), self._loop).result(20)
            self.done["cut"] += 1

    async def __aenter__(self) -> "BadLink":
        protocols = [Subprotocol(SUBPROTOCOL)]
        self._server = await serve(self._between, "127.0.0.1", 0, subprotocols=protocols, max_size=MAX_BINARY_FRAME)
        return self

    async def __aexit__(self, *_: object) -> None:
        assert self._server is not None
        self._server.close()
        for task in self._late:
            task.cancel()
        await self._server.wait_closed()

    async def _between(self, rover: ServerConnection) -> None:
        self._rover = rover
        protocols = [Subprotocol(SUBPROTOCOL)]
        with contextlib.suppress(OSError, WebSocketException):
            async with connect(self._upstream, subprotocols=protocols, proxy=None, max_size=MAX_BINARY_FRAME) as server:
                ways = [asyncio.create_task(self._carry(*way)) for way in ((rover, server), (server, rover))]
                patience = self.badness.cut_every or None
                await asyncio.wait(ways, timeout=patience, return_when=asyncio.FIRST_COMPLETED)
                self.done["cut"] += not any(way.done() for way in ways)
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)

    async def _carry(self, source, sink) -> None:
        order = asyncio.Lock()
        async for text in source:
            bad = self.badness
            if isinstance(text, str) and '"hello"' in text[:40]:
                await sink.send(text)
                continue
            if self.holding and isinstance(text, str) and '"command"' in text[:40]:
                self.held.append(text)
                continue
            if self._random.random() < bad.lose:
                self.done["lost"] += 1
                continue
            again = self._random.random() < bad.repeat
            self.done["carried"] += 1
            self.done["repeated"] += again
            for _ in range(1 + again):
                task = asyncio.create_task(self._late_one(sink, text, None if bad.reorder else order))
                self._late.add(task)
                task.add_done_callback(self._late.discard)

    async def _late_one(self, sink, text: str | bytes, order: asyncio.Lock | None) -> None:
        wait = self._random.uniform(0.0, self.badness.delay)
        with contextlib.suppress(ConnectionClosed):
            async with order or contextlib.nullcontext():
                # in order each waits for those before it as well: a slow line more than a far one
                await asyncio.sleep(wait)
                await sink.send(text)


BAD = {
    "cut": Badness(cut_every=1.5),
    "delayed": Badness(delay=0.1),
    "repeated": Badness(repeat=0.5),
    "reordered": Badness(delay=0.3, reorder=True),
    "half lost": Badness(lose=0.5),
    "all at once": Badness(lose=0.3, repeat=0.3, delay=0.2, reorder=True, cut_every=4.0),
}


@contextlib.contextmanager
def linked_by(upstream: str, seed: int) -> Iterator[BadLink]:
    """A link in a thread of its own, good until its badness is changed."""
    ended, made, loop = threading.Event(), list[BadLink](), asyncio.new_event_loop()
    ready = threading.Event()

    async def run() -> None:
        async with BadLink(upstream, Badness(), seed) as link:
            made.append(link)
            ready.set()
            await asyncio.to_thread(ended.wait)

    thread = threading.Thread(target=loop.run_until_complete, args=(run(),), daemon=True)
    thread.start()
    try:
        if not ready.wait(20):
            raise TimeoutError("the link between rover and server did not open")
        yield made[0]
    finally:
        ended.set()
        thread.join(20)
        loop.close()
