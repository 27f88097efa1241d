"""A rover at the distance of a few hundred milliseconds, on the link of a real server; and what it says last."""

import json

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.io.recordings.reading import Recording
from footfall.session.rover.light_time import LightTime
from footfall.telemetry.link import AckMessage, HelloMessage, StopAckMessage, encode
from tests.support.frames import digests, moving_frames
from tests.support.waiting import BOUND, at_least, until

UP, DOWN = 1.5, 2.0


def linked(plain):
    url = "ws" + plain.api.removeprefix("http") + "/rover"
    return connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None)


def stops_on_the_way(ground) -> list[dict]:
    """The epoch is told again and again as well: nobody here confirms it."""
    return [one for one in ground.get("/sessions/current").json()["link"]["on_the_way"] if one["type"] == "stop"]


def test_the_operator_knows_late_and_is_told_so(plain, ground):
    plain.sessions.create("far")
    answer = ground.patch("/rover/light-time", json={"telemetry_s": UP, "commands_s": DOWN})
    assert answer.json() == ground.get("/rover/light-time").json()
    assert answer.json()["round_trip_s"] == pytest.approx(UP + DOWN)
    try:
        with linked(plain) as rover:
            rover.send(encode(HelloMessage("athlete", 6)))
            until(lambda: ground.get("/sessions/current").json()["link"]["connected"], "the link")
            rover.send(encode(moving_frames(1)[0]))
            with at_least(UP):
                assert ground.get("/sessions/current/telemetry").status_code == 404
                until(lambda: ground.get("/sessions/current/telemetry").status_code == 200, "the telemetry")
            body = ground.get("/sessions/current/telemetry").json()
            assert body["measured_age_s"] == pytest.approx(body["age_s"] + UP)

            with at_least(UP + DOWN):
                with at_least(DOWN):
                    ground.post("/stop")
                    (way,) = stops_on_the_way(ground)
                    assert 0 < way["arrives_in_s"] <= DOWN
                    assert way["answer_in_s"] == pytest.approx(way["arrives_in_s"] + UP)
                    while (message := json.loads(rover.recv(timeout=BOUND)))["type"] != "stop":
                        pass
                rover.send(encode(StopAckMessage(message["id"], 5.0)))
                until(lambda: ground.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
            assert stops_on_the_way(ground) == []
    finally:
        plain.sessions.set_light_time(LightTime())


@pytest.mark.parametrize(
    ("delays", "says"),
    [
        ({"telemetry_s": -1}, "greater than or equal to 0"),
        ({"commands_s": 1e9}, "less than or equal to 1500"),
        ({"telemetry_s": True}, "valid number"),
        ({"moon": 1.28}, "moon"),
    ],
)
def test_impossible_delays_are_refused(plain, ground, delays, says):
    answer = ground.patch("/rover/light-time", json=delays)
    assert answer.status_code == 422
    assert says in answer.json()["detail"]
    assert ground.get("/rover/light-time").json()["round_trip_s"] == 0


def test_what_a_rover_said_before_it_left_is_heard_and_recorded_with_its_times(plain, ground, tmp_path):
    live = plain.sessions.create("left at once")
    live.commands.clear_stop()  # of the test before
    frames = moving_frames(200)
    with linked(plain) as rover:
        rover.send(encode(HelloMessage("athlete", 6)))
        for frame in frames:
            rover.send(encode(frame))
        rover.send(encode(AckMessage("c1", "refused", "no", 1234.5)))
    plain.until_rover_left()
    assert live.rover.link.frames == len(frames)
    assert live.rover.link.gaps == 0
    live.close()
    (path,) = live.rover.recorder.paths()
    recording = Recording(path)
    assert digests(recording.frames()) == digests(frames)
    bodies = [one.content for one in recording.said() if isinstance(one.content, dict)]
    acks = [one for one in bodies if one["type"] == "ack"]
    assert acks == [{"type": "ack", "id": "c1", "state": "refused", "reason": "no", "time": 1234.5}]
