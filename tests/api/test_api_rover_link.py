"""The rover's WebSocket: bad messages are named and counted, the connection stays."""

import json

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.io.robot_files import load_robot
from footfall.planning.body.stand import stand
from footfall.telemetry.link import EpochMessage, HelloMessage, encode
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.waiting import BOUND, until


@pytest.fixture
def link(server, client):
    server.until_rover_left()
    url = "ws" + server.api.removeprefix("http") + "/rover"
    with connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None) as socket:
        yield socket


def fault(link) -> str:
    """What the server says was wrong; other messages may come before it."""
    while (message := json.loads(link.recv(timeout=BOUND)))["type"] != "error":
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
    while (message := json.loads(link.recv(timeout=BOUND)))["type"] != "stop":
        pass
    link.send(json.dumps({"type": "stop_ack", "id": message["id"], "time": 1.0}))
    until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
    assert client.post("/stop/clear").json()["stopped"] is False


def hears(link, kind: str) -> dict:
    while (message := json.loads(link.recv(timeout=BOUND)))["type"] != kind:
        pass
    return message


def test_an_epoch_that_another_session_told_is_outdone(server, client, link):
    """Also when the rover learns of it only after its hello; a command is never older than what a rover has heard."""
    link.send(encode(HelloMessage("athlete", 6, id="first", epoch=7)))
    told = hears(link, "epoch")
    assert told["id"] == "first"
    assert told["epoch"] > 7
    live = server.sessions.current
    until(lambda: live.state.epoch == told["epoch"], "the log")
    later = told["epoch"] + 1000
    link.send(encode(EpochMessage("command 1", later)))
    assert hears(link, "epoch") == {"type": "epoch", "id": "first", "epoch": later + 1}
    until(lambda: live.state.epoch == later + 1, "the new epoch in the log")
    # not confirmed: it is told again, and then no more
    assert hears(link, "epoch")["epoch"] == later + 1
    link.send(encode(EpochMessage("first", later + 1)))
    client.post("/stop")
    stop = hears(link, "stop")
    assert stop["epoch"] == later + 2
    link.send(json.dumps({"type": "stop_ack", "id": stop["id"], "time": 1.0}))
    until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
    assert client.post("/stop/clear").json()["stopped"] is False
    assert hears(link, "clear_stop")["epoch"] == later + 2
    # another session, whose log knows nothing of this one, goes on from there over the same connection
    client.post("/sessions", json={"name": "another"}).raise_for_status()
    until(
        lambda: server.sessions.current is not live and server.sessions.current.rover.link.connected,
        "the other session",
    )
    until(lambda: server.sessions.current.rover.epoch > later + 2, "a newer epoch")


def test_a_rover_that_starts_anew_behind_a_gateway_that_keeps_the_line_is_another(server, client, link):
    """It may stand otherwise, knows of no command and no epoch, and waits for what answers its hello."""
    live = server.sessions.current
    link.send(encode(HelloMessage("athlete", 6, id="before")))
    before = hears(link, "epoch")
    link.send(encode(EpochMessage("before", before["epoch"])))
    until(lambda: live.commands.gate["epoch_known"], "the confirmed epoch")
    since = len(live.events())
    link.send(encode(HelloMessage("athlete", 6, id="after")))
    told = hears(link, "epoch")
    assert (told["id"], told["epoch"] > before["epoch"]) == ("after", True)
    assert not live.commands.gate["epoch_known"]
    until(lambda: "link_connected" in [event.type for event in live.events(since)], "the link in the log")
    assert [event.type for event in live.events(since)] == ["link_lost", "link_connected"]
    # said twice it is the same
    link.send(encode(HelloMessage("athlete", 6, id="after")))
    link.send(encode(EpochMessage("after", told["epoch"])))
    until(lambda: live.commands.gate["epoch_known"], "the confirmed epoch")
    assert live.rover.epoch == told["epoch"]
    assert len(live.events(since)) == 2


def test_the_link_is_free_again_after_a_rover_left(server, client, link):
    link.send(encode(HelloMessage(load_robot("athlete").name, 6)))
    until(lambda: client.get("/sessions/current").json()["link"]["connected"], "the connection")
    link.close()
    until(lambda: not client.get("/sessions/current").json()["link"]["connected"], "its end")
    server.until_rover_left()
