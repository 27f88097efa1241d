"""Recordings in the tools of others: `rosbags` opens them as ROS 2 would; and what other tools left of one is read."""

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse, rotation_rpy, transform
from footfall.io.exports import export
from footfall.io.image_files import LEVEL_FORWARD
from footfall.io.link_images import decode_images
from footfall.io.recordings import ACKNOWLEDGEMENTS, DROPPED, FRAME, IMAGES, TO_ROVER, object_of
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.recovery import recover
from footfall.io.recordings.writing import RecordingWriter
from footfall.session.replay.recordings import replay_recording
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from tests.support.frames import JOINTS, digests, moving_frames
from tests.support.sequences import bits, four_kinds

ABOUT = {"robot": "athlete", "legs": "6", "session": "test"}
OBJECTS = (IMAGES, TO_ROVER, ACKNOWLEDGEMENTS, DROPPED)
BASELINE = 0.3


def pair(name: str, yaw: float, time_right: float | None = None) -> ImagePair:
    """A rectified pair with centres of its own, looking somewhere on the chassis."""
    grey = np.random.default_rng(1).integers(0, 256, (2, 12, 16), dtype=np.uint8)
    T = transform(rotation_rpy(0.0, 0.4, yaw), (0.5, yaw, 0.2)) @ LEVEL_FORWARD
    left, right = (
        Camera("same name", 16, 12, 20.0, 20.0, cx, 6.0, T @ transform(translation=(along, 0.0, 0.0)))
        for cx, along in ((8.0, 0.0), (9.5, BASELINE))
    )
    return ImagePair(name, 10.0, grey[0], grey[1], left, right, np.eye(4), time_right)


PAIRS = (pair("nav0", 0.3), pair("haz 1/é", -1.2, 10.125))
FRAMES = moving_frames(40)


def written() -> bytes:
    out = io.BytesIO()
    writer = RecordingWriter(out, JOINTS, ABOUT)
    for i, frame in enumerate(FRAMES):
        writer.frame(frame, i * 10**8)
        if i == 5:
            writer.images(Snapshot(frame.state, PAIRS), i * 10**8)
            writer.note(TO_ROVER, {"type": "stop", "id": "s1 é"}, i * 10**8)
            writer.note(ACKNOWLEDGEMENTS, {"type": "stop_ack", "id": "s1 é"}, i * 10**8)
            writer.dropped(3, i * 10**8)
    writer.finish()
    return out.getvalue()


WRITTEN = written()


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """All messages of a recording by topic, as rosbags reads them from the definitions in the file alone."""
    path = tmp_path_factory.mktemp("bag") / "telemetry.mcap"
    path.write_bytes(WRITTEN)
    told: dict[str, list] = {}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            told.setdefault(connection.topic, []).append(reader.deserialize(raw, connection.msgtype))
        assert reader.message_count == sum(map(len, told.values()))
    return told


def test_rosbags_opens_a_recording(bag):
    assert len(bag[FRAME]) == len(FRAMES)
    for told, frame in zip(bag[FRAME], FRAMES, strict=True):
        assert told.number == frame.number
        assert bits(told.t_site_base) == bits(frame.state.T_site_base.ravel())
    for told, frame in zip(bag["/footfall/measured"], FRAMES, strict=True):
        assert bits(told.position) == bits(frame.state.posture)
    assert json.loads(bag[TO_ROVER][0].data) == {"type": "stop", "id": "s1 é"}
    assert json.loads(bag[DROPPED][0].data) == {"dropped": 3}
    assert [one["name"] for one in json.loads(bag[IMAGES][0].data)["pairs"]] == ["nav0", "haz 1/é"]


def test_rosbags_opens_an_exported_sequence(tmp_path):
    path = tmp_path / "step.mcap"
    path.write_bytes(export(four_kinds(), "ros2"))
    with AnyReader([path]) as reader:
        told: list[tuple[str, Any]] = [(c.topic, reader.deserialize(raw, c.msgtype)) for c, _, raw in reader.messages()]
    moves = [one for topic, one in told if topic == "/footfall/leg2/joint_trajectory"]
    assert bits(moves[0].points[0].positions) == bits(np.asarray(four_kinds().commands[0].joints))


def test_every_message_is_in_one_encoding():
    summary = make_reader(io.BytesIO(WRITTEN)).get_summary()
    assert summary is not None
    assert {one.message_encoding for one in summary.channels.values()} == {"cdr"}
    assert {one.encoding for one in summary.schemas.values()} == {"ros2msg"}


def pose(moved) -> np.ndarray:
    place, turn = moved.transform.translation, moved.transform.rotation
    R = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    return transform(R, [place.x, place.y, place.z])


def test_every_frame_hangs_in_the_tree(bag):
    """site → base → each camera, at its place; no message is in a frame that nobody knows."""
    moving = {one.child_frame_id: one.header.frame_id for told in bag["/tf"] for one in told.transforms}
    fixed = {one.child_frame_id: one for told in bag["/tf_static"] for one in told.transforms}
    assert moving == {"base": "site"} | dict.fromkeys(fixed, "base")
    assert {one.header.frame_id for one in fixed.values()} == {"base"}
    cameras = [camera for one in PAIRS for camera in (one.camera_left, one.camera_right)]
    assert len(fixed) == len(cameras)
    for one, camera in zip(fixed.values(), cameras, strict=True):
        assert np.allclose(pose(one), camera.T_base_camera, atol=1e-12)
    at = {(one.child_frame_id, one.header.stamp.nanosec) for told in bag["/tf"] for one in told.transforms}
    assert {("nav0_left_optical", 0), ("haz_1___left_optical", 0), ("haz_1___left_optical", 125_000_000)} <= at
    used = {one.header.frame_id for several in bag.values() for one in several if hasattr(one, "header")} - {
        ""
    }  # of a JointState, which has none
    assert used <= {"site", *moving, *fixed}
    assert any(name.endswith("_left_optical") for name in used)


def test_a_pair_is_as_image_geometry_wants_it(bag):
    """Both cameras' infos are in the left one's frame; P alone puts a point of that frame into the right image."""
    fixed = {one.child_frame_id: pose(one) for told in bag["/tf_static"] for one in told.transforms}
    points = np.random.default_rng(3).uniform([-1, -1, 2], [1, 1, 6], (20, 3))
    for one, topic in zip(PAIRS, ("nav0", "haz_1__"), strict=True):
        infos = {side: bag[f"/footfall/{topic}/{side}/camera_info"][0] for side in ("left", "right")}
        images = {side: bag[f"/footfall/{topic}/{side}"][0] for side in ("left", "right")}
        for side, camera in (("left", one.camera_left), ("right", one.camera_right)):
            info = infos[side]
            assert info.header.frame_id == images[side].header.frame_id == f"{topic}_left_optical"
            assert info.header.stamp == images[side].header.stamp
            P = info.p.reshape(3, 4)
            assert P[0, 3] == pytest.approx(-20.0 * BASELINE if side == "right" else 0.0)
            seen = np.c_[points, np.ones(20)] @ P.T
            in_base = apply(fixed[info.header.frame_id], points)
            own = apply(inverse(camera.T_base_camera), in_base)
            expected = np.c_[camera.fx * own[:, 0], camera.fy * own[:, 1]] / own[:, 2:] + [camera.cx, camera.cy]
            assert np.allclose(seen[:, :2] / seen[:, 2:], expected, atol=1e-9)
            assert (info.distortion_model, info.d.tolist(), info.binning_x) == ("plumb_bob", [0.0] * 5, 0)
            assert info.r.tolist() == np.eye(3).ravel().tolist()


# --- what others, and older versions, make of a recording


def rewritten(old: bool = False, without: Sequence[str] = (), **options) -> bytes:
    """The same messages in another file. old: objects as JSON, without camera frames, as version 0.1.0 wrote them."""
    reader = make_reader(io.BytesIO(WRITTEN))
    out = io.BytesIO()
    writer = Writer(out, chunk_size=16 << 10, compression=CompressionType.ZSTD, **options)
    writer.start(profile="ros2", library="test")
    for one in reader.iter_metadata():
        writer.add_metadata(one.name, one.metadata)
    channels: dict[str, int] = {}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        data, as_json = message.data, old and channel.topic in OBJECTS
        if channel.topic in without or (old and channel.topic in ("/tf_static", "/tf")):
            continue
        if as_json:
            data = json.dumps(object_of("cdr", data)).encode()
        if channel.topic not in channels:
            kind = ("footfall.Object", "jsonschema", b"{}") if as_json else (schema.name, schema.encoding, schema.data)
            channels[channel.topic] = writer.register_channel(
                channel.topic, "json" if as_json else "cdr", writer.register_schema(*kind)
            )
        writer.add_message(channels[channel.topic], message.log_time, data, message.publish_time, message.sequence)
    writer.finish()
    return out.getvalue()


REWRITTEN = {
    "old": rewritten(old=True),
    "no statistics": rewritten(use_statistics=False),
    "no index": rewritten(index_types=IndexType.NONE),
    "no index of metadata": rewritten(index_types=IndexType.ALL & ~IndexType.METADATA),
    "no index of chunks": rewritten(index_types=IndexType.ALL & ~IndexType.CHUNK),
    "no index of messages": rewritten(index_types=IndexType.ALL & ~IndexType.MESSAGE),
    "no channels at the end": rewritten(repeat_channels=False),
    "no schemas at the end": rewritten(repeat_schemas=False),
    "nothing at the end": rewritten(
        use_statistics=False,
        index_types=IndexType.NONE,
        repeat_channels=False,
        repeat_schemas=False,
        use_summary_offsets=False,
    ),
    "no chunks": rewritten(use_chunking=False),
    "no chunks, nothing at the end": rewritten(
        use_chunking=False,
        use_statistics=False,
        index_types=IndexType.NONE,
        repeat_channels=False,
        repeat_schemas=False,
        use_summary_offsets=False,
    ),
}


def opened(data: bytes, folder: Path) -> Recording:
    path = folder / "telemetry.mcap"
    path.write_bytes(data)
    return Recording(path)


@pytest.mark.parametrize("kind", list(REWRITTEN))
def test_a_recording_is_read_whatever_its_end_lacks(kind, tmp_path):
    recording = opened(REWRITTEN[kind], tmp_path)
    assert recording.whole
    assert recording.duration == pytest.approx(3.9)
    assert recording.counts == {"frames": 40, "gaps": 0, "restarts": 0, "dropped": 3}
    assert recording.messages == opened(WRITTEN, tmp_path).messages - (44 if kind == "old" else 0)
    assert digests(recording.frames()) == digests(FRAMES)
    assert digests(recording.frames(2.05)) == digests(FRAMES[21:])
    said = [(one.topic, one.content) for one in recording.said() if one.topic != FRAME]
    assert [topic for topic, _ in said] == [IMAGES, TO_ROVER, ACKNOWLEDGEMENTS, DROPPED]
    assert isinstance(said[0][1], bytes)
    assert decode_images(said[0][1], legs=6)[1].digest == Snapshot(FRAMES[5].state, PAIRS).digest
    assert [content for _, content in said[1:]] == [
        {"type": "stop", "id": "s1 é"},
        {"type": "stop_ack", "id": "s1 é"},
        {"dropped": 3},
    ]


@pytest.mark.parametrize("kind", ["old", "new"])
def test_of_a_cut_recording_what_was_dropped_is_counted(kind, tmp_path):
    data = REWRITTEN["old"] if kind == "old" else WRITTEN
    out = io.BytesIO()
    saved = recover(io.BytesIO(data[: len(data) * 3 // 4]), out)
    assert saved.counts.dropped == 3
    found = digests(opened(out.getvalue(), tmp_path).frames())
    assert len(found) > 10
    assert found == digests(FRAMES[: len(found)])


def test_a_recording_whose_images_were_filtered_away_is_read_and_that_is_told(tmp_path):
    cameras = [f"/footfall/{name}/{side}" for name in ("nav0", "haz_1__") for side in ("left", "right")]
    path = tmp_path / "filtered.mcap"
    path.write_bytes(rewritten(without=cameras))
    recording = Recording(path)
    assert digests(recording.frames()) == digests(FRAMES)
    (header,) = [one.content for one in recording.said() if one.topic == IMAGES]
    assert isinstance(header, dict)
    assert [one["name"] for one in header["pairs"]] == ["nav0", "haz 1/é"]
    report = replay_recording(path)
    assert report.counts["frames"] == 40
    assert report.problems == ("images, set 1: they were taken out of the file, their header is there",)


def test_another_mcap_file_is_no_recording(tmp_path):
    out = io.BytesIO()
    writer = Writer(out, use_statistics=False, index_types=IndexType.NONE)
    writer.start(profile="ros2", library="test")
    writer.finish()
    with pytest.raises(InvalidInput, match="no recording of FootFall"):
        opened(out.getvalue(), tmp_path)
