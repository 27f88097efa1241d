"""Writes recordings: small chunks of whole frames, each handed to the system as soon as it is full."""

from collections.abc import Callable, Mapping
from typing import IO, Any

from mcap.writer import CompressionType, Writer

from footfall.io.recordings import DROPPED
from footfall.io.recordings.continuity import Continuity
from footfall.io.recordings.messages import Written, form_of, of_frame, of_images, of_object
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import TelemetryFrame

CHUNK = 16 << 10
"""A chunk is closed as soon as it holds this much before compression [bytes]: about four frames of six legs."""
ABOUT, COUNTS = "footfall", "footfall_counts"
"""Names of the metadata: at the beginning who was recorded, at the end the continuity."""
JOINTS = "joints"
"""Of whom was recorded: legs and joints as the rover link names them, of a robot that others described alone."""
_ENDLESS = 1 << 62
_MESSAGE_OVERHEAD = 31


class RecordingWriter:
    """Writes to ``stream``, which stays open. Not thread-safe; OSError of the stream is raised as it is.

    joint_names: of the robot, leg by leg. about: who is recorded, texts. sync: called behind each chunk, when it has
    gone to the stream: to have it on the disk.
    unsaved: how many things are in the chunk under way, which a kill would lose; counts: what was recorded.
    Times ``at`` are when a thing came, nanoseconds since 1970-01-01 UTC; they must not run backwards.
    """

    def __init__(
        self,
        stream: IO[bytes],
        joint_names: tuple[str, ...],
        about: Mapping[str, str],
        sync: Callable[[], object] = lambda: None,
    ) -> None:
        self.counts = Continuity()
        self._sync = sync
        self._stream = stream
        self._names = joint_names
        # chunks are closed here, behind whole frames, not by the writer
        self._writer = Writer(stream, chunk_size=_ENDLESS, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="footfall")
        self._writer.add_metadata(ABOUT, dict(about))
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._group = 0
        self._pending = 0
        self.unsaved = 0

    @property
    def size(self) -> int:
        """Bytes written so far, without the chunk under way."""
        return self._stream.tell()

    def frame(self, frame: TelemetryFrame, at: int) -> None:
        """Record a frame. Raises InvalidTelemetry where its number is too large for the format."""
        self._add(at, of_frame(frame, self._names))
        self.counts.take(frame.number)

    def images(self, snapshot: Snapshot, at: int) -> None:
        """Record images."""
        self._add(at, of_images(snapshot))

    def note(self, topic: str, body: Mapping[str, Any], at: int) -> None:
        """Record a JSON object on a topic of its own. Raises InvalidTelemetry for what is no JSON."""
        self._add(at, of_object(topic, body))

    def dropped(self, count: int, at: int) -> None:
        """Record that ``count`` things could not be taken before this."""
        self.note(DROPPED, {"dropped": count}, at)
        self.counts.dropped += count

    def flush(self) -> None:
        """Close the chunk under way, hand it to the system and have it synced."""
        self._writer.flush()
        self._sync()
        self._pending = self.unsaved = 0

    def finish(self) -> None:
        """Close the chunk under way, write counts and index; the recording is whole then."""
        self.flush()
        self._writer.add_metadata(COUNTS, {name: str(count) for name, count in self.counts.as_dict().items()})
        self._writer.finish()
        self._stream.flush()

    def _add(self, at: int, messages: list[Written]) -> None:
        for topic, kind, data in messages:
            self._writer.add_message(self._channel(topic, kind), at, data, at, self._group & 0xFFFFFFFF)
            self._pending += len(data) + _MESSAGE_OVERHEAD
        self._group += 1
        self.unsaved += 1
        if self._pending >= CHUNK:
            self.flush()

    def _channel(self, topic: str, kind: str) -> int:
        if topic not in self._channels:
            form = form_of(kind)
            if kind not in self._schemas:
                self._schemas[kind] = self._writer.register_schema(form.name, form.schema_encoding, form.schema)
            self._channels[topic] = self._writer.register_channel(topic, form.encoding, self._schemas[kind])
        return self._channels[topic]
