"""Messages of WebSockets that have begun and not ended: held within a budget, given up where they are slow."""

import asyncio
import base64
from contextlib import asynccontextmanager
from typing import Any, cast

import pytest
import uvicorn
from uvicorn.server import ServerState
from websockets.sync.client import connect

from footfall.api.access import BASE
from footfall.api.door.guard import PATIENCE, SLOWEST
from footfall.api.door.limits import LINE_BYTES, TOO_BIG
from footfall.session.budget import Budget
from footfall.telemetry.link import PATH
from footfall_ui.app import Server
from footfall_ui.sized_lines import MOST_PIECES, SCENE_BYTES, SizedLines, sized_lines
from tests.support.waiting import until

TEXT, CONT, FIN = 0x01, 0x00, 0x80
LINE = f"{BASE}/stop/line"


def piece(kind: int, content: bytes) -> bytes:
    """A frame as a client sends it, masked with zeros."""
    size = len(content)
    told = bytes([0x80 | size]) if size < 126 else bytes([0x80 | 127]) + size.to_bytes(8, "big")
    return bytes([kind]) + told + bytes(4) + content


class Wire:
    """The server's end of a connection, to which nobody listens."""

    def __init__(self, client: str) -> None:
        self.client, self.closed, self.sent = client, False, b""

    def get_extra_info(self, name: str) -> Any:
        return {"peername": (self.client, 1), "sockname": ("127.0.0.1", 2)}.get(name)

    def write(self, data: bytes) -> None:
        self.sent += data

    def close(self) -> None:
        self.closed = True

    def is_closing(self) -> bool:
        return self.closed

    def pause_reading(self) -> None: ...

    def resume_reading(self) -> None: ...


class Lines:
    """Connections to an app that takes whatever comes."""

    def __init__(self) -> None:
        self.came: list[dict[str, Any]] = []
        config = uvicorn.Config(self.app, interface="asgi3", ws_max_size=LINE_BYTES, ws_ping_interval=None)
        config.load()
        self.config, self.state, self.protocol = config, ServerState(), sized_lines()

    async def app(self, scope, receive, send) -> None:
        assert (await receive())["type"] == "websocket.connect"
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] != "websocket.disconnect":
            self.came.append(message)
        self.came.append(message)

    @asynccontextmanager
    async def open(self, path: str = LINE, client: str = "192.0.2.1"):
        one, wire = self.protocol(self.config, self.state, {}), Wire(client)
        one.connection_made(cast(asyncio.Transport, wire))
        key = base64.b64encode(bytes(16)).decode()
        head = f"GET {path} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        one.data_received(f"{head}Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        await settle()
        assert wire.sent.startswith(b"HTTP/1.1 101")
        yield one, wire
        one.connection_lost(None)
        await settle()


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


def code_of(lines: Lines) -> int:
    assert lines.came[-1]["type"] == "websocket.disconnect"
    return lines.came[-1]["code"]


@pytest.mark.parametrize("begun", [piece(TEXT, b"{"), piece(TEXT, b"{" * 200)[:100]])
def test_a_message_of_which_nothing_more_comes_is_given_up(begun):
    async def story() -> None:
        lines = Lines()
        async with lines.open() as (one, wire):
            one.data_received(begun)
            one.close_where_slow(100.0)
            one.close_where_slow(100.0 + PATIENCE)
            assert (one.unended > 0, wire.closed) == (True, False)
            one.close_where_slow(100.1 + PATIENCE)
            await settle()
            assert (one.unended, wire.closed, code_of(lines)) == (0, True, TOO_BIG)
            assert b"of a message came, and not its end" in wire.sent

    asyncio.run(story())


def test_a_message_that_trickles_is_given_up_and_one_that_is_fast_is_not():
    async def story() -> None:
        for size, ends in ((SLOWEST // 2, True), (2 * SLOWEST, False)):
            lines = Lines()
            async with lines.open(PATH) as (one, wire):
                one.data_received(piece(TEXT, bytes(size)))
                for second in range(int(PATIENCE) + 3):
                    one.close_where_slow(float(second))
                    if not wire.closed:
                        one.data_received(piece(CONT, bytes(size)))
                assert wire.closed is ends
                if not ends:
                    one.data_received(piece(FIN | CONT, b""))
                    await settle()
                    assert len(lines.came[0]["text"]) == (int(PATIENCE) + 4) * size

    asyncio.run(story())


def test_small_messages_one_after_the_other_are_not_slow():
    async def story() -> None:
        lines = Lines()
        async with lines.open() as (one, wire):
            for second in range(3 * int(PATIENCE)):
                one.data_received(piece(TEXT, b"{"))
                one.close_where_slow(float(second))
                one.data_received(piece(FIN | CONT, b"}"))
                await settle()
            assert (wire.closed, len(lines.came)) == (False, 3 * int(PATIENCE))

    asyncio.run(story())


def test_the_server_looks_at_all_lines():
    looked = []

    class Line(SizedLines):
        def __init__(self) -> None:
            pass

        def close_where_slow(self, now: float) -> None:
            looked.append(self)

    server, line = object.__new__(Server), Line()
    server._look_at_lines({line, object()}, 5.0)
    assert looked == [line]


def test_unended_messages_to_scenes_are_few_of_one_and_of_all():
    async def story() -> None:
        lines = Lines()
        lines.protocol.budget = budget = Budget(900, 600)
        half = piece(TEXT, bytes(300))
        async with lines.open("/scene/") as (first, _), lines.open("/scene") as (second, wire):
            first.data_received(half)
            second.data_received(half[:200])
            head = len(half) - 300
            assert budget.of("192.0.2.1") == 300 + 200 - head
            second.data_received(half[200:] + piece(CONT, b"x"))
            await settle()
            assert (wire.closed, code_of(lines), budget.held) == (True, TOO_BIG, 300)
            others, third = lines.open("/scene", "192.0.2.2"), lines.open("/scene", "192.0.2.3")
            async with others as (other, _), third as (last, shut):
                other.data_received(half)
                last.data_received(piece(TEXT, bytes(400)))
                assert (shut.closed, budget.held) == (True, 600)
                # stops and the rover need none of it
                async with lines.open(LINE, "192.0.2.3") as (stops, stop_wire), lines.open(PATH) as (rover, rover_wire):
                    stops.data_received(half)
                    rover.data_received(piece(TEXT, bytes(5000)))
                    assert (stop_wire.closed, rover_wire.closed, budget.held) == (False, False, 600)
                # what has ended is held no more, nor what hung up
                other.data_received(piece(FIN | CONT, b""))
                assert budget.held == 300
        assert budget.held == 0
        assert SCENE_BYTES > 900

    asyncio.run(story())


def test_servers_do_not_share_what_they_count():
    assert sized_lines().budget is not sized_lines().budget


def test_pieces_that_are_too_large_together_stop_and_end_the_line(server, client):
    """Each piece fits; together they don't."""
    assert client.get("/stop").json()["stopped"] is False
    size = 2 * LINE_BYTES // MOST_PIECES
    with connect(f"ws{server.api.removeprefix('http')}/stop/line", proxy=None) as line:
        line.socket.sendall(piece(TEXT, bytes(size)) + piece(CONT, bytes(size)) * (MOST_PIECES // 2))
        until(lambda: client.get("/stop").json()["stopped"], "the stop")
    client.post("/stop/clear")
