"""What a robot that others described says is recorded with the names of its legs and joints, and reads back alike."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.io.link_images import decode_images
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.writing import JOINTS, RecordingWriter
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.replay.recordings import replay_recording
from footfall.session.rover.recorded import Tracks
from footfall.session.rover.recorder import save
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.telemetry.link_state import layout_object
from footfall.telemetry.state import RobotState, TelemetryFrame
from tests.support.described import robot_of, seeing
from tests.support.frames import digests
from tests.support.waiting import until

COUNT = 25


@pytest.fixture(scope="module")
def robot():
    return seeing(robot_of(6)[1], side=12)


@pytest.fixture(scope="module")
def frames(robot) -> list[TelemetryFrame]:
    """Of a rover with noisy encoders, ten a second."""
    rng, joints, legs = np.random.default_rng(5), len(robot.joint_names), len(robot.legs)
    made = []
    for number in range(COUNT):
        posture, forces = rng.normal(size=joints), rng.normal(size=(legs, 3))
        named = robot.layout
        state = RobotState(
            robot.name,
            1.7e9 + 0.1 * number,
            posture,
            np.eye(4),
            forces,
            rng.normal(size=joints),
            "idle",
            described=named,
        )
        made.append(TelemetryFrame(number, state, posture + 0.01))
    return made


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, robot, frames):
    """The recording of a session that heard the frames and images."""
    rng = np.random.default_rng(6)
    pair = robot.description.cameras[0]
    size = pair.camera_left.height, pair.camera_left.width
    left, right = (rng.integers(0, 255, size, dtype=np.uint8) for _ in "lr")
    images = ImagePair(pair.name, frames[3].state.time, left, right, pair.camera_left, pair.camera_right, np.eye(4))
    snapshot = Snapshot(frames[3].state, (images,))
    with Sessions(tmp_path_factory.mktemp("sessions"), jobs=InlineJobs()) as sessions:
        live = sessions.create("described", robot)
        live.rover.connected(lambda _: None)
        for frame in frames:
            live.rover.take_telemetry(frame)
        live.rover.take_images(snapshot)
        live.commands.stop("enough")
        until(lambda: live.rover.frame is not None and live.rover.frame.number == COUNT - 1, "all frames")
        live.close()
        (path,) = live.rover.recorder.paths()
        yield path, snapshot


def test_frames_and_images_read_back_bit_for_bit(robot, frames, recorded):
    path, snapshot = recorded
    read = Recording(path)
    assert (read.robot, read.legs) == (robot.name, 6)
    assert read.described is not None
    assert read.described.digest == robot.layout.digest
    assert digests(read.frames()) == digests(frames)
    (images,) = [one.content for one in read.said() if isinstance(one.content, bytes)]
    assert decode_images(images, 6, described=read.described)[1].digest == snapshot.digest


def test_it_is_in_order(recorded):
    report = replay_recording(recorded[0])
    assert report.ok, report.problems
    assert (report.legs, report.counts["frames"], report.images, report.stops) == (6, COUNT, 1, 1)


def test_plots_have_its_joints_and_legs(frames, recorded):
    channels = [("position", 17), ("force", 5), ("torque", 0)]
    found = Tracks().looked_at([recorded[0]], channels, None, None, 1000)
    expected = [
        [frame.state.posture[17], frame.state.wheel_forces[5, 2], frame.state.joint_torques[0]] for frame in frames
    ]
    np.testing.assert_allclose(np.array(found.numbers, float).T, np.array(expected, np.float32), rtol=1e-6)
    with pytest.raises(InvalidInput, match="force has the numbers 0 to 5, not 6"):
        Tracks().looked_at([recorded[0]], [("force", 6)], None, None, 1000)


def test_one_that_was_cut_short_keeps_the_names(tmp_path, robot, frames):
    out = io.BytesIO()
    about = {"robot": robot.name, "legs": "6", JOINTS: json.dumps(layout_object(robot.layout))}
    writer = RecordingWriter(out, robot.joint_names, about)
    for number, frame in enumerate(frames):
        writer.frame(frame, number * 100_000_000)
    writer.flush()
    path = tmp_path / "telemetry-00001-x.mcap.part"
    path.write_bytes(out.getvalue())
    assert "was cut short" in save(path)
    read = Recording(tmp_path / "telemetry-00001-x.mcap")
    assert read.described is not None
    assert digests(read.frames()) == digests(frames)


@pytest.mark.parametrize(
    ("joints", "why"),
    [
        ("{", "are no JSON"),
        ("[1]", "are no JSON object"),
        (json.dumps({"legs": []}), ""),
        (json.dumps({"legs": ["a", "a"], "of_leg": {"a": ["x"]}, "sliding": []}), ""),
    ],
)
def test_names_that_cannot_be_are_refused(tmp_path, robot, frames, joints, why):
    out = io.BytesIO()
    writer = RecordingWriter(out, robot.joint_names, {"robot": robot.name, "legs": "6", JOINTS: joints})
    writer.frame(frames[0], 0)
    writer.finish()
    path = tmp_path / "odd.mcap"
    path.write_bytes(out.getvalue())
    with pytest.raises(InvalidInput) as refused:
        Recording(path)
    assert "odd.mcap is no recording" in refused.value.message
    assert why in refused.value.message


def test_frames_of_other_joints_are_a_problem(tmp_path, robot, frames):
    """As a tool would leave it that puts together recordings of two robots."""
    out = io.BytesIO()
    about = {"robot": robot.name, "legs": "6", JOINTS: json.dumps(layout_object(robot_of(4)[1].layout))}
    writer = RecordingWriter(out, robot.joint_names, about)
    writer.frame(frames[0], 0)
    writer.finish()
    path = tmp_path / "odd.mcap"
    path.write_bytes(out.getvalue())
    assert not replay_recording(path).ok


def test_a_robot_of_athletes_build_names_none(tmp_path, athlete):
    from tests.support.frames import moving_frames

    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("athlete")
        live.rover.connected(lambda _: None)
        for frame in moving_frames(3):
            live.rover.take_telemetry(replace(frame, state=replace(frame.state, robot=athlete.name)))
        live.close()
        (path,) = live.rover.recorder.paths()
        assert Recording(path).described is None
