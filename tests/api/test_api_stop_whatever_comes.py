"""A stop stops, whatever comes with it: bytes, too much, nothing at all; lines take what is for them, and no more."""

import contextlib
import json
import socket

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from footfall.api import streams
from footfall.api.auth.who import PAGE_HEADER
from footfall.api.door.limits import LINE_BYTES, MAX_LINE_MESSAGE, TOO_BIG
from footfall_ui.sized_lines import MOST_PIECES
from tests.support.problems import problem
from tests.support.waiting import BOUND, until

JSON = {"content-type": "application/json"}


@pytest.fixture(autouse=True)
def clear(client):
    """No stop is in force before, and none after; the reason tells which it was."""
    assert client.get("/stop").json()["stopped"] is False
    yield
    assert client.post("/stop/clear").json()["stopped"] is False


def why(client):
    return client.get("/sessions/current").json()["stop"]["reason"]


def stopped(client):
    return client.get("/stop").json()["stopped"]


def lines(server, path):
    return connect(f"ws{server.api.removeprefix('http')}{path}", proxy=None, max_size=None)


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (b'{"reason": "by bytes"}', "by bytes"),
        ('{"reason": "by text"}', "by text"),
        (b"\x00\xff\xfe", ""),
        (b"", ""),
        ("", ""),
        ('{"reason": 7}', ""),
        ('{"reason": "\\ud800"}', ""),
        ("[" * MAX_LINE_MESSAGE, ""),
    ],
)
def test_every_message_on_the_line_stops(server, client, message, reason):
    with lines(server, "/stop/line") as line:
        line.send(message)
        assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
        assert why(client) == reason
        line.send("{}")  # the line is still there
        assert json.loads(line.recv(timeout=BOUND))["stopped"] is True


@pytest.mark.parametrize("message", ["x" * (MAX_LINE_MESSAGE + 1), bytes(MAX_LINE_MESSAGE + 1), bytes(LINE_BYTES)])
def test_a_message_that_is_too_large_stops_and_ends_the_line(server, client, message):
    with lines(server, "/stop/line") as line:
        line.send(message)
        assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
        with pytest.raises(ConnectionClosed) as closed:
            line.recv(timeout=BOUND)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == TOO_BIG
    assert str(MAX_LINE_MESSAGE) in closed.value.rcvd.reason


@pytest.mark.parametrize("size", [LINE_BYTES + 1, 60 << 20])
def test_a_message_that_is_too_large_to_be_read_at_all_stops(server, client, size):
    with lines(server, "/stop/line") as line, contextlib.suppress(ConnectionClosed):
        line.send(bytes(size))
        line.recv(timeout=BOUND)
    until(lambda: stopped(client), "the stop")


def test_a_stop_counts_also_where_what_follows_it_can_not_be_read(server, client):
    with lines(server, "/stop/line") as line:
        # a text, and a frame that no protocol knows, in one packet; clients mask what they send
        line.socket.sendall(b"\x81\x82\0\0\0\0{}" + b"\xff\x80\0\0\0\0")
        until(lambda: stopped(client), "the stop")


def test_a_message_of_endless_empty_pieces_ends_the_line(server, client):
    with lines(server, "/stop/line") as line:
        begin, piece = b"\x01\x80\0\0\0\0", b"\x00\x80\0\0\0\0"
        line.socket.sendall(begin + piece * MOST_PIECES)
        with pytest.raises(ConnectionClosed) as closed:
            line.recv(timeout=BOUND)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == TOO_BIG
    until(lambda: stopped(client), "the stop")


@pytest.mark.parametrize(
    ("content", "headers", "reason"),
    [
        (b'{"reason": "wheel 3 is sinking"}', JSON, "wheel 3 is sinking"),
        (b'{"reason": "\\ud800"}', JSON, ""),
        (b"\x1f\x8b", {**JSON, "content-encoding": "gzip"}, ""),
        (b"\xff" * (MAX_LINE_MESSAGE + 1), JSON, ""),
        (b"", {"x-large": "a" * 40_000}, ""),
    ],
)
def test_every_request_stops(client, content, headers, reason):
    answer = client.post("/stop", content=content, headers=headers)
    assert answer.json()["stopped"] is True
    assert why(client) == reason


def test_a_request_beyond_every_limit_stops(server, client):
    with contextlib.suppress(httpx.TransportError):  # it hangs up before all is sent
        httpx.post(f"{server.api}/stop", content=bytes((64 << 20) + 1), headers=JSON, trust_env=False, verify=False)
    until(lambda: stopped(client), "the stop")


def test_a_request_whose_body_never_comes_stops(server, client):
    host, port = server.url.removeprefix("http://").split(":")
    head = f"POST /api/v1/stop HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Length: 1000000000\r\n\r\n"
    with socket.create_connection((host, int(port)), timeout=BOUND) as raw:
        raw.sendall(head.encode() + b'{"reason": "')
        until(lambda: stopped(client), "the stop")
        assert raw.recv(100).startswith(b"HTTP/1.1 200")


def test_a_line_of_events_takes_small_messages_alone(server, client):
    client.post("/stop")
    for message in ("x" * (MAX_LINE_MESSAGE + 1), bytes(MAX_LINE_MESSAGE + 1)):
        with lines(server, "/sessions/current/events/line") as line:
            line.send(message)
            with pytest.raises(ConnectionClosed) as closed:
                list(line)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == TOO_BIG


def test_one_address_does_not_take_all_places(server, client, monkeypatch):
    client.post("/stop")
    monkeypatch.setattr(streams, "MOST_OF_ONE", 1)
    open_ = server.app.state.streams
    until(lambda: not open_.listeners(), "the end of earlier ones")
    with lines(server, "/sessions/current/events/line"):
        until(lambda: len(open_.listeners()) == 1, "the first")
        told = problem(client.get("/sessions/current/events"), 503, "busy")
        assert (told["limit"], told["detail"].split(" listen")[0]) == (1, "1 pages or programs of 127.0.0.1")
        open_.require_room("192.0.2.7", False)  # another one's share
        assert client.post("/stop").json()["stopped"] is True


def test_as_many_listen_as_may_and_the_next_is_told_so(server, client, monkeypatch):
    client.post("/stop")
    monkeypatch.setattr(streams, "MOST_LISTENERS", 2)
    open_ = server.app.state.streams
    until(lambda: not open_.listeners(), "the end of earlier ones")
    with lines(server, "/sessions/current/events/line") as first, lines(server, "/sessions/current/events/line"):
        until(lambda: len(open_.listeners()) == 2, "both of them")
        answer = client.get("/sessions/current/events")
        assert problem(answer, 503, "busy")["limit"] == 2
        assert answer.headers["retry-after"] == "10"
        with lines(server, "/sessions/current/events/line") as third, pytest.raises(ConnectionClosed) as closed:
            third.recv(timeout=BOUND)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1013
        assert "2 pages or programs listen already" in closed.value.rcvd.reason
        # stops are no listeners
        with lines(server, "/stop/line") as line:
            line.send("{}")
            assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
        # nor is who holds the conn kept out: there is a place for it, which it takes over from itself
        page = "the-holder"
        client.post("/sessions/current/conn/take", headers={PAGE_HEADER: page}).raise_for_status()
        with lines(server, f"/sessions/current/events/line?page={page}") as holder:
            assert json.loads(holder.recv(timeout=BOUND))["type"] == "link"
            assert problem(client.get("/sessions/current/events"), 503, "busy")
            with lines(server, f"/sessions/current/events/line?page={page}") as again:
                assert json.loads(again.recv(timeout=BOUND))["type"] == "link"
                list(holder)  # until its end
        client.post("/sessions/current/conn/release", headers={PAGE_HEADER: page}).raise_for_status()
        until(lambda: len(open_.listeners()) == 2, "the end of the holder's")
        first.close()
        until(lambda: len(open_.listeners()) == 1, "room")
        with lines(server, "/sessions/current/events/line") as again:
            assert json.loads(again.recv(timeout=BOUND))["type"] == "link"
