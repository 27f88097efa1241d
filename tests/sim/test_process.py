"""The simulated rover as its own process, talking to a real websocket server."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from footfall.io.artifacts import encode as store
from footfall.io.link_images import decode_images
from footfall.io.terrain_files import write_terrain
from footfall.telemetry.link import (
    AckMessage,
    ClearStopMessage,
    CommandMessage,
    EpochMessage,
    ErrorMessage,
    HelloMessage,
    ImageRequestMessage,
    QueryMessage,
    StopAckMessage,
    StopMessage,
    decode,
    encode,
)
from footfall.telemetry.state import TelemetryFrame
from tests.support.waiting import BOUND


@pytest.fixture
def rover_process(link_server, flat, standing, tmp_path) -> Iterator[subprocess.Popen]:
    terrain, state = tmp_path / "world.npz", tmp_path / "state.npz"
    write_terrain(flat, terrain)
    state.write_bytes(store(standing))
    command = [sys.executable, "-m", "footfall.sim", "--url", link_server.url]
    process = subprocess.Popen([*command, "--terrain", str(terrain), "--state", str(state), "--with-parent"])
    yield process
    process.send_signal(signal.SIGTERM)
    assert process.wait(BOUND) == 0


def texts(frames) -> list:
    return [decode(frame, legs=6) for frame in frames if isinstance(frame, str)]


def of(kind, count=1, **fields):
    """Waits for ``count`` messages of a kind whose fields have the given values; gives the last."""

    def look(frames):
        found = [
            one
            for one in texts(frames)
            if isinstance(one, kind) and all(getattr(one, name) == wanted for name, wanted in fields.items())
        ]
        return found[-1] if len(found) >= count else None

    return look


def moving(frames):
    """The newest telemetry, once it is under way."""
    newest = [one for one in texts(frames) if isinstance(one, TelemetryFrame)][-1:]
    return newest and newest[0].state.mode == "moving"


def lift(robot, command_id: str, by: float, duration: float, epoch: int = 5) -> str:
    joints = robot.posture("stand")[12:18].copy()
    joints[1] -= by
    return encode(CommandMessage(command_id, "s", 0, "LEG_MOVE", 2, joints, duration, epoch=epoch))


def count_acks(frames, command_id: str, state: str) -> int:
    return sum(isinstance(one, AckMessage) and (one.id, one.state) == (command_id, state) for one in texts(frames))


def test_a_day_on_the_link(athlete, rover_process, link_server):
    server = link_server
    hello = server.wait_for(of(HelloMessage))
    assert (hello.protocol, hello.robot, hello.legs, hello.epoch) == (2, "athlete", 6, None)
    assert isinstance(texts(server.frames)[0], HelloMessage)

    # images are taken beside all that follows
    server.send(encode(ImageRequestMessage("i1", ("nav0",))))
    server.send(encode(ImageRequestMessage("i2", None)))
    assert "busy" in server.wait_for(of(ErrorMessage, id="i2")).text

    # nothing is carried out before the ground has answered the hello, nor for the answer to another one
    server.send(encode(EpochMessage("an earlier connection", 3)))
    server.send(lift(athlete, "c-1", 0.1, 0.5))
    assert "has not told" in server.wait_for(of(AckMessage, id="c-1", state="outdated")).reason
    server.send(encode(EpochMessage(hello.id, 5)))
    server.wait_for(of(EpochMessage, id=hello.id, epoch=5))
    server.send(lift(athlete, "c-2", 0.1, 0.5, epoch=4))
    assert "in epoch 4" in server.wait_for(of(AckMessage, id="c-2", state="outdated")).reason
    assert count_acks(server.frames, "c-1", "started") == count_acks(server.frames, "c-2", "started") == 0

    server.send(lift(athlete, "c1", 0.1, 0.5))
    server.wait_for(of(AckMessage, id="c1", state="done"))
    said = [one.state for one in texts(server.frames) if isinstance(one, AckMessage)]
    assert said == ["outdated", "outdated", "received", "started", "done"]

    # the same id again, as a link that repeats itself would
    server.send(lift(athlete, "c1", 0.3, 0.5))
    server.wait_for(of(AckMessage, count=2, id="c1", state="done"))
    assert count_acks(server.frames, "c1", "started") == 1

    # asked what became of commands: nothing moves
    server.send(encode(QueryMessage("c1")))
    server.wait_for(of(AckMessage, count=3, id="c1", state="done"))
    server.send(encode(QueryMessage("c0")))
    assert "no command" in server.wait_for(of(AckMessage, id="c0", state="unknown")).reason

    server.send(lift(athlete, "c2", 1.2, 30.0))
    server.wait_for(of(AckMessage, id="c2", state="started"))
    server.wait_for(moving)
    server.send(encode(StopMessage("halt", 6)))
    stopped = server.wait_for(of(StopAckMessage, id="halt"))
    assert "stopped" in server.wait_for(of(AckMessage, id="c2", state="refused")).reason
    server.send(lift(athlete, "c3", 0.1, 1.0, epoch=6))
    assert "clear the stop" in server.wait_for(of(AckMessage, id="c3", state="refused")).reason
    after = server.wait_for(lambda frames: _telemetry_after(frames, stopped.time, 5))
    assert {frame.state.mode for frame in after} == {"stopped"}
    assert len({frame.state.posture.tobytes() for frame in after}) == 1
    assert np.array_equal(after[0].commanded, after[0].state.posture)

    server.send(encode(ClearStopMessage("of an earlier stop", 5)))
    assert "not cleared" in server.wait_for(of(ErrorMessage, id="of an earlier stop")).text
    server.send(encode(ClearStopMessage("again", 6)))
    server.send(lift(athlete, "c-3", 0.1, 1.0))
    server.wait_for(of(AckMessage, id="c-3", state="outdated"))
    server.send(lift(athlete, "c4", 0.1, 1.0, epoch=6))
    server.wait_for(of(AckMessage, id="c4", state="done"))

    server.send(json.dumps({"type": "command", "id": "c5", "joints": [0.0] * 5}))
    server.wait_for(of(AckMessage, id="c5", state="refused"))
    server.send("nonsense")
    assert "not JSON" in server.wait_for(of(ErrorMessage, id="")).text

    image = server.wait_for(lambda frames: [frame for frame in frames if isinstance(frame, bytes)])[0]
    request, snapshot = decode_images(image, legs=6)
    assert request == "i1"
    assert [pair.name for pair in snapshot.pairs] == ["nav0"]
    assert snapshot.pairs[0].left.std() > 5
    assert np.array_equal(snapshot.pairs[0].T_site_base, snapshot.state.T_site_base)
    server.send(encode(ImageRequestMessage("i3", ("nav9",))))
    assert "nav9" in server.wait_for(of(ErrorMessage, id="i3")).text

    frames = [one for one in texts(server.frames) if isinstance(one, TelemetryFrame)]
    assert [frame.number for frame in frames] == list(range(len(frames)))
    times = np.array([frame.state.time for frame in frames])
    assert (np.diff(times) > 0).all()
    assert len(frames) >= 5 * (times[-1] - times[0])
    weight = athlete.mass * 9.81
    assert all(abs(frame.state.wheel_forces[:, 2].sum() - weight) < 1e-3 * weight for frame in frames)

    # the line breaks while it moves: it finishes, comes back, and says so
    server.send(lift(athlete, "c6", 0.0, 1.0, epoch=7))
    server.wait_for(of(AckMessage, id="c6", state="started"))
    server.drop()
    server.wait_for(of(AckMessage, id="c6", state="done"))
    again = server.wait_for(of(HelloMessage, count=2))
    assert server.connections == 2
    assert again.id != hello.id
    assert again.epoch == 7
    server.send(lift(athlete, "c7", 0.0, 1.0, epoch=7))
    server.wait_for(of(AckMessage, id="c7", state="outdated"))
    assert count_acks(server.frames, "c6", "done") == 1


def _telemetry_after(frames, time: float, count: int):
    later = [one for one in texts(frames) if isinstance(one, TelemetryFrame) and one.state.time > time]
    return later if len(later) >= count else None


def test_a_rover_that_can_not_start_says_why(tmp_path):
    command = [
        sys.executable,
        "-m",
        "footfall.sim",
        "--url",
        "ws://127.0.0.1:9/",
        "--terrain",
        str(tmp_path / "no.tif"),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=BOUND, check=False)
    assert ended.returncode == 2
    assert "no.tif" in ended.stderr
    assert "Traceback" not in ended.stderr
