"""Reads recordings: frames bit for bit, images as the rover link carries them, and what else was said."""

import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import McapReader, NonSeekingReader, make_reader
from mcap.records import Message
from mcap.summary import Summary

from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.json_object import JsonObject
from footfall.io.cdr import CdrReader
from footfall.io.recordings import (
    CAMERA_INFO,
    COMMANDED,
    DROPPED,
    FRAME,
    IMAGES,
    MEASURED,
    MODE,
    TF,
    TF_STATIC,
    object_of,
    wheel_force_topic,
)
from footfall.io.recordings.continuity import Continuity
from footfall.io.recordings.images import join_images
from footfall.io.recordings.recovery import is_whole, recover
from footfall.io.recordings.writing import ABOUT, COUNTS, JOINTS
from footfall.io.ros2_messages import NS, TEXT
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link_state import layout_from
from footfall.telemetry.state import RobotState, TelemetryFrame


@dataclass(frozen=True)
class Said:
    """One thing that was said. at: when it came, nanoseconds since 1970-01-01 UTC; topic: where it was read.

    content: a frame, the binary frame of the rover link that carries images, or a JSON object: of images that were
    taken out of the file by another tool, their header.
    """

    at: int
    topic: str
    content: TelemetryFrame | bytes | JsonObject


class Recording:
    """A recording in a file; one that was cut short is recovered in memory first.

    robot, legs: who was recorded; described: its legs and joints where others described it; start, end: times of the
    first and last message [ns]; messages: how many; counts: frames, gaps, restarts, dropped; whole: whether its end was
    written. Raises InvalidInput where the file is no recording of FootFall.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.name
        self._content: Path | bytes = path
        self._indexed = True
        try:
            with path.open("rb") as file:
                self.whole = is_whole(file)
                if not self.whole:
                    out = BytesIO()
                    recover(file, out)
                    self._content = out.getvalue()
            with self._stream() as stream:
                self._read_summary(stream)
        except FileNotFoundError as err:
            raise InvalidInput(f"there is no recording {path}") from err
        except InvalidInput as err:
            raise InvalidInput(f"{path.name} is no recording: {err.message.removeprefix(f'{path.name} is ')}") from err
        except (McapError, struct.error, ValueError) as err:
            raise InvalidInput(f"{path.name} is no readable recording: it is damaged, or no MCAP file") from err

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
            raise InvalidInput(f"{self.name} is damaged or cut") from err

    def frames(self, start: float = 0.0) -> Iterator[TelemetryFrame]:
        """The telemetry alone."""
        return (one.content for one in self.said(start) if isinstance(one.content, TelemetryFrame))

    def _said(self, first: int) -> Iterator[Said]:
        with self._stream() as stream:
            gathered: list[tuple[str, Message]] = []
            for schema, channel, message in self._reader(stream).iter_messages(starting_at=first):
                if gathered and gathered[0][1].sequence != message.sequence:
                    gathered = []
                if channel.topic == FRAME:
                    parts = {topic: part.data for topic, part in gathered}
                    yield Said(message.log_time, FRAME, frame_of(self.name, message.data, parts, self.described))
                elif channel.topic == IMAGES:
                    yield Said(message.log_time, IMAGES, self._images(channel.message_encoding, message.data, gathered))
                elif channel.message_encoding == "json" or (
                    schema is not None and schema.name == TEXT and channel.topic != MODE
                ):
                    body = object_of(channel.message_encoding, message.data)
                    yield Said(message.log_time, channel.topic, body)
                else:
                    gathered.append((channel.topic, message))

    def _stream(self) -> IO[bytes]:
        return BytesIO(self._content) if isinstance(self._content, bytes) else self._content.open("rb")

    def _reader(self, stream: IO[bytes]) -> McapReader:
        return (
            make_reader(stream, validate_crcs=True) if self._indexed else NonSeekingReader(stream, validate_crcs=True)
        )

    def _read_summary(self, stream: IO[bytes]) -> None:
        """What the file's end says; where a tool left some of that out, all of it is read."""
        reader = make_reader(stream)
        summary = reader.get_summary()
        self._indexed = _is_complete(summary)
        if not self._indexed:
            stream.seek(0)
            reader = NonSeekingReader(stream)
        metadata = {one.name: one.metadata for one in reader.iter_metadata()}
        about, counts = metadata.get(ABOUT), metadata.get(COUNTS)
        if about is None:
            raise InvalidInput(f"{self.name} is an MCAP file, but no recording of FootFall")
        self.robot, self.legs = about.get("robot", ""), int(about.get("legs", "0"))
        self.described = described_in(about)
        if summary is not None and summary.statistics is not None and self._indexed and counts is not None:
            self.start, self.end = summary.statistics.message_start_time, summary.statistics.message_end_time
            self.messages = summary.statistics.message_count
            self.counts = {name: int(count) for name, count in counts.items()}
        else:
            self._count(stream)

    def _count(self, stream: IO[bytes]) -> None:
        times: list[int] = []
        counted = Continuity()
        stream.seek(0)
        for _, channel, message in NonSeekingReader(stream).iter_messages():
            times.append(message.log_time)
            if channel.topic == FRAME:
                counted.take(int(CdrReader(message.data).one("Q")))
            elif channel.topic == DROPPED:
                counted.dropped += int(object_of(channel.message_encoding, message.data)["dropped"])
        self.start, self.end, self.messages = min(times, default=0), max(times, default=0), len(times)
        self.counts = counted.as_dict()

    def _images(self, encoding: str, content: bytes, gathered: list[tuple[str, Message]]) -> bytes | JsonObject:
        header = content if encoding == "json" else CdrReader(content).string().encode()
        files: list[bytes] = []
        for topic, part in gathered:
            if topic in (TF, TF_STATIC) or topic.endswith(f"/{CAMERA_INFO}"):
                continue
            reader = _after_header(part.data)
            reader.string()
            files.append(reader.octets())
        return join_images(header, files) if files else json.loads(header)


def described_in(about: Mapping[str, str]) -> JointLayout | None:
    """Legs and joints of whom was recorded, of a recording's metadata; None where it is of ATHLETE's build.

    Raises InvalidInput where they can't be read.
    """
    said = about.get(JOINTS)
    if said is None:
        return None
    try:
        body = json.loads(said)
    except ValueError as err:
        raise InvalidInput("the joints of the robot that was recorded are no JSON") from err
    if not isinstance(body, dict):
        raise InvalidInput("the joints of the robot that was recorded are no JSON object")
    return layout_from(body)


def frame_of(name: str, own: bytes, parts: Mapping[str, bytes], described: JointLayout | None = None) -> TelemetryFrame:
    """A frame of the recording ``name``: its own message, and those before it by their topics.

    described: legs and joints of a robot that others described; None: it is of ATHLETE's build.

    Raises InvalidInput where one of them is not there, or can't be read.
    """
    reader = CdrReader(own)
    number, robot, time = int(reader.one("Q")), reader.string(), reader.one("d")
    T_site_base = reader.fixed_floats(16).reshape(4, 4)
    try:
        posture, torques = _joints(parts[MEASURED])
        commanded, _ = _joints(parts[COMMANDED])
        mode = CdrReader(parts[MODE]).string()
        legs = len(posture) // 6 if described is None else len(described.legs)
        forces = [_after_header(parts[wheel_force_topic(leg)]).fixed_floats(3) for leg in range(legs)]
    except KeyError as err:
        raise InvalidInput(f"{name}: frame {number} lacks its {err.args[0]}", number=number) from err
    pressed = np.array(forces).reshape(-1, 3)
    state = RobotState(robot, time, posture, T_site_base, pressed, torques, mode, described=described)
    return TelemetryFrame(number, state, commanded)


def _is_complete(summary: Summary | None) -> bool:
    """Whether a summary has all that is read by it: statistics, indexes, and the channels and schemas once more."""
    if summary is None or summary.statistics is None or not summary.metadata_indexes:
        return False
    statistics = summary.statistics
    return (
        len(summary.chunk_indexes) == statistics.chunk_count
        and (statistics.chunk_count > 0 or statistics.message_count == 0)
        and set(statistics.channel_message_counts) <= set(summary.channels)
        and all(one.schema_id in {0, *summary.schemas} for one in summary.channels.values())
    )


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
