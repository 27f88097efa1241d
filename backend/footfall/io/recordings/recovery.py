"""A recording that was cut short → a valid one with every whole chunk of it."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from footfall.core.errors import InvalidInput
from footfall.io.cdr import CdrReader
from footfall.io.recordings import DROPPED, FRAME, object_of
from footfall.io.recordings.continuity import Continuity
from footfall.io.recordings.writing import COUNTS

_FRAMING = struct.Struct("<BQ")


@dataclass(frozen=True)
class Recovered:
    """messages, chunks, counts: what was saved; lost: bytes behind the last whole chunk that could not be used."""

    messages: int
    chunks: int
    lost: int
    counts: Continuity


def is_whole(stream: IO[bytes]) -> bool:
    """Whether a recording ends as a finished one does."""
    size = stream.seek(0, 2)
    stream.seek(max(0, size - len(MCAP0_MAGIC)))
    return size >= 2 * len(MCAP0_MAGIC) and stream.read() == MCAP0_MAGIC


def recover(source: IO[bytes], target: IO[bytes]) -> Recovered:
    """Copy what is whole in ``source`` into ``target`` as a finished recording.

    Chunks keep their bounds. Raises InvalidInput where not even the beginning of a recording is there.
    """
    size = source.seek(0, 2)
    source.seek(0)
    if source.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        raise InvalidInput("this is not the beginning of an MCAP file", bytes=size)
    copy = _Copy(target)
    used = source.tell()
    for record, end in whole_records(source, size):
        if isinstance(record, Header):
            copy.begin(record)
        elif not copy.begun or not copy.take(record):
            break
        used = end
    if not copy.begun:
        raise InvalidInput("the recording was cut before its first chunk", bytes=size)
    copy.end()
    return Recovered(copy.messages, copy.chunks, size - used, copy.counts)


def whole_records(source: IO[bytes], size: int) -> Iterator[tuple[McapRecord | None, int]]:
    """Records from where the file is, up to the first that is cut or can't be read, or the data's end.

    Each comes with where it ends in the file.

    Message indexes come as None: they are made anew.
    """
    readers = {Opcode.HEADER: Header.read, Opcode.METADATA: Metadata.read, Opcode.CHUNK: Chunk.read}
    while True:
        framing = source.read(_FRAMING.size)
        if len(framing) < _FRAMING.size:
            return
        opcode, length = _FRAMING.unpack(framing)
        end = source.tell() + length
        if end > size or opcode not in (*readers, Opcode.MESSAGE_INDEX):
            return
        body = source.read(length)
        if opcode == Opcode.MESSAGE_INDEX:
            yield None, end
            continue
        try:
            yield readers[opcode](ReadDataStream(BytesIO(body))), end
        except (McapError, ValueError, struct.error):
            return


class _Copy:
    """A finished recording made of records of another."""

    def __init__(self, target: IO[bytes]) -> None:
        self.messages = self.chunks = 0
        self.counts = Continuity()
        self.begun = False
        self._target = target
        self._writer = Writer(target, chunk_size=1 << 62, compression=CompressionType.ZSTD)
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, tuple[int, str, str]] = {}

    def begin(self, header: Header) -> None:
        self._writer.start(header.profile, header.library)
        self.begun = True

    def take(self, record: McapRecord | None) -> bool:
        """Whether the record could be used."""
        if isinstance(record, Metadata) and record.name != COUNTS:
            self._writer.add_metadata(record.name, record.metadata)
        if not isinstance(record, Chunk):
            return True
        try:
            inside = breakup_chunk(record, validate_crc=True)
        except Exception:  # whatever the decompressor says of a chunk that was half on the disk
            return False
        for one in inside:
            self._take_inside(one)
        self._writer.flush()
        self.chunks += 1
        return True

    def _take_inside(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = self._writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel):
            channel = self._writer.register_channel(
                record.topic, record.message_encoding, self._schemas[record.schema_id], record.metadata
            )
            self._channels[record.id] = channel, record.topic, record.message_encoding
        elif isinstance(record, Message):
            channel, topic, encoding = self._channels[record.channel_id]
            self._writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
            self.messages += 1
            if topic == FRAME:
                self.counts.take(int(CdrReader(record.data).one("Q")))
            elif topic == DROPPED:
                self.counts.dropped += object_of(encoding, record.data)["dropped"]

    def end(self) -> None:
        self._writer.add_metadata(COUNTS, {name: str(count) for name, count in self.counts.as_dict().items()})
        self._writer.finish()
        self._target.flush()
