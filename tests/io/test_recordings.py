"""Recordings read back bit for bit, by FootFall and by the libraries of others; what is whole of a cut one is saved."""

import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from footfall.core.errors import InvalidInput, InvalidTelemetry
from footfall.core.frames import quat_wxyz, transform
from footfall.io.link_images import decode_images
from footfall.io.recordings import COMMANDED, FRAME, IMAGES, MEASURED, MODE, TO_ROVER
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.recovery import recover
from footfall.io.recordings.writing import CHUNK, RecordingWriter
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import TelemetryFrame
from tests.support.frames import JOINTS, any_frames, digests, moving_frames
from tests.support.node import run
from tests.support.sequences import bits
from tests.support.waiting import BOUND

ABOUT = {"robot": "athlete", "legs": "6", "session": "test"}
PER_FRAME = 11


def written(frames, period: int = 100_000_000, *, finish: bool = True) -> bytes:
    out = io.BytesIO()
    writer = RecordingWriter(out, JOINTS, ABOUT)
    for i, frame in enumerate(frames):
        writer.frame(frame, i * period)
    if finish:
        writer.finish()
    return out.getvalue()


def opened(data: bytes, folder: Path) -> Recording:
    path = folder / "telemetry.mcap"
    path.write_bytes(data)
    return Recording(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recordings")


@settings(max_examples=40)
@given(frames=st.lists(any_frames(), min_size=1, max_size=12), period=st.sampled_from([0, 100_000_000]))
def test_any_frames_read_back_bit_for_bit(frames, period, folder):
    recording = opened(written(frames, period), folder)
    assert digests(recording.frames()) == digests(frames)
    assert recording.counts["frames"] == len(frames)
    assert recording.messages == PER_FRAME * len(frames)
    assert (recording.robot, recording.legs) == ("athlete", 6)


@settings(max_examples=20)
@given(frames=st.lists(any_frames(), min_size=1, max_size=4))
def test_the_library_of_others_reads_the_same(frames):
    """mcap-ros2-support decodes from the definitions in the file and knows nothing of FootFall."""
    reader = make_reader(io.BytesIO(written(frames)), validate_crcs=True, decoder_factories=[DecoderFactory()])
    told: dict[str, list] = {}
    for _, channel, _, decoded in reader.iter_decoded_messages():
        told.setdefault(channel.topic, []).append(decoded)
    assert {len(several) for several in told.values()} == {len(frames)}
    for i, frame in enumerate(frames):
        state = frame.state
        assert bits(told[MEASURED][i].position) == bits(state.posture)
        assert bits(told[MEASURED][i].effort) == bits(state.joint_torques)
        assert bits(told[COMMANDED][i].position) == bits(frame.commanded)
        assert told[COMMANDED][i].name == list(JOINTS)
        assert list(told[COMMANDED][i].velocity) == list(told[COMMANDED][i].effort) == []
        for leg, force in enumerate(state.wheel_forces):
            wrench = told[f"/footfall/leg{leg}/wheel_force"][i]
            assert bits([wrench.wrench.force.x, wrench.wrench.force.y, wrench.wrench.force.z]) == bits(force)
            assert wrench.wrench.torque.x == wrench.wrench.torque.y == wrench.wrench.torque.z == 0.0
            assert wrench.header.frame_id == "site"
        own = told[FRAME][i]
        assert (own.number, own.robot) == (frame.number, state.robot)
        assert bits([own.time]) == bits([state.time])
        assert bits(own.t_site_base) == bits(state.T_site_base.ravel())
        assert told[MODE][i].data == state.mode
        (moved,) = told["/tf"][i].transforms
        assert (moved.header.frame_id, moved.child_frame_id) == ("site", "base")
        place, turn = moved.transform.translation, moved.transform.rotation
        assert bits([place.x, place.y, place.z]) == bits(state.T_site_base[:3, 3])
        assert np.allclose([turn.w, turn.x, turn.y, turn.z], quat_wxyz(state.T_site_base[:3, :3]), atol=1e-12)
        stamp = told[MEASURED][i].header.stamp
        assert 0 <= stamp.nanosec < 10**9
        if abs(state.time) < 2**31 - 1:
            assert stamp.sec + 1e-9 * stamp.nanosec == pytest.approx(state.time, abs=1e-6)


def test_foxgloves_own_libraries_read_the_same(tmp_path):
    frames = moving_frames(7)
    path = tmp_path / "a.mcap"
    path.write_bytes(written(frames))
    told: dict[str, list] = {}
    for one in json.loads(run("foxglove.mjs", str(path))):
        told.setdefault(one["topic"], []).append(one["message"])
    assert {len(several) for several in told.values()} == {len(frames)}
    assert len(told) == PER_FRAME

    def hexadecimal(numbers) -> list[str]:
        return [one.hex() for one in bits(numbers)]

    for i, frame in enumerate(frames):
        state = frame.state
        assert told[MEASURED][i]["position"] == hexadecimal(state.posture)
        assert told[MEASURED][i]["effort"] == hexadecimal(state.joint_torques)
        assert told[MEASURED][i]["name"] == list(JOINTS)
        assert told[COMMANDED][i]["position"] == hexadecimal(frame.commanded)
        assert told[FRAME][i]["number"] == str(frame.number)
        assert told[FRAME][i]["time"] == state.time
        assert told[FRAME][i]["t_site_base"] == hexadecimal(state.T_site_base.ravel())
        assert told[MODE][i] == {"data": state.mode}
        for leg, force in enumerate(state.wheel_forces):
            wrench = told[f"/footfall/leg{leg}/wheel_force"][i]["wrench"]
            assert list(wrench["force"].values()) == force.tolist()
        (moved,) = told["/tf"][i]["transforms"]
        assert list(moved["transform"]["translation"].values()) == state.T_site_base[:3, 3].tolist()


def test_the_definitions_are_complete():
    """Every type that a definition names is a primitive or defined in the same text."""
    summary = make_reader(io.BytesIO(written(moving_frames(1)))).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        assert schema.encoding == "ros2msg"
        first, *others = re.split(r"^=+\n", schema.data.decode(), flags=re.MULTILINE)
        defined = {part.splitlines()[0].removeprefix("MSG: ") for part in others}
        fields = [line.split()[0] for part in (first, *others) for line in part.splitlines() if "MSG:" not in line]
        named = {re.sub(r"\[\d*\]$", "", kind) for kind in fields}
        assert named - defined <= {"int32", "uint32", "uint64", "string", "float64", "uint8"}
        assert defined <= named


def test_images_and_notes_read_back(folder):
    rng = np.random.default_rng(1)
    left, right = rng.integers(0, 256, (2, 12, 16), dtype=np.uint8)
    one = Camera("left", 16, 12, 20.0, 20.0, 8.0, 6.0, np.eye(4))
    other = Camera("right", 16, 12, 20.0, 20.0, 8.0, 6.0, transform(translation=(0.3, 0.0, 0.0)))
    pairs = (
        ImagePair("nav0", 10.0, left, right, one, other, np.eye(4)),
        ImagePair("haz 1/\u00e9", 11.0, right, left, one, other, np.eye(4), 11.125),
    )
    frames = moving_frames(3)
    snapshot = Snapshot(frames[0].state, pairs)
    out = io.BytesIO()
    writer = RecordingWriter(out, JOINTS, ABOUT)
    writer.frame(frames[0], 5)
    writer.images(snapshot, 5)
    writer.note(TO_ROVER, {"type": "stop", "id": "s1"}, 5)
    writer.frame(frames[1], 6)
    writer.finish()
    said = list(opened(out.getvalue(), folder).said())
    assert [one.topic for one in said] == [FRAME, IMAGES, TO_ROVER, FRAME]
    assert isinstance(said[1].content, bytes)
    assert decode_images(said[1].content, legs=6)[1].digest == snapshot.digest
    assert said[2].content == {"type": "stop", "id": "s1"}
    reader = make_reader(io.BytesIO(out.getvalue()), decoder_factories=[DecoderFactory()])
    shown = list(reader.iter_decoded_messages(topics=["/footfall/nav0/left", "/footfall/haz_1__/right"]))
    assert [one[3].format for one in shown] == ["png", "png"]
    assert [one[3].header.stamp.nanosec for one in shown] == [0, 125_000_000]
    with pytest.raises(InvalidTelemetry, match="plain"):
        writer.note(TO_ROVER, {"a": float("nan")}, 7)


def test_a_recording_shows_gaps_and_restarts(folder):
    frames = moving_frames(40)
    kept = [frame for frame in frames if frame.number not in (7, 8, 20)] + moving_frames(5)
    assert opened(written(kept), folder).counts == {"frames": 42, "gaps": 3, "restarts": 1, "dropped": 0}
    cut = written(kept, finish=False)
    out = io.BytesIO()
    assert recover(io.BytesIO(cut), out).counts.gaps == 3


def test_it_begins_where_it_is_asked_to(folder):
    frames = moving_frames(50)
    recording = opened(written(frames), folder)
    assert recording.duration == pytest.approx(4.9)
    assert digests(recording.frames(3.05)) == digests(frames[31:])
    assert list(recording.frames(5.0)) == []


WHOLE = moving_frames(48)
CUT = written(WHOLE)
ENDS = [
    (chunk.chunk_start_offset, chunk.chunk_start_offset + chunk.chunk_length)
    for chunk in make_reader(io.BytesIO(CUT)).get_summary().chunk_indexes  # type: ignore[union-attr]
]


@settings(max_examples=60)
@given(
    at=st.integers(0, len(CUT)) | st.sampled_from([end + d for _, end in ENDS for d in (-1, 0, 1)]), tail=st.binary()
)
def test_cut_anywhere_every_whole_chunk_is_saved(at, tail, folder):
    """``tail``: zeros and rubbish that a disk may show behind the cut."""
    out = io.BytesIO()
    whole = sum(end <= at for _, end in ENDS)
    try:
        saved = recover(io.BytesIO(CUT[:at] + (tail if at < ENDS[-1][1] else b"")), out)
    except InvalidInput:
        assert whole == 0
        return
    assert len(ENDS) > 5
    # rubbish that completes the chunk that was cut by one byte is possible; rubbish that is taken for one is not
    assert saved.chunks in (whole, whole + 1)
    if whole == 0:
        return
    recording = opened(out.getvalue(), folder)
    found = digests(recording.frames())
    assert found == digests(WHOLE)[: len(found)]
    assert PER_FRAME * len(found) == recording.messages == saved.messages
    assert recording.counts["frames"] == saved.counts.frames == len(found)
    again = make_reader(io.BytesIO(out.getvalue()), validate_crcs=True, decoder_factories=[DecoderFactory()])
    assert len(list(again.iter_decoded_messages(topics=[MEASURED]))) == len(found)


def test_a_chunk_is_small():
    """What a cut can cost: a chunk holds few frames."""
    frames = [s.channel_message_counts for s in [make_reader(io.BytesIO(CUT)).get_summary().statistics]]  # type: ignore[union-attr]
    assert max(frames[0].values()) / len(ENDS) < 8
    assert CHUNK == 16384


def test_what_was_cut_opens_without_being_asked(folder):
    assert 0 < len(list(opened(CUT[: ENDS[2][1] + 100], folder).frames())) < 48


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "beginning of an MCAP"), (b"nonsense" * 10, "beginning of an MCAP"), (CUT[:9], "before its first chunk")],
)
def test_what_is_no_recording_is_refused(content, says, folder):
    with pytest.raises(InvalidInput, match=says):
        opened(content, folder)


def test_damage_in_the_middle_is_told(folder):
    start, end = ENDS[3]
    middle = (start + end) // 2
    bad = CUT[:middle] + bytes(255 - one for one in CUT[middle : middle + 20]) + CUT[middle + 20 :]
    with pytest.raises(InvalidInput, match="damaged"):
        list(opened(bad, folder).frames())


WRITER = """
import sys
from tests.support.frames import JOINTS, moving_frames
from footfall.io.recordings.writing import RecordingWriter
with open(sys.argv[1], "wb") as file:
    writer = RecordingWriter(file, JOINTS, {"robot": "athlete", "legs": "6"})
    for i, frame in enumerate(moving_frames(3000)):
        writer.frame(frame, i)
        print(frame.number, flush=True)
"""


def test_kill_nine_loses_at_most_a_chunk(tmp_path):
    path = tmp_path / "telemetry.mcap.part"
    command = [sys.executable, "-c", WRITER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2]) as process:
        assert process.stdout is not None
        last = -1
        while last < 200:
            last = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        last = max([last, *map(int, process.stdout.read().split())])
        assert process.wait(BOUND) == -signal.SIGKILL
    assert last < 2999
    found = list(Recording(path).frames())
    assert [frame.number for frame in found] == list(range(len(found)))
    assert last - 8 <= len(found)
    assert digests(found) == digests(moving_frames(3000)[: len(found)])


def test_numbers_beyond_the_format_are_refused():
    frame = moving_frames(1)[0]
    with pytest.raises(InvalidTelemetry, match="2\\*\\*64"):
        written([TelemetryFrame(2**64, frame.state, frame.commanded)])
