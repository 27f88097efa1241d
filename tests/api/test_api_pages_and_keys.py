"""Laws of paging, of Idempotency-Key, and of ETags of products."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.requests import Request
from starlette.responses import PlainTextResponse

from footfall.api.assemble import assemble
from footfall.api.auth.who import IDENTITY
from footfall.api.bodies.paging import page
from footfall.api.door.idempotency import Idempotency
from footfall.core.errors import InvalidInput
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import rock_field
from tests.support.local import Local
from tests.support.problems import problem


def _request() -> Request:
    return Request({"type": "http", "method": "GET", "path": "/things", "query_string": b"a=1", "headers": []})


@given(count=st.integers(0, 40), limit=st.integers(1, 15))
def test_pages_together_are_the_list(count, limit):
    items = [f"item {i}" for i in range(count)]
    found, cursor = [], None
    while True:
        part, following = page(items, str, limit, cursor, _request())
        assert len(part) <= limit
        found += part
        if following is None:
            break
        assert following.startswith("/things?a=1&")
        cursor = part[-1]
    assert found == items


def test_a_cursor_of_nothing_is_refused():
    with pytest.raises(InvalidInput):
        page(["a"], str, 1, "b", _request())


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with Sessions(tmp_path_factory.mktemp("sessions"), InlineJobs()) as sessions:
        for name in ("one", "two", "three"):
            live = sessions.create(name)
        live.terrains.load(rock_field(size=2.0, resolution=0.1, seed=1), "made for the tests")
        yield Local(assemble(sessions))


@pytest.mark.parametrize(("path", "member"), [("sessions", "sessions"), ("recordings", "recordings")])
def test_lists_are_read_page_by_page(client, path, member):
    whole = client.get(path).json()
    assert whole["next"] is None
    first = client.get(path, params={"limit": 2}).json()
    rest = client.get(first["next"]).json()
    assert first[member] + rest[member] == whole[member]
    assert rest["next"] is None


def test_the_log_is_read_page_by_page(client):
    whole = client.get("sessions/current/log").json()["events"]
    read, address = [], "sessions/current/log?limit=1"
    while address:
        part = client.get(address).json()
        read += part["events"]
        address = part["next"]
    assert read == whole
    assert len(whole) >= 2


def test_products_are_not_sent_twice(client):
    digest = client.get("sessions/current").json()["dem"]
    for path in (f"sessions/current/terrains/{digest}", f"sessions/current/terrains/{digest}.npz"):
        first = client.get(path)
        tag = first.headers["etag"]
        again = client.get(path, headers={"if-none-match": f'"other", W/{tag}'})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
        assert client.get(path, headers={"if-none-match": '"other"'}).content == first.content
    # what is present changes, and what is gone is gone
    assert "etag" not in client.get("sessions/current/terrains/current").headers
    gone = client.get(f"sessions/current/terrains/{'0' * 32}", headers={"if-none-match": "*"})
    problem(gone, 404, "not-found")


def _call(app, key, body):
    sent = []

    async def receive():
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message):
        sent.append(message)

    headers = [(b"idempotency-key", key)]
    scope = {"type": "http", "method": "POST", "path": "/do", "query_string": b"", "headers": headers, IDENTITY: None}
    return app(scope, receive, send), sent


@given(st.lists(st.tuples(st.sampled_from([b"k1", b"k2"]), st.sampled_from([b"a", b"b"])), max_size=12))
def test_a_key_does_its_work_once(requests):
    done = []

    async def work(scope, receive, send):
        done.append((await receive())["body"])
        await PlainTextResponse(f"{len(done)}")(scope, receive, send)

    app, first = Idempotency(work), {}
    for key, body in requests:
        call, sent = _call(app, key, body)
        asyncio.run(call)
        status, text = sent[0]["status"], sent[1]["body"]
        if key not in first:
            first[key] = (body, text)
        if first[key][0] == body:
            assert (status, text) == (200, first[key][1])
        else:
            assert status == 422
    assert len(done) == len(first)


def test_a_key_that_is_being_worked_on_is_a_conflict():
    async def both():
        going, may_end = asyncio.Event(), asyncio.Event()

        async def work(scope, receive, send):
            going.set()
            await may_end.wait()
            await PlainTextResponse("done")(scope, receive, send)

        app = Idempotency(work)
        call, sent = _call(app, b"k", b"a")
        first = asyncio.create_task(call)
        await going.wait()
        second, refused = _call(app, b"k", b"a")
        await second
        may_end.set()
        await first
        again, repeated = _call(app, b"k", b"a")
        await again
        return sent[0]["status"], refused[0]["status"], repeated[1]["body"]

    assert asyncio.run(both()) == (200, 409, b"done")


def test_what_is_being_worked_on_is_not_forgotten_for_later_keys(monkeypatch):
    monkeypatch.setattr("footfall.api.door.idempotency.MOST_ANSWERS", 3)

    async def all_of_them():
        may_end, done = asyncio.Event(), []

        async def work(scope, receive, send):
            body = (await receive())["body"]
            done.append(body)
            if body == b"slow":
                await may_end.wait()
            await PlainTextResponse("done")(scope, receive, send)

        app = Idempotency(work)
        slow = asyncio.create_task(_call(app, b"slow", b"slow")[0])
        await asyncio.sleep(0)  # it begins
        for number in range(9):
            await _call(app, b"%d" % number, b"quick")[0]
        again, refused = _call(app, b"slow", b"slow")
        await again
        may_end.set()
        await slow
        return refused[0]["status"], done.count(b"slow"), len(app._answers)

    assert asyncio.run(asyncio.wait_for(all_of_them(), 10)) == (409, 1, 3)


def test_half_a_request_is_not_done():
    """Its beginning may make sense by itself."""

    async def work(scope, receive, send):
        done.append(1)

    async def receive():
        return said.pop(0)

    done: list[int] = []
    said = [{"type": "http.request", "body": b'{"text": "a"}', "more_body": True}, {"type": "http.disconnect"}]
    headers = [(b"idempotency-key", b"k")]
    scope = {"type": "http", "method": "POST", "path": "/do", "query_string": b"", "headers": headers, IDENTITY: None}
    asyncio.run(Idempotency(work)(scope, receive, lambda message: None))  # type: ignore[arg-type]
    assert (done, said) == ([], [])


def test_a_key_whose_work_failed_may_be_tried_again():
    async def work(scope, receive, send):
        done.append(1)
        await PlainTextResponse("no", status_code=503 if len(done) == 1 else 200)(scope, receive, send)

    done: list[int] = []
    app = Idempotency(work)
    statuses = []
    for _ in range(3):
        call, sent = _call(app, b"k", b"a")
        asyncio.run(call)
        statuses.append(sent[0]["status"])
    assert (statuses, len(done)) == ([503, 200, 200], 2)
