"""The telemetry of one recording as columns of numbers, read on while the file grows; coarser once it is whole."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Metadata
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.io.recordings import FRAME, UNFINISHED
from footfall.io.recordings.reading import described_in, frame_of
from footfall.io.recordings.recovery import whole_records
from footfall.io.recordings.writing import ABOUT
from footfall.io.ros2_messages import NS
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.quantities import extremes, numbers_of

SILENCE = 2.0
"""A pause between two frames that is longer is a silence [s]: the command gate calls telemetry stale from there on."""
INTERVAL = "interval"
"""The quantity that no frame tells alone: the time since the one before, as they came [s]; NaN of a file's first."""
BLOCK = 10
"""Frames that a coarse track puts together."""

Numbers = tuple[NDArray[np.float64], NDArray[np.float32]]
"""Times, seconds since 1970-01-01 UTC, and a row of numbers at each."""


def first_time(path: Path) -> float | None:
    """When the first thing came, as a recording's first chunk says; None where none is whole. Raises OSError."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(len(MCAP0_MAGIC))
        chunks = (record for record, _ in whole_records(file, size) if isinstance(record, Chunk))
        first = next(chunks, None)
        return None if first is None else first.message_start_time / NS


class Track:
    """What is read of one recording. Not thread-safe.

    columns: quantity → its columns; empty before the first frame. whole: it was finished, and is read to its end.
    damaged: though it was finished its end can't be read. forgotten: all but the coarse numbers.
    used: how much of the file is read [bytes]; caught_up: that was all that can be read.
    """

    def __init__(self) -> None:
        self.columns: dict[str, slice] = {}
        self.damaged = self.whole = self.forgotten = False
        self.used = 0
        self.caught_up = False
        self._topics: dict[int, str] = {}
        self._described: JointLayout | None = None
        self._times: list[float] = []
        self._rows: list[NDArray[np.float32]] = []
        self._stamps: NDArray[np.float64] = np.zeros(0)
        self._coarse: Numbers | None = None

    def read_on(self, path: Path, most: int) -> int:
        """Read about ``most`` more bytes; returns how many are left. Raises OSError.

        What is half written is no part of what is left.
        """
        if self.whole:
            return 0
        with path.open("rb") as file:
            size = file.seek(0, 2)
            self.caught_up = False
            if most <= 0:
                return size - self.used
            file.seek(self.used)
            if not self.used and file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC:
                self.used = file.tell()
            first = self.used
            for record, end in whole_records(file, size):
                if isinstance(record, Metadata) and record.name == ABOUT:
                    self._described = described_in(record.metadata)
                if isinstance(record, Chunk) and not self._take(record, path.name):
                    break
                self.used = end
                if end - first >= most and end < size:
                    return size - end
            self.caught_up = True
            if not path.name.endswith(UNFINISHED):
                file.seek(self.used)
                self.damaged = file.read(1) != bytes([Opcode.DATA_END])
                self.whole = True
        return 0

    def column(self, quantity: str, number: int) -> int:
        """Which column a number of a quantity is. Raises InvalidInput."""
        if quantity not in self.columns:
            raise InvalidInput(
                f"there is no quantity {quantity!r}; there are {', '.join(self.columns)}", quantity=quantity
            )
        several = self.columns[quantity]
        if not 0 <= number < several.stop - several.start:
            count = several.stop - several.start
            raise InvalidInput(f"{quantity} has the numbers 0 to {count - 1}, not {number}", number=number)
        return several.start + number

    @property
    def times(self) -> NDArray[np.float64]:
        """When each frame came."""
        if len(self._stamps) != len(self._times):
            self._stamps = np.array(self._times)
        return self._stamps

    @property
    def fine(self) -> Numbers:
        """Every frame."""
        width = max((several.stop for several in self.columns.values()), default=0)
        return self.times, np.array(self._rows, np.float32).reshape(len(self._rows), width)

    @property
    def coarse(self) -> Numbers:
        """The least and the greatest number of ``BLOCK`` frames, or of fewer where a silence comes between."""
        if self._coarse is not None:
            return self._coarse
        times, rows = self.fine
        after = np.flatnonzero(np.diff(times) > SILENCE) + 1
        bounds = [0, *after.tolist(), len(times)]
        edges = [at for begin, end in pairwise(bounds) for at in range(begin, end, BLOCK)]
        made = extremes(times, rows, [*edges, len(times)])
        self._coarse = made if self.whole else None
        return made

    def forget(self) -> None:
        """Keep the coarse numbers alone of what is whole."""
        if self.whole and not self.forgotten:
            _ = self.coarse
            self._rows, self.forgotten = [], True

    def _take(self, chunk: Chunk, name: str) -> bool:
        try:
            inside = breakup_chunk(chunk, validate_crc=True)
        except Exception:  # each decompressor has errors of its own
            return False
        parts: dict[str, bytes] = {}
        group = -1
        for one in inside:
            if isinstance(one, Channel):
                self._topics[one.id] = one.topic
            if not isinstance(one, Message):
                continue
            if one.sequence != group:
                group, parts = one.sequence, {}
            topic = self._topics.get(one.channel_id, "")
            if topic == FRAME:
                try:
                    self._add(one, numbers_of(frame_of(name, one.data, parts, self._described)))
                except InvalidInput:
                    return False
            parts[topic] = one.data
        return True

    def _add(self, message: Message, numbers: dict[str, NDArray[np.float32]]) -> None:
        at = message.log_time / NS
        interval = at - self._times[-1] if self._times else np.nan
        if not self.columns:
            begin = 0
            for quantity, several in {**numbers, INTERVAL: np.zeros(1)}.items():
                self.columns[quantity] = slice(begin, begin + several.size)
                begin += several.size
        self._times.append(at)
        self._rows.append(np.concatenate([*numbers.values(), [np.float32(interval)]]).astype(np.float32))
