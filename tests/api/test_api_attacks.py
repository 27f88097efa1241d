"""Requests made to hurt: each is refused by name, before it is read where it can be, and a stop goes on meanwhile.

Order decides, no clock: the attack is under way, the stop is answered, then the attack comes to its end.
"""

import asyncio
import contextlib
import json
import re
import socket
import threading
from collections import deque
from functools import partial

import httpx
import pytest
from starlette.types import Message
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.api.access import BASE
from footfall.api.door import json_bodies
from footfall.api.door.body_limits import (
    FRAME_BYTES,
    JSON_BYTES,
    JSON_PARTS,
    LOGIN_BYTES,
    TELEMETRY_PARTS,
    body_limit,
    takes_files,
)
from footfall.api.door.front import LOOPBACK
from footfall.api.door.guard import PATIENCE, SLOWEST, Guard
from footfall.api.door.limits import LINE_BYTES, TOO_BIG
from footfall.api.door.problems import MOST_ERRORS
from footfall.api.routes import ingest
from footfall.core.errors import InvalidTelemetry
from footfall.core.strict_json import MOST_DEEP
from footfall.telemetry.fields import MESSAGE_PARTS
from tests.support.problems import problem
from tests.support.server import Running
from tests.support.waiting import BOUND, until

JSON = {"content-type": "application/json"}
NOTES = "/sessions/current/notes"
MANY_NAMES = ("{" + ",".join(f'"n{i}":1' for i in range(20_000)) + ',"n7":1}').encode()
MANY_LISTS = b"[" + b"{}," * (20 << 20) + b"{}]"


def assert_stops(server: Running) -> None:
    """By request and by line, each answered."""
    with server.client() as client:
        assert client.post("/stop").json()["stopped"] is True
        with connect(f"ws{server.api.removeprefix('http')}/stop/line", proxy=None) as line:
            line.send("{}")
            assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
        assert client.post("/stop/clear").json()["stopped"] is False


@contextlib.contextmanager
def half_a_request(server: Running, path: str, headers: str, body: bytes):
    """One that has begun; the connection, for its rest and the answer."""
    host, port = server.url.removeprefix("http://").split(":")
    head = f"POST {BASE}{path} HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Type: application/json\r\n{headers}\r\n\r\n"
    with socket.create_connection((host, int(port)), timeout=BOUND) as raw:
        raw.sendall(head.encode() + body)
        yield raw


def status(raw: socket.socket) -> int:
    return int(raw.recv(1000).split()[1])


@pytest.mark.parametrize(
    ("path", "body", "limit"),
    [
        ("/login", MANY_NAMES, LOGIN_BYTES),
        ("/login", MANY_LISTS, LOGIN_BYTES),
        (NOTES, MANY_LISTS, JSON_BYTES),
        ("/sessions/current/terrains", MANY_LISTS, JSON_BYTES),
        ("/sessions", b"[" * (1 << 20), JSON_BYTES),
    ],
)
def test_what_is_too_large_is_refused_before_it_is_read(server, client, path, body, limit):
    told = problem(client.post(path, content=body, headers=JSON), 413, "too-large")
    assert told["limit"] == limit

    def pieces():
        for start in range(0, len(body), 1 << 14):
            yield body[start : start + (1 << 14)]

    # it may hang up on who goes on sending
    with contextlib.suppress(httpx.TransportError):
        problem(client.post(path, content=pieces(), headers=JSON), 413, "too-large")
    assert_stops(server)


@pytest.mark.parametrize("path", ["/login", NOTES, "/sessions/current/terrains", "/rover/telemetry"])
def test_a_stop_does_not_wait_for_a_body_that_never_ends(server, path):
    with half_a_request(server, path, "Transfer-Encoding: chunked", b"3\r\n[{}\r\n") as raw:
        assert_stops(server)
        rest = b",{}" * 5000  # no JSON without its end
        raw.sendall(b"%x\r\n%s\r\n0\r\n\r\n" % (len(rest), rest))
        assert status(raw) == (413 if path == "/login" else 422)


TWO_LENGTHS = "Content-Length: 12\r\nTransfer-Encoding: chunked"
HIDDEN = b"POST /api/v1/sessions HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 15\r\n\r\n" + b'{"name":"mine"}'


@pytest.mark.parametrize("headers", [TWO_LENGTHS, "\r\n".join(reversed(TWO_LENGTHS.split("\r\n")))])
@pytest.mark.parametrize(("path", "code"), [(NOTES, 400), ("/stop", 200), ("/nothing", 400)])
def test_of_a_body_with_two_lengths_nothing_that_follows_is_believed(server, client, headers, path, code):
    before = {one["id"] for one in client.get("/sessions").json()["sessions"]}
    with half_a_request(server, path, headers, b"0\r\n\r\n" + HIDDEN) as raw:
        found = b"".join(iter(partial(raw.recv, 1 << 16), b""))  # until it hangs up
    assert [int(one) for one in re.findall(rb"HTTP/1\.1 (\d+)", found)] == [code]
    assert {one["id"] for one in client.get("/sessions").json()["sessions"]} == before
    if code == 200:
        assert client.post("/stop/clear").json()["stopped"] is False
    else:
        assert b"in two ways" in found


def test_http_of_an_age_without_transfer_encodings_has_none(server):
    host = server.url.removeprefix("http://")
    name, port = host.split(":")
    with socket.create_connection((name, int(port)), timeout=BOUND) as raw:
        head = f"POST {BASE}{NOTES} HTTP/1.0\r\nHost: {host}\r\nTransfer-Encoding: chunked\r\n\r\n"
        raw.sendall(head.encode() + b"0\r\n\r\n")
        assert status(raw) == 400


def test_a_stop_does_not_wait_for_json_that_is_being_read(server, client, monkeypatch):
    reading, go_on = threading.Event(), threading.Event()
    order = []

    def slow(text, most):
        reading.set()
        assert go_on.wait(BOUND)
        return json.loads(text)

    def attack():
        body = json.dumps({"text": "x" * 2000, "more": "y" * json_bodies.AT_ONCE})
        answer = client.post(NOTES, content=body, headers=JSON)
        order.append(answer.status_code)

    monkeypatch.setattr(json_bodies, "read_json", slow)
    attacking = threading.Thread(target=attack)
    attacking.start()
    assert reading.wait(BOUND)
    assert_stops(server)
    order.append("stopped")
    go_on.set()
    attacking.join(BOUND)
    assert order == ["stopped", 422]


def test_telemetry_is_read_one_request_after_the_other_and_a_stop_does_not_wait_for_it(server, client, monkeypatch):
    reading, go_on, at_once = [], threading.Event(), []

    def slow(content, most=0):
        reading.append(content)
        at_once.append(len(reading))
        assert go_on.wait(BOUND)
        reading.remove(content)
        raise InvalidTelemetry("read", fault="not-json")

    monkeypatch.setattr(ingest, "parse_object", slow)
    with contextlib.ExitStack() as open_:
        asked = [
            open_.enter_context(half_a_request(server, "/rover/telemetry", "Content-Length: 1", b"%d" % number))
            for number in range(3)
        ]
        until(lambda: reading, "the first")
        assert_stops(server)
        go_on.set()
        assert [status(raw) for raw in asked] == [422] * 3
    assert at_once == [1] * 3


@pytest.mark.parametrize("path", ["/rover/telemetry", "/rover/images?protocol=2"])
def test_more_parts_than_a_rover_needs_are_refused_before_they_are_read(client, path):
    if "images" in path:
        body = b"[" + b"1," * MESSAGE_PARTS + b"1]"
        content, most = len(body).to_bytes(4, "big") + body, MESSAGE_PARTS
    else:
        content, most = b"[" + b"1," * TELEMETRY_PARTS + b"1]", TELEMETRY_PARTS
    told = problem(client.post(path, content=content, headers=JSON), 422, "invalid-telemetry")
    assert f"more than {most} members" in told["detail"]


@pytest.mark.parametrize(
    ("path", "body", "what"),
    [
        ("/login", b'{"name": "a", "name": "b", "password": "c"}', "'name' is given twice"),
        ("/login", b"[" * LOGIN_BYTES, f"more than {JSON_PARTS} members"),
        (NOTES, b"[" * 1500, f"more than {MOST_DEEP} deep"),
        (NOTES, b'{"text":' * 1000 + b"1" + b"}" * 1000, f"more than {MOST_DEEP} deep"),
        ("/sessions/current/terrains", b"[" * (MOST_DEEP + 1) + b"]" * (MOST_DEEP + 1), f"more than {MOST_DEEP} deep"),
    ],
)
def test_what_fits_and_is_not_strict_is_told_so(client, path, body, what):
    assert what in problem(client.post(path, content=body, headers=JSON), 422, "validation")["detail"]


def test_of_very_many_errors_some_are_listed_and_all_are_counted(client):
    body = json.dumps({f"n{i}": 0 for i in range(JSON_PARTS)})
    told = problem(client.post(NOTES, content=body, headers=JSON), 422, "validation")
    assert len(told["errors"]) == MOST_ERRORS
    assert f"(and {JSON_PARTS} more)" in told["detail"]  # text is missing as well
    assert all(len(str(one["got"])) <= 200 for one in told["errors"])
    body = json.dumps({f"n{i}": 0 for i in range(JSON_PARTS + 1)})
    told = problem(client.post(NOTES, content=body, headers=JSON), 422, "validation")
    assert f"more than {JSON_PARTS} members" in told["detail"]


@pytest.mark.parametrize(
    ("path", "size"),
    [("/stop/line", 60 << 20), ("/sessions/current/events/line", LINE_BYTES + 1), ("/rover", FRAME_BYTES + 1)],
)
def test_a_message_too_large_for_its_line_ends_it(server, path, size):
    spoken = [Subprotocol("footfall-rover-2")] if path == "/rover" else None
    address = f"ws{server.api.removeprefix('http')}{path}"
    with connect(address, subprotocols=spoken, proxy=None, max_size=None) as line:
        with contextlib.suppress(ConnectionClosed):
            line.send(bytes(size))
        with pytest.raises(ConnectionClosed) as closed:
            deque(iter(partial(line.recv, timeout=60), None), 0)
    # a connection that was reset while it was being sent to says no code
    assert closed.value.rcvd is None or closed.value.rcvd.code == TOO_BIG
    assert_stops(server)


def test_files_are_taken_where_the_interface_says_so_and_nowhere_else(client):
    document = client.get("/openapi.json").json()
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            content = operation.get("requestBody", {}).get("content", {})
            plain = re.sub(r"\{.*?\}", "x", path)
            has_files = any(not media.endswith("json") for media in content) and "/rover/" not in path
            assert takes_files(plain) == has_files or method not in ("post", "put"), path
            assert body_limit(plain, 1 << 30) == 1 << 30 or not has_files


def test_a_body_that_trickles_is_given_up():
    now = [0.0]
    answers: list[Message] = []

    async def app(scope, receive, send):
        while (await receive())["more_body"]:
            pass

    async def receive() -> Message:
        now[0] += PATIENCE / 3
        return {"type": "http.request", "body": b"x" * 100, "more_body": True}

    async def send(message: Message) -> None:
        answers.append(message)

    headers = [(b"host", b"localhost")]
    scope = {"type": "http", "method": "POST", "path": f"{BASE}/x", "headers": headers, "scheme": "http"}
    asyncio.run(Guard(app, 1 << 20, LOOPBACK, lambda: now[0])(scope, receive, send))
    assert answers[0]["status"] == 408
    assert now[0] == pytest.approx(PATIENCE * 4 / 3)
    assert PATIENCE * SLOWEST > 400


@pytest.mark.parametrize("header", ["X-Forwarded-For", "X-Forwarded-Host", "X-Real-IP", "Via", "CF-Connecting-IP"])
def test_where_nobody_logs_in_what_a_proxy_passed_on_is_refused(server, header):
    """Behind a proxy that nobody announced, everybody would seem to sit at this machine."""
    for method, path in (("GET", "/info"), ("POST", "/sessions/current/notes"), ("POST", "/sequences")):
        answer = httpx.request(
            method, server.api + path, headers={header: "for=10.0.0.1"}, trust_env=False, verify=False
        )
        assert (answer.status_code, answer.json()["type"]) == (403, "/problems/forwarded")


@pytest.mark.parametrize("method", ["GET", "POST", "DELETE"])
@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/js/",
        *(f"{BASE}/{one}/" for one in ("sessions", "samples", "recordings", "jobs", "sessions/current/recordings")),
        *(f"{BASE}/sessions/current/{one}/" for one in ("terrains", "maps", "images", "products", "sequences")),
    ],
)
def test_a_nul_in_an_address_is_nobodys_name(server, method, path):
    for name in ("%00", "a%00b", "%00.npz", "a.zip%00", "..%00/x"):
        answer = httpx.request(method, f"{server.url}{path}{name}", trust_env=False, verify=False)
        assert 400 <= answer.status_code < 500, (path + name, answer.text)
