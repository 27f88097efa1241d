"""What the rover said in a whole session, told short from its recordings: no peak lost, silences told, read on."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_rpy, transform
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.recovery import recover
from footfall.io.recordings.track import SILENCE, Track
from footfall.io.recordings.writing import RecordingWriter
from footfall.io.ros2_messages import NS
from footfall.session.reading import ReadingProcess
from footfall.session.rover import recorded as whole
from footfall.session.rover.recorded import Tracks, recorded
from footfall.telemetry.state import TelemetryFrame
from tests.support.frames import JOINTS, moving_frames

T0 = 1.7e9
CHANNELS = [("torque", 13), ("position", 0), ("force", 2), ("tilt", 0), ("interval", 0)]


def written(path: Path, frames, times, finished=True) -> Path:
    with path.open("wb") as file:
        writer = RecordingWriter(file, JOINTS, {"robot": "athlete", "legs": "6"})
        for frame, at in zip(frames, times, strict=True):
            writer.frame(frame, round(at * NS))
        if finished:
            writer.finish()
        else:
            writer.flush()
    return path


def named(folder: Path, number: int, suffix=".mcap") -> Path:
    return folder / f"telemetry-{number:05}-20261127-000000{suffix}"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Three recordings of 100 frames, a pause of a minute in the second; the last one is being written."""
    folder = tmp_path_factory.mktemp("recordings")
    times = T0 + 0.1 * np.arange(300) + np.where(np.arange(300) >= 150, 60.0, 0.0)
    frames = moving_frames(300)
    return [
        written(named(folder, 1), frames[:100], times[:100]),
        written(named(folder, 2), frames[100:200], times[100:200]),
        written(named(folder, 3, ".mcap.part"), frames[200:], times[200:], finished=False),
    ]


@pytest.fixture(scope="module")
def told_by_reading(files):
    """Times, and each channel at them, by reading the files frame by frame as `footfall replay` does."""
    said = [
        (one.at / NS, one.content.state, file)
        for file, path in enumerate(files)
        for one in Recording(path).said()
        if isinstance(one.content, TelemetryFrame)
    ]
    times = np.array([at for at, *_ in said])
    tilts = [np.arctan2(np.hypot(*s.T_site_base[:2, 2]), s.T_site_base[2, 2]) for _, s, *_ in said]
    intervals = [
        np.nan if i == 0 or said[i - 1][2] != said[i][2] else times[i] - times[i - 1] for i in range(len(said))
    ]
    columns = [
        [s.joint_torques[13] for _, s, *_ in said],
        [s.posture[0] for _, s, *_ in said],
        [s.wheel_forces[2, 2] for _, s, *_ in said],
        tilts,
        intervals,
    ]
    return times, np.array(columns)


def all_of(paths, channels=CHANNELS, begin=None, end=None, parts=1000, most=1 << 30):
    return Tracks().looked_at(paths, channels, begin, end, parts, most)


def test_every_frame_is_told_where_there_is_room(files, told_by_reading):
    times, columns = told_by_reading
    told = all_of(files, begin=times[100] - 0.05, end=times[149] + 0.05, parts=1000)
    assert told.times == pytest.approx(times[99:151], abs=1e-6)
    numbers = np.array(told.numbers, float)
    assert numbers == pytest.approx(columns[:, 99:151], rel=1e-5, nan_ok=True)
    assert (told.begin, told.end, told.unread, told.damaged) == (
        pytest.approx(times[0]),
        pytest.approx(times[-1]),
        0,
        (),
    )


@given(st.floats(0, 0.9), st.floats(0.01, 1), st.integers(1, 40))
def test_each_part_has_the_extremes_of_its_frames(files, told_by_reading, first, share, parts):
    times, columns = told_by_reading
    begin = times[0] + first * (times[-1] - times[0])
    end = begin + share * (times[-1] - begin) + 0.01
    told = all_of(files, begin=begin, end=end, parts=parts)
    moments, numbers = np.array(told.times), np.array(told.numbers, float)
    assert (np.diff(moments) >= 0).all()
    assert len(moments) <= 2 * parts + 4
    inside = (times >= begin) & (times <= end)
    kept = (moments >= begin - 1e-6) & (moments <= end + 1e-6)
    for told_column, column in zip(numbers, columns, strict=True):
        own = column[inside]
        if np.isfinite(own).any():
            assert np.nanmin(told_column[kept]) == pytest.approx(np.nanmin(own), rel=1e-5)
            assert np.nanmax(told_column[kept]) == pytest.approx(np.nanmax(own), rel=1e-5)


def test_a_peak_among_blocks_of_frames_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(whole, "FINE", 1)
    frames = moving_frames(200)
    peak = np.array(frames[57].state.joint_torques)
    peak[13] = 7e5
    frames[57] = replace(frames[57], state=replace(frames[57].state, joint_torques=peak))
    times = T0 + 0.1 * np.arange(200) + np.where(np.arange(200) >= 58, 30.0, 0.0)
    paths = [
        written(named(tmp_path, 1), frames[:100], times[:100]),
        written(named(tmp_path, 2), frames[100:], times[100:]),
    ]
    tracks = Tracks()
    told = tracks.looked_at(paths, [("torque", 13)], None, None, 1000, 1 << 30)
    at = int(np.argmax(np.array(told.numbers[0], float)))
    assert told.numbers[0][at] == np.float32(7e5)
    assert told.times[at] == pytest.approx(times[57], abs=1.0)  # before the silence that follows it
    assert len(told.times) < 60, "blocks of frames"
    near = tracks.looked_at(paths[:1], [("torque", 13)], None, None, 1000, 1 << 30)
    assert len(near.times) == 100, "every frame again, where few files are looked at"


def test_silences_are_told_as_long_as_they_can_be_seen(files, told_by_reading):
    times, _ = told_by_reading
    pauses = [(a, b) for a, b in pairwise(times) if b - a > SILENCE]
    assert all_of(files).silences == tuple((pytest.approx(a), pytest.approx(b)) for a, b in pauses)
    assert len(pauses) == 1
    inside = all_of(files, begin=pauses[0][0] + 20, end=pauses[0][0] + 40)
    assert len(inside.silences) == 1, "also where a plot has nothing else in it"
    assert all_of(files, begin=times[0] - 1e4, end=times[-1] + 1e4, parts=10).silences == ()


def test_it_is_read_by_and_by_and_says_how_much_is_left(files):
    tracks = Tracks()
    counts, left = [], []
    for _ in range(100):
        told = tracks.looked_at(files, CHANNELS[:1], None, None, 1000, 20_000)
        counts.append(len(told.times))
        left.append(told.unread)
        if not told.unread:
            break
    assert left[0] > 0
    assert left[-1] == 0
    assert left == sorted(left, reverse=True)
    assert len(left) > 3
    assert counts == sorted(counts)
    assert told.numbers == all_of(files, CHANNELS[:1]).numbers


def test_a_file_that_grows_and_is_finished_is_read_on(tmp_path):
    tracks, part = Tracks(), named(tmp_path, 1, ".mcap.part")
    with part.open("wb") as file:
        writer = RecordingWriter(file, JOINTS, {"robot": "athlete", "legs": "6"})
        for number, frame in enumerate(moving_frames(40)):
            writer.frame(frame, round((T0 + number) * NS))
            if number == 19:
                writer.flush()
                file.write(b"\x06half a chunk")
                file.flush()
                assert len(tracks.looked_at([part], CHANNELS[:1], None, None, 1000).times) == 20
                with part.open("rb") as source, named(tmp_path, 9).open("wb") as target:
                    recover(source, target)
                file.seek(-13, 1)
                file.truncate()
        writer.finish()
    finished = part.rename(named(tmp_path, 1))
    told = tracks.looked_at([finished], CHANNELS[:1], None, None, 1000)
    assert told.times == pytest.approx(T0 + np.arange(40), abs=1e-6)
    assert told.damaged == ()
    assert len(all_of([named(tmp_path, 9)], CHANNELS[:1]).times) == 20, "one that was saved"


def test_a_damaged_file_is_told_with_what_is_whole_of_it(tmp_path, files):
    content = bytearray(files[0].read_bytes())
    content[len(content) // 2] ^= 0xFF
    broken = named(tmp_path, 1)
    broken.write_bytes(content)
    told = all_of([broken], CHANNELS[:1])
    assert told.damaged == (broken.name,)
    assert 0 < len(told.times) < 100
    assert told.unread == 0


def test_files_outside_of_the_plot_are_not_read(files):
    tracks = Tracks()
    told = tracks.looked_at(files, CHANNELS[:1], T0 + 70, None, 1000, 1 << 30)
    assert told.unread == 0
    assert [path.name for path in tracks.read] == [files[1].name, "telemetry-00003-20261127-000000.mcap"]


def test_nothing_was_recorded(tmp_path):
    (named(tmp_path, 1, ".mcap.part")).write_bytes(b"")
    told = all_of([named(tmp_path, 1, ".mcap.part"), named(tmp_path, 2)], CHANNELS)
    assert (told.begin, told.end, told.times, told.silences) == (None, None, (), ())
    assert told.numbers == ((),) * len(CHANNELS)


@pytest.mark.parametrize("channel", [("speed", 0), ("torque", 36), ("tilt", 1)])
def test_what_is_no_channel_is_refused(files, channel):
    with pytest.raises(InvalidInput, match=channel[0]):
        all_of(files, [channel])
    with pytest.raises(InvalidInput, match="before it begins"):
        all_of(files, begin=T0 + 1, end=T0 + 1)


def test_what_is_forgotten_is_coarse_and_what_is_not_whole_stays(files):
    track = Track()
    track.read_on(files[2], 1 << 30)
    track.forget()
    assert not track.forgotten
    assert len(track.fine[0]) == 100
    first = Track()
    first.read_on(files[0], 1 << 30)
    coarse = first.coarse
    first.forget()
    assert first.coarse is coarse
    assert len(first.fine[1]) == 0
    assert len(first.times) == 100


def test_tilt_is_the_angle_of_the_chassis_from_the_vertical(tmp_path):
    frames = [
        replace(one, state=replace(one.state, T_site_base=transform(rotation_rpy(0.3, 0.0, yaw), [0, 0, 1])))
        for yaw, one in enumerate(moving_frames(3))
    ]
    told = all_of([written(named(tmp_path, 1), frames, [T0, T0 + 1, T0 + 2])], [("tilt", 0)])
    assert told.numbers[0] == pytest.approx([0.3] * 3, abs=1e-6)


def test_a_process_apart_reads_them(files):
    reading = ReadingProcess(readers=(recorded.__module__,))
    try:
        told = reading(recorded, files, CHANNELS, None, None, 500)
        assert told.numbers == all_of(files, parts=500).numbers
    finally:
        reading.close()
