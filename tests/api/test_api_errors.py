"""Every error is a problem document; foreign pages and hosts are refused; limits hold."""

import json
import socket

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.support.problems import problem


def test_unknown_paths_methods_and_ids(client):
    problem(client.get("/nothing-here"), 404, "not-found")
    problem(client.delete("/robot"), 405, "method-not-allowed")
    problem(client.get("/sessions/none-such"), 404, "not-found")
    problem(client.get("/jobs/none-such"), 404, "not-found")
    problem(client.get("/sequences/none-such"), 404, "not-found")
    problem(client.get("/sessions/current/plans/current"), 404, "not-found")
    problem(client.get("/sessions/current/images/a/left.png"), 404, "not-found")


@pytest.mark.parametrize(
    ("body", "where"),
    [
        ({"leg": True, "target": [1, 2]}, "body.leg"),
        ({"leg": 2, "target": [1]}, "body.target"),
        ({"leg": 2, "target": [1, False]}, "body.target.1"),
        ({"leg": "2", "target": [1, 2]}, "body.leg"),
        ({"leg": 2, "target": [1, 2], "tagret": 3}, "body.tagret"),
        ({"leg": 2, "target": [1, 2], "settings": {"seed": 1.5}}, "body.settings.seed"),
        ({"leg": 2, "target": [1, 2], "settings": {"colour": 1}}, "body.settings.colour"),
        ({}, "body.leg"),
    ],
)
def test_malformed_bodies_are_named(client, body, where):
    document = problem(client.post("/sessions/current/plans", json=body), 422, "validation")
    assert where in [one["where"] for one in document["errors"]]


def test_numbers_that_json_does_not_have_are_refused(client):
    for number in ("NaN", "Infinity", "1e999"):
        body = f'{{"leg": 2, "x": {number}, "y": 0}}'
        answer = client.post("/sessions/current/footfalls", content=body, headers={"content-type": "application/json"})
        problem(answer, 422, "validation")


def test_body_that_is_no_json(client):
    headers = {"content-type": "application/json"}
    problem(client.post("/sessions/current/footfalls", content=b"{", headers=headers), 422, "validation")
    plain = client.post("/sessions/current/footfalls", content=b"{}", headers={"content-type": "text/plain"})
    problem(plain, 415, "wrong-media")


def test_settings_that_make_no_sense_say_what_would(client):
    body = {"leg": 2, "target": [1, 2], "settings": {"planner": "magic"}}
    document = problem(client.post("/sessions/current/plans", json=body), 422, "invalid-input")
    assert "auto" in document["detail"]
    assert document["planner"] == "magic"


def test_unknown_leg(client):
    document = problem(client.post("/sessions/current/maps", json={"leg": 6}), 422, "invalid-input")
    assert "0" in document["detail"]
    assert "5" in document["detail"]


@pytest.mark.parametrize("origin", ["https://example.org", "null", "http://127.0.0.1:1", "http://localhost"])
def test_foreign_pages_are_refused(client, origin):
    problem(client.post("/stop", headers={"origin": origin}), 403, "foreign-origin")
    problem(client.get("/robot", headers={"origin": origin}), 403, "foreign-origin")


def test_own_page_is_served(server, client):
    assert client.get("/robot", headers={"origin": server.url}).status_code == 200


@pytest.mark.parametrize("host", ["example.org", "127.0.0.1.example.org:80", "10.0.0.1", "", "[::2]", "[::1"])
def test_foreign_host_names_are_refused(client, host):
    # DNS rebinding: the name is the attacker's, the address is ours
    problem(client.get("/robot", headers={"host": host}), 403, "foreign-host")


def test_other_names_of_this_computer_are_served(server, client):
    port = server.url.rsplit(":", 1)[1]
    assert client.get("/robot", headers={"host": f"localhost:{port}"}).status_code == 200


def test_pages_may_not_be_framed_by_others(server):
    for path in ("/api/v1/robot", "/scene/", "/"):
        headers = httpx.get(server.url + path, trust_env=False, verify=False).headers
        assert headers["x-frame-options"] == "SAMEORIGIN"
        assert "frame-ancestors '" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("origin", ["https://example.org", "null", "http://127.0.0.1:1"])
def test_every_websocket_is_closed_to_foreign_pages(server, origin):
    assert len(server.websockets) >= 5
    for url in server.websockets:
        with pytest.raises(InvalidStatus) as caught:
            connect(url, origin=Origin(origin), subprotocols=[Subprotocol("footfall-rover-2")], proxy=None)
        assert caught.value.response.status_code == 403, url


def test_a_websocket_for_another_host_name_is_refused(server):
    port = server.url.rsplit(":", 1)[1]
    for url in server.websockets:
        with socket.create_connection(("127.0.0.1", int(port))) as line, pytest.raises(InvalidStatus) as caught:
            connect(url.replace("127.0.0.1", "example.org"), sock=line, proxy=None)
        assert caught.value.response.status_code == 403, url


def test_a_method_that_an_address_does_not_take_is_told_those_that_it_does(client):
    for method, path, allowed in (
        ("DELETE", "/robot", "GET"),
        ("PUT", "/stop", "GET, POST"),
        ("PUT", "/stop/clear", "POST"),
    ):
        answer = client.request(method, path)
        problem(answer, 405, "method-not-allowed")
        assert answer.headers["allow"] == allowed


def test_too_large_requests_are_refused_unread(server):
    host, port = server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=10) as raw:
        head = f"POST /api/v1/recordings HTTP/1.1\r\nHost: {host}:{port}\r\nConnection: close\r\n"
        raw.sendall((head + f"Content-Length: {1 << 40}\r\n\r\n").encode())
        answer = b"".join(iter(lambda: raw.recv(65536), b"")).decode()
    assert answer.startswith("HTTP/1.1 413")
    assert json.loads(answer.split("\r\n\r\n", 1)[1])["limit"] == 64 * 2**20


def test_too_large_streamed_request_is_refused(server):
    def parts():
        for _ in range(70):
            yield bytes(2**20)

    asked = [
        ("/recordings", {"content-type": "application/zip"}),
        ("/recordings", {"content-type": "application/zip", "idempotency-key": "large"}),
        ("/sessions", {"content-type": "application/json"}),
    ]
    for path, headers in asked:
        try:
            answer = httpx.post(server.api + path, content=parts(), headers=headers)
        except httpx.WriteError:
            continue  # the server hung up while we were still sending
        problem(answer, 413, "too-large")


def said_by(server, request, wait):
    """What a server answers to these bytes, and whether it closed the connection, within ``wait`` [s]."""
    host, port = server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=wait) as line:
        line.sendall(request.replace(b"HOST", f"Host: {host}:{port}".encode()))
        answer = b""
        try:
            while part := line.recv(65536):
                answer += part
        except TimeoutError:
            return answer, False
        except ConnectionResetError:
            pass
        return answer, True


def test_a_body_that_never_comes_is_given_up(server, monkeypatch):
    monkeypatch.setattr("footfall.api.door.guard.PATIENCE", 0.3)
    for key in (b"", b"Idempotency-Key: half\r\n"):
        head = b"POST /api/v1/sessions/current/notes HTTP/1.1\r\nHOST\r\nContent-Type: application/json\r\n" + key
        answer, _ = said_by(server, head + b'Content-Length: 1000\r\nConnection: close\r\n\r\n{"text": ', 20)
        assert answer.startswith(b"HTTP/1.1 408 ")
        assert b'"/problems/too-slow"' in answer


def test_a_connection_on_which_no_request_comes_is_closed(server, monkeypatch):
    monkeypatch.setattr("footfall_ui.app.HEAD_WITHIN", 0.2)
    whole = b"GET /api/v1/robot HTTP/1.1\r\nHOST\r\n\r\n"
    for said in (b"", b"GET /api/v1/robot HTTP/1.1\r\nHOST\r\nX-Slow: ", whole + whole[:20]):
        answer, closed = said_by(server, said, 20)
        assert closed
        assert answer.startswith(b"HTTP/1.1 200 " if said.startswith(whole) else b"")


def test_the_openapi_document_has_examples(client):
    document = client.get("/openapi.json").json()
    bodies = 0
    for path, methods in document["paths"].items():
        assert path.startswith(("/api/v1/", "/health/", "/metrics"))
        for method, operation in methods.items():
            assert operation["summary"]
            # of files the description says which
            content = operation.get("requestBody", {}).get("content", {}).get("application/json")
            if content is None:
                continue
            bodies += 1
            schema = content["schema"]
            if "anyOf" in schema:
                schema = schema["anyOf"][0]
            if "$ref" in schema:
                schema = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
            shown = content.get("example") or schema.get("examples")
            shown = shown or any("examples" in one for one in schema.get("properties", {}).values())
            assert shown or path.endswith("/telemetry"), (path, method)
    assert bodies >= 12
