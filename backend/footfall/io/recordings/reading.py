"""Reads recordings: frames bit for bit, images as the rover link carries them, and what else was said."""

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.records import Message

from footfall.core.errors import FootFallError, InvalidInput
from footfall.io.cdr import CdrReader
from footfall.io.recordings import (
    CAMERA_INFO,
    COMMANDED,
    FRAME,
    IMAGES,
    MEASURED,
    MODE,
    wheel_force_topic,
)
from footfall.io.recordings.images import join_images
from footfall.io.recordings.recovery import is_whole, recover
from footfall.io.recordings.writing import ABOUT, COUNTS
from footfall.io.ros2_messages import NS
from footfall.telemetry.state import RobotState, TelemetryFrame


@dataclass(frozen=True)
class Said:
    """One thing that was said. at: when it came, nanoseconds since 1970-01-01 UTC; topic: where it was read.

    content: a frame, the binary frame of the rover link that carries images, or a JSON object.
    """

    at: int
    topic: str
    content: TelemetryFrame | bytes | dict[str, Any]


class Recording:
    """A recording in a file; one that was cut short is recovered in memory first.

    robot, legs: who was recorded; start, end: times of the first and last message [ns]; messages: how many;
    counts: frames, gaps, restarts, dropped; whole: whether its end was written. Raises InvalidInput where the file
    is no recording of FootFall.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.name
        self._content: Path | bytes = path
        try:
            with path.open("rb") as file:
                self.whole = is_whole(file)
                if not self.whole:
                    out = BytesIO()
                    recover(file, out)
                    self._content = out.getvalue()
            with self._stream() as stream:
                self._read_summary(make_reader(stream))
        except FileNotFoundError as err:
            raise InvalidInput(f"there is no recording {path}") from err
        except InvalidInput as err:
            raise InvalidInput(f"{path.name} is no recording: {err.message.removeprefix(f'{path.name} is ')}") from err
        except (McapError, struct.error, ValueError) as err:
            raise InvalidInput(f"{path.name} is no readable recording: {err}") from err

    @property
    def duration(self) -> float:
        """From the first to the last message [s]."""
        return (self.end - self.start) / NS

    def said(self, start: float = 0.0) -> Iterator[Said]:
        """All that came at ``start`` [s] after the beginning, or later, in the order of coming.

        Raises InvalidInput where the recording is damaged, or a frame lacks one of its messages.
        """
        try:
            yield from self._said(self.start + round(start * NS))
        except (FootFallError, OSError):
            raise
        except Exception as err:  # each decompressor has errors of its own
            raise InvalidInput(f"{self.name} is damaged: {err}") from err

    def frames(self, start: float = 0.0) -> Iterator[TelemetryFrame]:
        """The telemetry alone."""
        return (one.content for one in self.said(start) if isinstance(one.content, TelemetryFrame))

    def _said(self, first: int) -> Iterator[Said]:
        with self._stream() as stream:
            gathered: list[tuple[str, Message]] = []
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages(starting_at=first):
                if gathered and gathered[0][1].sequence != message.sequence:
                    gathered = []
                if channel.topic == FRAME:
                    parts = {topic: part.data for topic, part in gathered}
                    yield Said(message.log_time, FRAME, self._frame(message.data, parts))
                elif channel.topic == IMAGES:
                    yield Said(message.log_time, IMAGES, self._images(message.data, gathered))
                elif channel.message_encoding == "json":
                    yield Said(message.log_time, channel.topic, json.loads(message.data))
                else:
                    gathered.append((channel.topic, message))

    def _stream(self) -> IO[bytes]:
        return BytesIO(self._content) if isinstance(self._content, bytes) else self._content.open("rb")

    def _read_summary(self, reader: McapReader) -> None:
        summary = reader.get_summary()
        metadata = {one.name: one.metadata for one in reader.iter_metadata()}
        about, counts = metadata.get(ABOUT), metadata.get(COUNTS)
        if summary is None or summary.statistics is None or about is None or counts is None:
            raise InvalidInput(f"{self.name} is an MCAP file, but no recording of FootFall")
        self.robot, self.legs = about.get("robot", ""), int(about.get("legs", "0"))
        self.start, self.end = summary.statistics.message_start_time, summary.statistics.message_end_time
        self.messages = summary.statistics.message_count
        self.counts = {name: int(count) for name, count in counts.items()}

    def _images(self, header: bytes, gathered: list[tuple[str, Message]]) -> bytes:
        files: list[bytes] = []
        for topic, part in gathered:
            if topic.endswith(f"/{CAMERA_INFO}"):
                continue
            reader = _after_header(part.data)
            reader.string()
            files.append(reader.octets())
        return join_images(header, files)

    def _frame(self, own: bytes, parts: dict[str, bytes]) -> TelemetryFrame:
        reader = CdrReader(own)
        number, robot, time = int(reader.one("Q")), reader.string(), reader.one("d")
        T_site_base = reader.fixed_floats(16).reshape(4, 4)
        try:
            posture, torques = _joints(parts[MEASURED])
            commanded, _ = _joints(parts[COMMANDED])
            mode = CdrReader(parts[MODE]).string()
            forces = [_after_header(parts[wheel_force_topic(leg)]).fixed_floats(3) for leg in range(len(posture) // 6)]
        except KeyError as err:
            raise InvalidInput(f"{self.name}: frame {number} lacks its {err.args[0]}", number=number) from err
        state = RobotState(robot, time, posture, T_site_base, np.array(forces).reshape(-1, 3), torques, mode)
        return TelemetryFrame(number, state, commanded)


def _after_header(data: bytes) -> CdrReader:
    reader = CdrReader(data)
    reader.one("i")
    reader.one("I")
    reader.string()
    return reader


def _joints(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Position and effort of a JointState."""
    reader = _after_header(data)
    for _ in range(int(reader.one("I"))):
        reader.string()
    position = reader.floats()
    reader.floats()
    return position, reader.floats()
