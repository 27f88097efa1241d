"""The rover in physics at its end of the link, in a process of its own."""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from footfall.io.artifacts import encode as store
from footfall.io.terrain_files import write_terrain
from footfall.telemetry.link import (
    AckMessage,
    CommandMessage,
    EpochMessage,
    HelloMessage,
    StopAckMessage,
    StopMessage,
    decode,
    encode,
)
from footfall.telemetry.state import TelemetryFrame
from tests.support.waiting import BOUND

MOON = 1.62


@pytest.fixture
def rover_process(link_server, flat, standing, tmp_path) -> Iterator[subprocess.Popen]:
    terrain, state = tmp_path / "world.npz", tmp_path / "state.npz"
    write_terrain(flat, terrain)
    state.write_bytes(store(standing))
    command = [sys.executable, "-m", "footfall.sim", "--physics", "--gravity", str(MOON), "--url", link_server.url]
    process = subprocess.Popen([*command, "--terrain", str(terrain), "--state", str(state), "--with-parent"])
    yield process
    process.send_signal(signal.SIGTERM)
    assert process.wait(BOUND) == 0


def texts(frames) -> list:
    return [decode(frame, legs=6) for frame in frames if isinstance(frame, str)]


def newest(frames, wanted: Callable[[TelemetryFrame], bool]) -> TelemetryFrame | None:
    found = [one for one in texts(frames) if isinstance(one, TelemetryFrame)]
    return found[-1] if found and wanted(found[-1]) else None


def acked(command_id: str, state: str):
    return lambda frames: [
        one for one in texts(frames) if isinstance(one, AckMessage) and (one.id, one.state) == (command_id, state)
    ]


def test_it_tells_what_physics_makes_of_its_commands(athlete, rover_process, link_server):
    hello = link_server.wait_for(lambda frames: [one for one in texts(frames) if isinstance(one, HelloMessage)])[0]
    link_server.send(encode(EpochMessage(hello.id, 0)))
    first = link_server.wait_for(lambda frames: newest(frames, lambda frame: frame.state.mode == "idle"))
    assert first.state.wheel_forces[:, 2].sum() == pytest.approx(athlete.mass * MOON, abs=2.0)
    sag = athlete.stiffness * (first.commanded - first.state.posture)
    assert np.allclose(sag, first.state.joint_torques, atol=1e-9)
    assert np.abs(first.state.joint_torques).max() > 50

    joints = np.array(first.commanded[12:18])
    joints[1] -= 0.2
    link_server.send(encode(CommandMessage("c1", "s", 0, "LEG_MOVE", 2, joints, 1.0)))
    link_server.wait_for(acked("c1", "done"))
    link_server.wait_for(lambda frames: newest(frames, lambda frame: frame.state.wheel_forces[2, 2] == 0))

    # every joint of all legs at once, then a stop
    back = np.array(first.commanded)
    back[1::6] += 0.3
    link_server.send(encode(CommandMessage("c2", "s", 1, "POSTURE_MOVE", None, back, 30.0)))
    link_server.wait_for(acked("c2", "started"))
    link_server.send(encode(StopMessage("halt")))
    link_server.wait_for(lambda frames: [one for one in texts(frames) if isinstance(one, StopAckMessage)])
    assert "stopped" in link_server.wait_for(acked("c2", "refused"))[0].reason
    stopped = link_server.wait_for(lambda frames: newest(frames, lambda frame: frame.state.mode == "stopped"))
    later = link_server.wait_for(lambda frames: newest(frames, lambda frame: frame.number >= stopped.number + 5))
    assert np.array_equal(later.commanded, stopped.commanded)
