"""Whatever a rover says wrongly is refused by name, answered, counted by its kind and shown; the link stays."""

import contextlib
import json
import time
from collections import Counter
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.api.routes import rover as link_end
from footfall.core.frames import transform
from footfall.io.link_images import encode_images
from footfall.telemetry.fields import FAULTS
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.link import (
    MAX_BINARY_FRAME,
    MAX_TEXT_FRAME,
    EpochMessage,
    HelloMessage,
    StopAckMessage,
    decode,
    encode,
    message_object,
)
from tests.support.frames import moving_frames
from tests.support.server import Running
from tests.support.waiting import BOUND, until

GOOD: dict[str, Any] = message_object(moving_frames(1)[0])
HELLO = {"protocol": 2, "robot": "athlete", "legs": 6, "software": "1"}
GREETING = {"type": "hello", **HELLO, "id": "h", "epoch": None}
OLDER = {"type": "hello", **HELLO, "protocol": 1}


@contextlib.contextmanager
def linked(plain, hello):
    url = "ws" + plain.api.removeprefix("http") + "/rover"
    with connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None, max_size=None) as socket:
        socket.send(encode(hello))
        yield socket


@pytest.fixture
def rover(plain, ground):
    with linked(plain, HelloMessage("athlete", 6)) as socket:
        until(lambda: ground.get("/sessions/current").json()["link"]["connected"], "the link")
        yield socket
    plain.until_rover_left()


def told(rover) -> str:
    while (message := json.loads(rover.recv(timeout=BOUND)))["type"] != "error":
        pass
    return message["text"]


def counts(ground: httpx.Client) -> tuple[Counter, Counter]:
    """Of the door and of the session."""
    door = ground.get("/info").json()["rover_link"]["faults_by_kind"]
    return Counter(door), Counter(ground.get("/sessions/current").json()["link"]["faults_by_kind"])


def session_counts(ground: httpx.Client, before: Counter, kind: str, more: int = 1) -> None:
    """It counts these and no others; only after the rover has been told of the last."""
    until(lambda: counts(ground)[1] - before == Counter({kind: more}), "the session's count")


CASES = [
    ({**GOOD, "posture": GOOD["posture"][:30]}, "wrong-legs", "the rover has 6 legs, not 5"),
    ({**GOOD, "posture": GOOD["posture"][:31]}, "wrong-field", "needs 36 numbers, not 31"),
    ({**GOOD, "time": float("nan")}, "not-finite", "NaN is no number"),
    (json.dumps(GOOD).replace(str(GOOD["time"]), "1e999"), "not-finite", "finite"),
    ({**GOOD, "type": "teleport"}, "unknown-message", "teleport"),
    ({**GOOD, "joint_torques": [True] * 36}, "wrong-field", "must be a number"),
    ({**GOOD, "mass": 1.0}, "wrong-field", "unknown fields mass"),
    (OLDER, "wrong-version", "protocol 1, this end speaks 2"),
    ({**GREETING, "robot": "spider"}, "wrong-robot", "this session is for athlete"),
    ({**GREETING, "epoch": 1 << 53}, "wrong-field", "a whole number"),
    ({**GREETING, "epoch": 1 << 52}, "wrong-field", "no ground can have told it"),
    ({"type": "epoch", "id": "h", "epoch": 1 << 52}, "wrong-field", "no ground can have told it"),
    ({"type": "epoch", "id": "h", "epoch": 1 << 40}, "wrong-field", "no ground can have told it"),
    ({"type": "stop", "id": "x", "epoch": 1}, "not-for-ground", "a rover does not send stop"),
    ('{"type": "telemetry", "type": "ack"}', "not-json", "given twice"),
    ({"type": "error", "id": "", "text": "cold \ud800 cameras"}, "not-json", r"lone surrogate, half a character"),
    ({"type": "error", "id": "", "text": "x", "\udfff": 1}, "not-json", r"half a character: \udfff"),
    ({"type": "image_request", "id": "x", "pairs": ["\ud83d"]}, "not-json", r"\ud83d"),
    ("no json", "not-json", "this is not JSON"),
    ("[" * 50_000, "not-json", "not JSON"),
    ("x" * (MAX_TEXT_FRAME + 1), "too-large", "at most 1048576 bytes"),
    (bytes(MAX_BINARY_FRAME + 1), "too-large", "at most 16777216 bytes"),
]


@pytest.mark.parametrize(("message", "kind", "says"), CASES, ids=[f"{n}-{case[1]}" for n, case in enumerate(CASES)])
def test_each_kind_is_named_answered_and_counted_and_the_link_stays(ground, rover, message, kind, says):
    door, session = counts(ground)
    rover.send(message if isinstance(message, (str, bytes)) else json.dumps(message))
    assert says in told(rover)
    after_door = counts(ground)[0]
    assert after_door - door == Counter({kind: 1})
    session_counts(ground, session, kind)
    rover.send(encode(HelloMessage("athlete", 6)))
    number = 10_000 + sum(after_door.values())
    rover.send(json.dumps({**GOOD, "number": number, "time": 2e9 + number}))
    until(lambda: ground.get("/sessions/current").json()["link"]["connected"], "the link that stayed")
    until(lambda: ground.get("/sessions/current/telemetry").json().get("number") == number, "the next good frame")


def test_time_that_runs_backwards_is_told_and_the_frame_is_kept(ground, rover):
    before = counts(ground)[1]
    number = 50_000
    rover.send(json.dumps({**GOOD, "number": number, "time": 3e9}))
    rover.send(json.dumps({**GOOD, "number": number + 1, "time": 3e9 - 7.5}))
    assert "clock went back by 7.500 s" in told(rover)
    session_counts(ground, before, "time-backwards")
    assert ground.get("/sessions/current/telemetry").json()["number"] == number + 1
    assert "went back" in ground.get("/sessions/current").json()["link"]["fault"]


def test_a_number_that_jumps_is_told_and_counts_as_a_restart(ground, rover):
    link = ground.get("/sessions/current").json()["link"]
    before = counts(ground)[1]
    number = 60_000
    rover.send(json.dumps({**GOOD, "number": number, "time": 4e9}))
    rover.send(json.dumps({**GOOD, "number": 2**53 - 1, "time": 4e9 + 1}))
    assert f"jumped from number {number} to {2**53 - 1}; counted as a restart" in told(rover)
    session_counts(ground, before, "number-jump")
    rover.send(json.dumps({**GOOD, "number": number + 12, "time": 4e9 + 2}))
    until(lambda: ground.get("/sessions/current/telemetry").json()["number"] == number + 12, "the frame after")
    after = ground.get("/sessions/current").json()["link"]
    assert after["restarts"] == link["restarts"] + 2
    assert after["gaps"] - link["gaps"] < 100_000


def test_a_rover_that_heard_of_an_epoch_that_can_not_be_is_linked_and_can_be_stopped(plain, ground):
    """And what it says of it harms no later rover, in this session or the next."""
    plain.until_rover_left()
    before = counts(ground)[0]
    with linked(plain, HelloMessage("athlete", 6, id="garbled", epoch=1 << 52)) as garbled:
        assert "no ground can have told it" in told(garbled)
        assert counts(ground)[0] - before == Counter({"wrong-field": 1})
        assert ground.get("/sessions/current").json()["link"]["connected"]
        assert plain.sessions.current.rover.epoch < 1 << 51
        garbled.send(encode(EpochMessage("garbled", 1 << 52)))  # it keeps the newest that it has heard
        assert "no ground can have told it" in told(garbled)
        ground.post("/stop")
        while (message := json.loads(garbled.recv(timeout=BOUND)))["type"] != "stop":
            pass
        garbled.send(encode(StopAckMessage(message["id"], 5e9)))
        until(lambda: ground.get("/stop").json()["stop_acknowledged"], "its acknowledgement")
        assert ground.post("/stop/clear").json()["stopped"] is False
        following = plain.sessions.create("the next one")
        until(lambda: following.rover.link.connected, "the rover in it")
        assert following.rover.epoch < 1 << 51
    plain.until_rover_left()
    # of a ground whose clock is decades ahead: that may be
    ahead = int(time.time()) + 50 * 31_557_600
    with linked(plain, HelloMessage("athlete", 6, id="far", epoch=ahead)) as far:
        while (message := json.loads(far.recv(timeout=BOUND)))["type"] != "epoch":
            pass
        assert message["epoch"] > ahead
        far.send(encode(EpochMessage("far", message["epoch"])))
        number = 70_000
        far.send(json.dumps({**GOOD, "number": number, "time": 6e9}))
        until(lambda: ground.get("/sessions/current/telemetry").json().get("number") == number, "its telemetry")
    plain.until_rover_left()
    assert following.rover.link.faults == 0


def test_another_version_of_the_subprotocol_is_turned_away_and_counted(plain, ground):
    door, session = counts(ground)
    url = "ws" + plain.api.removeprefix("http") + "/rover"
    with pytest.raises(Exception, match=r"403|1008"):
        connect(url, subprotocols=[Subprotocol("footfall-rover-1")], proxy=None)
    assert counts(ground)[0] - door == Counter({"wrong-version": 1})
    session_counts(ground, session, "wrong-version")
    assert "footfall-rover-1 was offered" in ground.get("/info").json()["rover_link"]["last_fault"]
    assert "footfall-rover-1 was offered" in ground.get("/sessions/current").json()["link"]["fault"]


def test_what_is_too_large_to_be_read_closes_the_link_and_is_counted(plain, ground, rover):
    before = counts(ground)[0]
    with contextlib.suppress(ConnectionClosed):
        rover.send(bytes(4 * MAX_BINARY_FRAME + 1))
    with pytest.raises(ConnectionClosed):
        told(rover)  # whatever comes before the end, an error is not among it
    until(lambda: counts(ground)[0] - before == Counter({"too-large": 1}), "the count")


def test_an_endless_row_of_new_faults_does_not_fill_the_log(plain, ground, rover):
    live = plain.sessions.current
    before = len([e for e in live.events() if e.type == "link_fault"])
    counted = counts(ground)[1]
    for number in range(200):
        rover.send(f"{'x' * number} is no json")
        told(rover)
    session_counts(ground, counted, "not-json", 200)
    assert len([e for e in live.events() if e.type == "link_fault"]) - before < 20


texts = st.text(max_size=8) | st.text(st.characters(categories=("Cs", "L")), max_size=4)
scalars = st.none() | st.booleans() | st.floats() | st.integers() | texts
anything = st.recursive(scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner))
GOODS = [
    GOOD,
    GREETING,
    {"type": "ack", "id": "c", "state": "done", "reason": "", "time": 1.0},
    {"type": "error", "id": "", "text": "the cameras are cold"},
]


@st.composite
def mutated(draw) -> str:
    """A good message with something about it changed, cut, put in or doubled."""
    body = dict(draw(st.sampled_from(GOODS)))
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(body)) | texts) if body else "x"
        match draw(st.sampled_from(["drop", "put", "bend"])):
            case "drop":
                body.pop(name, None)
            case "put":
                body[name] = draw(anything)
            case "bend" if isinstance(body.get(name), list) and body[name]:
                bent = list(body[name])
                bent[draw(st.integers(0, len(bent) - 1))] = draw(scalars)
                body[name] = bent
    text = json.dumps(body)
    cut = draw(st.none() | st.integers(0, len(text)))
    return text if cut is None else text[:cut]


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(message=mutated())
def test_no_mutation_of_a_message_is_passed_over_in_silence(plain: Running, ground, rover, message):
    """A known bad message goes after each: what came before was answered by then. Every answer is a count."""
    live = plain.sessions.current
    assert live is not None
    door, link = live.rover.link, ground.get("/info").json()["rover_link"]
    before, taken = Counter(link["faults_by_kind"]), door.frames
    rover.send(message)
    rover.send('{"type": "the-end"}')
    answers = [told(rover)]
    while "the-end" not in answers[-1]:
        answers.append(told(rover))
    refused = [text for text in answers if "clock went back" not in text and "frames jumped" not in text]
    counted = Counter(ground.get("/info").json()["rover_link"]["faults_by_kind"])
    assert (counted - before).total() == len(refused)
    assert len(refused) >= 1 + (not _is_good(message))
    assert set(counted) <= set(FAULTS)
    assert door.frames - taken <= 1
    for address in ("/sessions/current", "/sessions/current/log"):
        assert ground.get(address).status_code == 200


def _is_good(message: str) -> bool:
    try:
        decode(message, 6)
    except Exception:
        return False
    return True


# -- the same by plain requests ----------------------------------------------------------------------------------


def body(frames, **changes) -> str:
    return json.dumps({**HELLO, "frames": frames, **changes})


@pytest.fixture
def fresh(plain, ground):
    """A session of its own, so that counts begin at zero."""
    plain.until_rover_left()
    return plain.sessions.create("by requests")


def test_frames_by_request_are_the_frames_of_the_link(ground, fresh):
    frames = moving_frames(30)
    sent = [message_object(frame) for frame in frames]
    answer = ground.post("/rover/telemetry", content=body(sent[:20]))
    assert answer.status_code == 200, answer.text
    assert (answer.json()["taken"], answer.json()["refused"]) == (20, [])
    asked = time.time()
    # 20 is missing, 18 comes late, 21 twice
    answer = ground.post("/rover/telemetry", content=body([sent[21], sent[21], sent[18], *sent[22:]]))
    link = answer.json()["link"]
    assert (link["frames"], link["gaps"], link["late"], link["repeated"]) == (31, 1, 2, 1)
    latest = ground.get("/sessions/current/telemetry").json()
    assert latest["number"] == 29
    assert latest["arrival"] == 31
    assert latest["posture"] == frames[-1].state.posture.tolist()
    assert 0 <= latest["age_s"] < 10
    assert latest["received_at"] >= asked


@pytest.mark.parametrize(
    ("content", "kind", "says"),
    [
        (body([GOOD], protocol=1), "wrong-version", "protocol 1, this end speaks 2"),
        (body([GOOD], epoch=3), "wrong-field", "unknown fields epoch"),
        (body([GOOD], software="\ud800"), "not-json", "lone surrogate"),
        (body([GOOD], robot="spider"), "wrong-robot", "this session is for athlete"),
        (body([GOOD], legs=8), "wrong-legs", "athlete with 6 legs"),
        (body([{**GOOD, "posture": GOOD["posture"][:30]}]), "wrong-legs", "6 legs, not 5"),
        (body([{**GOOD, "time": float("inf")}]), "not-finite", "Infinity"),
        (body([]), "wrong-field", "1 to 1000 frames"),
        (json.dumps(HELLO), "wrong-field", "frames must be"),
        (body([{"type": "stop", "id": "x", "epoch": 1}]), "unknown-message", "telemetry messages alone"),
        ("no json", "not-json", "not JSON"),
        (" " * (5 << 20), "too-large", "send fewer frames"),
    ],
)
def test_a_request_that_is_wrong_is_a_problem_and_counted(ground, fresh, content, kind, says):
    answer = ground.post("/rover/telemetry", content=content)
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/invalid-telemetry"
    assert answer.json()["fault"] == kind
    assert says in answer.json()["detail"]
    assert fresh.rover.link.kinds == Counter({kind: 1})


def test_of_several_frames_the_good_ones_are_taken_and_the_others_named(ground, fresh):
    frames = [message_object(frame) for frame in moving_frames(3)]
    frames[1]["mode"] = "flying"
    answer = ground.post("/rover/telemetry", content=body(frames)).json()
    assert answer["taken"] == 2
    assert [(one["frame"], "mode" in one["detail"]) for one in answer["refused"]] == [(1, True)]
    assert (fresh.rover.link.frames, fresh.rover.link.gaps, fresh.rover.link.faults) == (2, 1, 1)


def test_requests_are_refused_while_a_rover_is_linked(ground, rover):
    answer = ground.post("/rover/telemetry", content=body([GOOD]))
    assert answer.status_code == 409
    assert "linked by WebSocket" in answer.json()["detail"]


def test_no_request_makes_a_silent_rover_look_heard(ground, rover, monkeypatch):
    monkeypatch.setattr(link_end, "GIVEN_UP_AFTER", 0.0)
    frames = ground.get("/sessions/current").json()["link"]["frames"]
    for path, content in (("/rover/telemetry", body([GOOD])), ("/rover/images?protocol=2", b"whatever")):
        answer = ground.post(path, content=content)
        assert answer.status_code == 409
        assert "silent lately" in answer.json()["detail"]
    assert ground.get("/sessions/current").json()["link"]["frames"] == frames


def test_frames_by_request_on_their_way_count_for_nothing_once_a_rover_is_linked(plain, ground, fresh, monkeypatch):
    """With a light time: the answer was yes, but what arrives is not of the rover that is there by then."""
    on_their_way = []
    sent = [message_object(frame) for frame in moving_frames(2)]
    with monkeypatch.context() as far:
        far.setattr(fresh.rover.link, "hear", lambda use, *_: on_their_way.append(use))
        assert ground.post("/rover/telemetry", content=body(sent)).json()["taken"] == 2
    with linked(plain, HelloMessage("athlete", 6)):
        until(lambda: fresh.rover.link.connected, "the link")
        for arrive in on_their_way:
            arrive(time.monotonic())
        assert (fresh.rover.link.late, fresh.rover.link.frame, fresh.rover.link.age) == (2, None, None)


def test_images_by_request(ground, fresh):
    grey = np.random.default_rng(0).integers(0, 256, (12, 16), dtype=np.uint8)
    left, right = (
        Camera(side, 16, 12, 20.0, 20.0, 8.0, 6.0, transform(translation=(x, 0.0, 0.0)))
        for side, x in (("l", 0.0), ("r", 0.3))
    )
    pair = ImagePair("nav0", 5.0, grey, grey, left, right, np.eye(4))
    content = encode_images("x", Snapshot(moving_frames(1)[0].state, (pair,)))
    answer = ground.post("/rover/images", params={"protocol": 2}, content=content)
    assert answer.status_code == 200, answer.text
    assert answer.json()["pairs"] == ["nav0"]
    assert fresh.state.snapshot == answer.json()["digest"]
    assert "speaks 2" in ground.post("/rover/images", params={"protocol": 1}, content=content).json()["detail"]
    assert ground.post("/rover/images", params={"protocol": 2}, content=content[:-5]).status_code == 422
    assert fresh.rover.link.kinds == Counter({"wrong-version": 1, "wrong-field": 1})
