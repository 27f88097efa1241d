"""What the server holds for those who ask is bounded before it is held: bodies, answers, pixels, unread connections."""

import asyncio
from collections import Counter
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI, Request, Response
from hypothesis import given
from hypothesis import strategies as st

from footfall.api.access import BASE, STOP
from footfall.api.door.answers import LARGE, PIECE
from footfall.api.door.holding import MADE_AT_ONCE, Holding
from footfall.api.door.problems import add_problem_responses
from footfall.core.errors import InvalidImages
from footfall.core.frames import transform
from footfall.io import link_images
from footfall.io.link_images import decode_images, encode_images
from footfall.session.budget import Budget
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall_ui.app import STUCK_AFTER, Server
from tests.support.frames import moving_frames
from tests.support.hostile import png_that_claims

FILES = f"{BASE}/sessions/x/terrains"
MIB = 1 << 20

ACTS = st.lists(st.tuples(st.sampled_from("abc"), st.integers(1, 60), st.booleans()), max_size=40)


@given(ACTS)
def test_no_client_holds_more_than_its_share_nor_all_more_than_there_is(acts):
    budget, held = Budget(100, 50), Counter()
    for client, size, gives in acts:
        if gives and held[client] >= size:
            budget.give_back(client, size)
            held[client] -= size
        else:
            fits = held[client] + size <= 50 and held.total() + size <= 100
            assert budget.takes(client, size) is fits
            held[client] += size * fits
        assert budget.held == held.total()


class Asked:
    """Requests to an app whose clients send and fetch only as far as they are told to."""

    def __init__(self, app: Holding) -> None:
        self.app = app
        self.ended: dict[str, int] = {}

    def begin(
        self, name: str, path: str, client: str, body: bytes = b"", ends: bool = True, method: str = "POST"
    ) -> "One":
        one = One(self, name, path, client, body, ends)
        one.scope["method"] = method
        one.task = asyncio.create_task(one.run())
        return one


class One:
    def __init__(self, asked: Asked, name: str, path: str, client: str, body: bytes, ends: bool) -> None:
        self.scope = {"type": "http", "method": "POST", "path": path, "headers": [], "client": (client, 1)}
        self.scope |= {"query_string": b""}
        self.asked, self.name = asked, name
        self.queue: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.more(body, ends)
        self.fetches = asyncio.Event()
        self.came: list[dict[str, Any]] = []
        self.task: asyncio.Task[None]

    def more(self, body: bytes, ends: bool) -> None:
        self.queue.put_nowait({"type": "http.request", "body": body, "more_body": not ends})

    async def run(self) -> None:
        await self.asked.app(self.scope, self.queue.get, self.send)

    async def send(self, message) -> None:
        self.came.append(message)
        if len(message.get("body", b"")) >= PIECE:
            await self.fetches.wait()

    @property
    def status(self) -> int | None:
        return self.came[0]["status"] if self.came else None

    @property
    def body(self) -> bytes:
        return b"".join(message.get("body", b"") for message in self.came)


async def settle() -> None:
    for _ in range(50):
        await asyncio.sleep(0)


async def _echo(request: Request) -> Response:
    return Response(str(len(await request.body())))


async def _large() -> Response:
    return Response(bytes(3 * MIB))


def holding(of_one: int, in_all: int, make: Callable[..., Any] = _large) -> Holding:
    app = FastAPI()
    add_problem_responses(app)
    for path in (FILES, STOP, f"{BASE}/notes"):
        app.post(path)(_echo)
    app.post("/large")(_large)
    app.get(f"{FILES}/x.npz")(make)
    return Holding(app, 64 * MIB, of_one, in_all)


def test_bodies_that_do_not_end_leave_room_for_others():
    async def story() -> None:
        app = holding(2 * MIB, 3 * MIB)
        asked = Asked(app)
        first = asked.begin("first", FILES, "a", bytes(2 * MIB), ends=False)
        await settle()
        greedy = asked.begin("greedy", FILES, "a", bytes(MIB))
        await settle()
        assert greedy.status == 503
        assert b"/problems/busy" in greedy.body
        assert (b"retry-after", b"5") in greedy.came[0]["headers"]
        other = asked.begin("other", FILES, "b", bytes(MIB), ends=False)
        third = asked.begin("third", FILES, "c", bytes(1))
        await settle()
        assert third.status == 503
        # what takes no files is none of it, and a stop never is
        for path in (f"{BASE}/notes", STOP):
            small = asked.begin("small", path, "a", bytes(1000))
            await settle()
            assert (small.status, small.body) == (200, b"1000")
        assert app.bodies.held == 3 * MIB
        for one in (first, other):
            one.more(b"", True)
        await asyncio.gather(first.task, other.task)
        assert first.body == str(2 * MIB).encode()
        assert app.bodies.held == 0

    asyncio.run(story())


def test_answers_that_nobody_fetches_are_few_and_go_in_pieces():
    async def story() -> None:
        app = holding(6 * MIB, 9 * MIB)
        asked = Asked(app)
        ones = [asked.begin(f"{i}", "/large", "a") for i in range(4)]
        await settle()
        assert [one.status for one in ones] == [200, 200, 503, 503]
        assert all(len(one.body) <= PIECE for one in ones)
        other = asked.begin("other", "/large", "b")
        small = asked.begin("small", f"{BASE}/notes", "a", b"x")
        await settle()
        assert (other.status, small.status) == (200, 200)
        for one in (*ones, other):
            one.fetches.set()
        await asyncio.gather(*(one.task for one in (*ones, other)))
        assert [len(one.body) for one in (*ones[:2], other)] == [3 * MIB] * 3
        assert not ones[0].came[-1].get("more_body", False)
        assert app.answers.held == 0

    asyncio.run(story())


def test_few_files_are_made_at_once_and_fetching_them_holds_up_nobody():
    async def story() -> None:
        now, most, go_on = 0, 0, asyncio.Event()

        async def make() -> Response:
            nonlocal now, most
            now, most = now + 1, max(most, now + 1)
            await go_on.wait()
            now -= 1
            return Response(bytes(2 * PIECE))

        app = holding(9 * MIB, 9 * MIB, make)
        ones = [Asked(app).begin(f"{i}", f"{FILES}/x.npz", "a", method="GET") for i in range(5)]
        other = Asked(app).begin("other", f"{BASE}/notes", "a", b"x")
        await settle()
        assert (now, other.status) == (MADE_AT_ONCE, 200)
        go_on.set()
        await settle()
        # all wait to be fetched
        assert ([one.status for one in ones], most) == ([200] * 5, MADE_AT_ONCE)
        for one in ones:
            one.fetches.set()
        await asyncio.gather(*(one.task for one in ones))

    asyncio.run(story())


def test_an_answer_too_large_for_every_share_goes_alone():
    async def story() -> None:
        app = holding(2 * MIB, 2 * MIB)
        one = Asked(app).begin("one", "/large", "a")
        one.fetches.set()
        await one.task
        assert (one.status, len(one.body)) == (200, 3 * MIB)
        assert LARGE < 2 * MIB

    asyncio.run(story())


class Connection:
    def __init__(self, waiting: int) -> None:
        self.waiting, self.aborted = waiting, False
        self.transport = self

    def get_write_buffer_size(self) -> int:
        return self.waiting

    def abort(self) -> None:
        self.aborted = True


def test_who_takes_nothing_is_disconnected_and_who_reads_slowly_is_not():
    stuck, slow, idle = Connection(70_000), Connection(10_000_000), Connection(0)
    server = object.__new__(Server)
    server._unread = {}
    server.server_state = SimpleNamespace(connections={stuck, slow, idle})  # type: ignore[assignment]
    for second in range(int(STUCK_AFTER) + 1):
        server._close_what_takes_nothing(float(second))
        slow.waiting -= 1000
        assert not stuck.aborted
    server._close_what_takes_nothing(STUCK_AFTER + 1)
    assert (stuck.aborted, slow.aborted, idle.aborted) == (True, False, False)


def snapshot(pairs: int, side: int) -> Snapshot:
    """Pairs of cameras of side × side pixels; the images are put in by the test."""
    image = np.zeros((side, side), np.uint8)
    cameras = [
        Camera(name, side, side, 50.0, 50.0, side / 2, side / 2, transform(translation=(x, 0.0, 0.0)))
        for name, x in (("l", 0.0), ("r", 0.3))
    ]
    made = [ImagePair(f"p{i}", 1.0, image, image, cameras[0], cameras[1], np.eye(4)) for i in range(pairs)]
    return Snapshot(moving_frames(1)[0].state, tuple(made))


def test_images_of_a_rover_are_counted_before_they_are_unpacked(monkeypatch):
    # heads alone: whoever unpacked one would find nothing in it
    monkeypatch.setattr(link_images, "_png", lambda image: png_that_claims(9000, 9000))
    with pytest.raises(InvalidImages, match="have 1944000000 pixels; a frame has at most 100000000"):
        decode_images(encode_images("x", snapshot(12, 4)))
    monkeypatch.setattr(link_images, "_png", lambda image: png_that_claims(60_000, 60_000))
    with pytest.raises(InvalidImages, match="a frame has at most"):
        decode_images(encode_images("x", snapshot(1, 4)))


def test_as_many_pixels_as_a_frame_may_have_are_read(monkeypatch):
    monkeypatch.setattr(link_images, "MAX_FRAME_PIXELS", 4 * 8 * 8)
    assert len(decode_images(encode_images("x", snapshot(2, 8)))[1].pairs) == 2
    with pytest.raises(InvalidImages, match="send fewer pairs"):
        decode_images(encode_images("x", snapshot(3, 8)))
