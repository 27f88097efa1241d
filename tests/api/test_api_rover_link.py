"""The rover's WebSocket: bad messages are named and counted, the connection stays."""

import json

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.io.robot_files import load_robot
from footfall.planning.stance.stand import stand
from footfall.telemetry.link import HelloMessage, encode
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.server import until


@pytest.fixture
def link(server):
    url = "ws" + server.api.removeprefix("http") + "/rover"
    with connect(url, subprotocols=[Subprotocol("footfall-rover-1")], proxy=None) as socket:
        yield socket


def fault(link) -> str:
    """What the server says was wrong; other messages may come before it."""
    while (message := json.loads(link.recv(timeout=10)))["type"] != "error":
        pass
    return message["text"]


def test_bad_frames_are_answered_and_counted(server, client, link, athlete):
    before = client.get("/info").json()["rover_link"]["bad_frames"]
    link.send('{"type": "stop_ack", "id": "1", "time": 1.0}')
    assert "hello" in fault(link)
    link.send("this is no JSON")
    assert "JSON" in fault(link)
    link.send(encode(HelloMessage("spider", 8)))
    assert "athlete" in fault(link)
    link.send(encode(HelloMessage("athlete", 6)))
    link.send('{"type": "telemetry", "number": 1}')
    assert "posture" in fault(link)
    link.send(b"\0\0")
    assert "header" in fault(link)
    after = client.get("/info").json()["rover_link"]
    assert after["linked"] is True
    assert after["bad_frames"] == before + 5

    frame = TelemetryFrame(7, state := stand(athlete, plane()), state.posture)
    link.send(encode(frame))
    until(lambda: client.get("/sessions/current/telemetry").status_code == 200, "the telemetry")
    telemetry = client.get("/sessions/current/telemetry").json()
    assert telemetry["number"] == 7
    assert telemetry["posture"] == state.posture.tolist()
    assert client.post("/stop").json()["stop_acknowledged"] is False
    while (message := json.loads(link.recv(timeout=10)))["type"] != "stop":
        pass
    link.send(json.dumps({"type": "stop_ack", "id": message["id"], "time": 1.0}))
    until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
    assert client.post("/stop/clear").json()["stopped"] is False


def test_the_link_is_free_again_after_a_rover_left(server, client, link):
    link.send(encode(HelloMessage(load_robot("athlete").name, 6)))
    until(lambda: client.get("/sessions/current").json()["link"]["connected"], "the connection")
    link.close()
    until(lambda: not client.get("/sessions/current").json()["link"]["connected"], "its end")
    assert client.get("/info").json()["rover_link"]["linked"] is False
