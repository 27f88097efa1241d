"""What a session records of its rover: never in the link's way, a full disk is told once, and a crash loses little."""

import errno
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from footfall.core.errors import NotFound
from footfall.io.recordings import ACKNOWLEDGEMENTS, TO_ROVER, UNFINISHED
from footfall.io.recordings.reading import Recording
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.rover import recorder
from footfall.session.rover.recorder import RecordedRobot, Recorder, RecordingLimits
from footfall.telemetry.state import TelemetryFrame
from tests.support.frames import digests, moving_frames
from tests.support.waiting import BOUND, a_while, until


class Disk:
    """Stands before real files: writes wait while ``free`` is clear, and fail while ``full``."""

    def __init__(self, monkeypatch):
        self.free = threading.Event()
        self.free.set()
        self.asked = threading.Event()
        self.full = False
        self._create = recorder.create
        monkeypatch.setattr(recorder, "create", self.create)

    def create(self, path):
        disk, file = self, self._create(path)

        class Slow:
            def write(self, data):
                disk.asked.set()
                disk.free.wait()
                if disk.full:
                    raise OSError(errno.ENOSPC, "No space left on device")
                return file.write(data)

            def __getattr__(self, name):
                return getattr(file, name)

        return Slow()


@pytest.fixture
def disk(monkeypatch):
    made = Disk(monkeypatch)
    yield made
    made.free.set()


@pytest.fixture
def recorded(tmp_path, athlete):
    """recorded(**limits) → a Recorder in a folder of its own, and what it told."""
    made: list[Recorder] = []

    def make(**limits):
        told: list[tuple[str, str]] = []
        made.append(
            Recorder(
                tmp_path,
                lambda: RecordedRobot(athlete.name, athlete.layout, described=False),
                lambda kind, text: told.append((kind, text)),
                RecordingLimits(**limits),
            )
        )
        return made[-1], told

    yield make
    for one in made:
        one.close()


def frames_in(one: Recorder) -> list[TelemetryFrame]:
    return [frame for path in one.paths() for frame in Recording(path).frames()]


def faults(session) -> list[dict]:
    return [event.payload for event in session.events() if event.type == "link_fault"]


def test_a_session_records_what_it_hears_and_says(session, frame_of):
    sent: list[str] = []
    session.rover.connected(sent.append)
    frames = [frame_of(i, time=100.0 + 0.1 * i, offset=1e-3 * i) for i in range(25) if i not in (4, 5)]
    for frame in frames:
        session.rover.take_telemetry(frame)
        session.rover.take_telemetry(frame)  # a repetition is dropped by the link, and so not recorded
    session.commands.stop("enough")
    session.rover.take_stop_acknowledgement()
    session.rover.take_acknowledgement("c1", "refused", "no")
    session.close()
    (path,) = session.rover.recorder.paths()
    assert path.parent.name == "recordings"
    recording = Recording(path)
    assert digests(recording.frames()) == digests(frames)
    assert recording.counts == {"frames": 23, "gaps": 2, "restarts": 0, "dropped": 0}
    assert recording.counts["gaps"] == session.rover.link.gaps
    objects = [(one.topic, one.content) for one in recording.said() if isinstance(one.content, dict)]
    assert [topic for topic, _ in objects] == [TO_ROVER, ACKNOWLEDGEMENTS, ACKNOWLEDGEMENTS]
    assert objects[0][1]["type"] == "stop"
    assert objects[1][1]["type"] == "stop_ack"
    assert objects[2][1] == {"type": "ack", "id": "c1", "state": "refused", "reason": "no"}
    assert faults(session) == []


def test_recordings_are_no_part_of_the_bundle(sessions, session, frame_of):
    session.rover.take_telemetry(frame_of(0))
    session.close()
    copy = sessions.import_bundle(sessions.export_bundle(session.id))
    assert session.rover.recorder.paths() != []
    assert copy.rover.recorder.paths() == []


def test_when_it_came_is_recorded(recorded):
    one, _ = recorded()
    before, now = time.time(), time.monotonic()
    for i, frame in enumerate(moving_frames(5)):
        one.take(frame, now - 10.0 + i)
    one.close()
    recording = Recording(one.paths()[0])
    assert recording.start / 1e9 == pytest.approx(before - 10.0, abs=1.0)
    assert recording.duration == pytest.approx(4.0, abs=1e-6)


def test_a_slow_disk_is_never_waited_for(session, disk, frame_of):
    disk.free.clear()
    frames = [frame_of(i, time=100.0 + 0.1 * i) for i in range(600)]
    session.rover.take_telemetry(frames[0])
    assert disk.asked.wait(BOUND)
    for frame in frames[1:]:
        session.rover.take_telemetry(frame)  # whoever waited for this disk would wait for ever
    assert session.rover.frame is frames[-1]
    assert session.rover.recorder.dropped == 600 - 256 - 1
    disk.free.set()
    session.close()
    (path,) = session.rover.recorder.paths()
    recording = Recording(path)
    found = list(recording.frames())
    assert digests(found[-256:]) == digests(frames[-256:])
    assert len(found) + session.rover.recorder.dropped == 600
    assert recording.counts["dropped"] == recording.counts["gaps"] == session.rover.recorder.dropped
    assert session.rover.link.gaps == 0


def test_closing_does_not_wait_for_a_dead_disk(session, disk, frame_of, monkeypatch):
    monkeypatch.setattr(recorder, "LAST_WORDS", 0.2)
    disk.free.clear()
    session.rover.take_telemetry(frame_of(0))
    session.close()
    assert not disk.free.is_set()


def test_a_full_disk_is_told_once_and_the_session_goes_on(session, disk, frame_of, monkeypatch):
    monkeypatch.setattr(recorder, "TRY_AGAIN_AFTER", 0.05)
    monkeypatch.setattr(recorder, "FLUSH_AFTER", 0.05)
    disk.full = True
    for i in range(30):
        session.rover.take_telemetry(frame_of(i, time=100.0 + 0.1 * i))
        a_while(0.02)
    until(lambda: session.rover.recorder.dropped >= 20, "the counting of what is lost")
    (fault,) = faults(session)
    assert fault == {"id": "", "reason": "telemetry is not recorded: No space left on device", "source": "recorder"}
    assert "No space left" in session.rover.link.as_dict()["fault"]
    assert session.rover.link.frames == 30
    disk.full = False
    a_while(0.1)
    frames = [frame_of(100 + i, time=200.0 + 0.1 * i) for i in range(10)]
    for frame in frames:
        session.rover.take_telemetry(frame)
    until(lambda: session.rover.recorder.paths(), "the next recording")
    session.close()
    assert digests(frames_in(session.rover.recorder))[-10:] == digests(frames)
    assert len(frames_in(session.rover.recorder)) + session.rover.recorder.dropped == 40
    assert len(faults(session)) == 1


def test_a_folder_that_cannot_be_written_is_a_fault(session, frame_of):
    (Path(session.store.folder) / "recordings").write_text("in the way")
    session.rover.take_telemetry(frame_of(0))
    (fault,) = until(lambda: faults(session), "the fault")
    assert "telemetry is not recorded" in fault["reason"]
    session.rover.take_telemetry(frame_of(1, time=1.0))
    assert session.rover.frame.number == 1


def test_it_goes_on_in_the_next_file_and_removes_the_oldest(recorded):
    one, told = recorded(file_bytes=20_000, session_bytes=70_000, waiting=10_000)
    frames = moving_frames(200)
    for frame in frames:
        one.take(frame)
    one.close()
    sizes = [path.stat().st_size for path in one.paths()]
    assert 2 <= len(sizes) <= 4
    assert max(sizes) < 40_000
    assert sum(sizes) <= 70_000 + max(sizes)
    found = frames_in(one)
    assert digests(found) == digests(frames[-len(found) :])
    assert told == []
    assert one.dropped == 0


def test_nothing_is_recorded_where_it_is_turned_off(tmp_path, tiny, athlete, frame_of):
    with Sessions(tmp_path / "sessions", InlineJobs("tiny_recipes"), athlete, recording=None) as off:
        live = off.create("test")
        live.rover.take_telemetry(frame_of(0))
        assert live.rover.frame is not None
        assert live.rover.recorder.paths() == []


def test_every_chunk_is_on_the_disk_when_it_is_closed(recorded, monkeypatch):
    """fsync is called when all that was recorded so far can be read back from the file."""
    found: list[int] = []
    fsync = os.fsync

    def note(number: int) -> None:
        # the log of the session is written by other threads meanwhile
        if threading.current_thread().name == "footfall-recorder":
            (path,) = one.paths()
            found.append(len(list(Recording(path).frames())))
        fsync(number)

    monkeypatch.setattr(recorder.os, "fsync", note)
    one, _ = recorded(waiting=10_000)
    for frame in moving_frames(60):
        one.take(frame)
    one.close()
    assert len(found) > 60 // 6
    assert found == sorted(found)
    assert found[-1] == 60
    assert max(after - before for before, after in itertools.pairwise([0, *found])) <= 6


def test_names_are_those_of_the_folder(recorded):
    one, _ = recorded()
    one.take(moving_frames(1)[0])
    one.close()
    (path,) = one.paths()
    assert one.path(path.name) == path
    for name in ("../session.json", "", path.name + ".part", "events.jsonl"):
        with pytest.raises(NotFound):
            one.path(name)


KILLED = """
import sys, time
sys.path.insert(0, sys.argv[1])
from footfall.io.robot_files import load_robot
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.frames import moving_frames
session = Sessions(sys.argv[2], jobs=InlineJobs("tiny_recipes")).create("killed")
print(session.id, flush=True)
for frame in moving_frames(2000, robot=session.description.name):
    session.rover.take_telemetry(frame)
    print(frame.number, flush=True)
    time.sleep(0.002)
"""


def test_after_kill_nine_the_recording_is_saved_when_the_session_is_opened_again(tmp_path, tiny):
    folder = tmp_path / "sessions"
    command = [sys.executable, "-c", KILLED, str(Path(__file__).parent), str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2]) as process:
        assert process.stdout is not None
        name = process.stdout.readline().strip()
        last = -1
        while last < 100:
            last = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        process.stdout.read()
    (left,) = (folder / name / "recordings").iterdir()
    assert left.name.endswith(UNFINISHED)
    with Sessions(folder, jobs=InlineJobs("tiny_recipes")) as sessions:
        live = sessions.open(name)
        told = until(
            lambda: [e.payload["text"] for e in live.events() if e.type == "log_repaired"], "the news of what was saved"
        )
        (path,) = live.rover.recorder.paths()
        assert not path.name.endswith(UNFINISHED)
        found = list(Recording(path).frames())
        assert last - 20 <= len(found)
        assert digests(found) == digests(moving_frames(2000)[: len(found)])
        assert told[0].startswith(
            f"the recording {path.name} was cut short: {len(found)} frames, {11 * len(found)} messages"
        )
        # it goes on in a file of its own
        live.rover.take_telemetry(moving_frames(1, first=5000)[0])
        live.close()
        assert len(live.rover.recorder.paths()) == 2
    with Sessions(folder, jobs=InlineJobs("tiny_recipes")) as sessions:
        again = sessions.open(name)
        assert len([e for e in again.events() if e.type == "log_repaired"]) == 1


def test_what_holds_nothing_is_removed(tmp_path, recorded):
    (tmp_path / "recordings").mkdir()
    left = tmp_path / "recordings" / f"telemetry-00001-20260101-000000{UNFINISHED}"
    left.write_bytes(b"\x89MCAP")
    one, told = recorded()
    until(lambda: told, "the news")
    assert one.paths() == []
    assert "was removed" in told[0][1]
