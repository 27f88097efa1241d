"""Recordings are read anew: counted, and held against the rules of the link."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.io.recordings import TO_ROVER
from footfall.io.recordings.writing import RecordingWriter
from footfall.session.replay.recordings import MOST_PROBLEMS, UNHEARD, replay_recording
from footfall.session.rover.recorder import acknowledgement
from footfall.telemetry.link import ClearStopMessage, CommandMessage, EpochMessage, Message, StopMessage, message_object
from footfall.telemetry.state import TelemetryFrame
from tests.support.command_line import run
from tests.support.frames import JOINTS, moving_frames

ABOUT = {"robot": "athlete", "legs": "6", "session": "test"}
PERIOD = 100_000_000
FRAMES = moving_frames(40)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recordings")


def recorded(folder: Path, write: Callable[[RecordingWriter], None], finish: bool = True) -> Path:
    out = io.BytesIO()
    write(writer := RecordingWriter(out, JOINTS, ABOUT))
    if finish:
        writer.finish()
    else:
        writer.flush()
    path = folder / "telemetry-00001.mcap"
    path.write_bytes(out.getvalue())
    return path


def told(writer: RecordingWriter, message: Message, at: int = 0) -> None:
    writer.note(TO_ROVER, message_object(message), at)


def command(name: str) -> CommandMessage:
    return CommandMessage(name, "s" * 32, 0, "wait", None, None, 1.0)


def heard(writer: RecordingWriter, name: str, state: str) -> None:
    topic, body = acknowledgement("ack", name, state)
    writer.note(topic, body, 0)


def all_frames(writer: RecordingWriter, frames: list[TelemetryFrame]) -> None:
    for i, frame in enumerate(frames):
        writer.frame(frame, i * PERIOD)


NUMBERS = st.integers(0, 60) | st.sampled_from([10**7, 2**53 - 1])


@settings(max_examples=25)
@given(numbers=st.lists(NUMBERS, min_size=1, max_size=15), lost=st.integers(0, 5))
def test_frames_are_counted_as_they_are_numbered(numbers, lost, folder):
    """A second count: sets of numbers instead of one number after the other."""

    def write(writer: RecordingWriter) -> None:
        if lost:
            writer.dropped(lost, 0)
        for i, number in enumerate(numbers):
            frame = FRAMES[i]
            writer.frame(replace(frame, number=number), i * PERIOD)

    report = replay_recording(recorded(folder, write))
    anew = [i for i in range(1, len(numbers)) if not 0 < numbers[i] - numbers[i - 1] <= 864_000]
    begins = [0, *anew, len(numbers)]
    spans = [numbers[a:b] for a, b in pairwise(begins)]
    gaps = sum(len(set(range(span[0], span[-1] + 1)) - set(span)) for span in spans)
    assert report.counts == {"frames": len(numbers), "gaps": gaps, "restarts": len(spans) - 1, "dropped": lost}
    assert report.ok, report.problems


def test_the_digest_is_of_what_was_said(folder):
    def digest(frames: list[TelemetryFrame]) -> str:
        return replay_recording(recorded(folder, lambda writer: all_frames(writer, frames))).digest

    assert digest(FRAMES) == digest(FRAMES)
    assert digest(FRAMES) != digest(FRAMES[:-1])
    posture = FRAMES[7].state.posture.copy()
    posture[3] = np.nextafter(posture[3], 9.0)
    other = replace(FRAMES[7], state=replace(FRAMES[7].state, posture=posture))
    assert digest(FRAMES) != digest([*FRAMES[:7], other, *FRAMES[8:]])


def test_what_became_of_commands(folder):
    def write(writer: RecordingWriter) -> None:
        heard(writer, "earlier", "done")
        for name in ("a", "b", "c"):
            told(writer, command(name))
        for state in ("received", "started", "done"):
            heard(writer, "a", state)
        heard(writer, "b", "refused")
        told(writer, StopMessage("s1"))
        told(writer, StopMessage("s1"))  # told again until it is acknowledged
        told(writer, ClearStopMessage("c1"))
        told(writer, command("d"))
        heard(writer, "d", "started")

    report = replay_recording(recorded(folder, write))
    assert report.commands == {"done": 1, "refused": 1, "started": 1, UNHEARD: 1}
    assert (report.stops, report.strangers) == (1, 1)
    assert report.ok, report.problems


def test_a_command_of_an_older_epoch_is_told_and_recordings_that_know_none_are_read(folder):
    def write(writer: RecordingWriter) -> None:
        told(writer, EpochMessage("h", 4))
        told(writer, replace(command("a"), epoch=4))
        told(writer, StopMessage("s1", 5))
        told(writer, ClearStopMessage("s1", 5))
        told(writer, replace(command("b"), epoch=4))
        older = message_object(command("c"))
        del older["epoch"]
        writer.note(TO_ROVER, older, 5 * PERIOD)

    problems = replay_recording(recorded(folder, write)).problems
    assert problems == ("command b was sent in epoch 4, after one of epoch 5",)


def test_what_must_not_be_is_told(folder):
    def write(writer: RecordingWriter) -> None:
        told(writer, command("a"))
        told(writer, command("a"))
        told(writer, StopMessage("s1"))
        told(writer, command("b"))
        back = replace(FRAMES[1], state=replace(FRAMES[1].state, time=FRAMES[0].state.time - 2.0))
        all_frames(writer, [FRAMES[0], back])
        writer.frame(replace(FRAMES[2], state=replace(FRAMES[2].state, robot="other")), 2 * PERIOD)

    path = recorded(folder, write)
    report = replay_recording(path)
    assert not report.ok
    for words in ("command a was sent twice", "command b was sent after a stop", "went back by 2.000 s", "is of other"):
        assert any(words in text for text in report.problems), words
    document = json.loads(run("replay", path, "--json", code=1).stdout)
    assert document["ok"] is False
    assert document["recordings"][str(path)]["problems"] == list(report.problems)


def test_counts_of_its_end_are_not_believed(folder):
    def write(writer: RecordingWriter) -> None:
        all_frames(writer, FRAMES[:5])
        writer.counts.frames += 1

    (problem,) = replay_recording(recorded(folder, write)).problems
    assert "6 frames" in problem
    assert "5 frames" in problem


def test_many_problems_are_counted(folder):
    def write(writer: RecordingWriter) -> None:
        for _ in range(MOST_PROBLEMS + 8):
            told(writer, command("a"))

    problems = replay_recording(recorded(folder, write)).problems
    assert len(problems) == MOST_PROBLEMS + 1
    assert problems[-1] == "and 7 more"


def test_one_that_was_cut_or_is_damaged(folder):
    path = recorded(folder, lambda writer: all_frames(writer, FRAMES), finish=False)
    report = replay_recording(path)
    assert report.cut
    assert report.ok
    assert report.counts["frames"] == len(FRAMES)
    assert "cut short" in run("replay", path).stdout

    path = recorded(folder, lambda writer: all_frames(writer, FRAMES))
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0xFF
    path.write_bytes(content)
    assert not replay_recording(path).ok

    path.write_bytes(b"no recording")
    with pytest.raises(InvalidInput, match=r"telemetry-00001\.mcap is no recording"):
        replay_recording(path)
    assert run("replay", path, code=2)
