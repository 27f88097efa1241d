"""The head of a session's log in a file apart: a database that was cut, rolled back or swapped shows against it.

Two slots of one line each, written in turn in place and each with a check of its own: a write that a power cut tears
leaves the other slot, and no room is needed on a full disk.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from footfall.io.event_log import START, Record
from footfall.session.storage.artifact_folder import sync_folder

HEAD = "head"
HELD = "held"
"""An empty file in the folder of the session that holds the rover."""
SLOT = 63
"""Length of a slot [bytes]: seq (12 digits), hash (32), check (16), two blanks and a newline."""


@dataclass(frozen=True)
class Head:
    """Last event that was written. seq −1: none yet. damaged: slots (0…2) that can't be read."""

    seq: int
    hash: str
    damaged: int = 0


def read_head(folder: Path) -> Head | None:
    """The head kept in a session's folder; None where there is none, or neither slot can be read."""
    try:
        data = (folder / HEAD).read_bytes()
    except FileNotFoundError:
        return None
    slots = [_parsed(data[:SLOT]), _parsed(data[SLOT : 2 * SLOT])]
    whole = [slot for slot in slots if slot is not None]
    if not whole or len(data) > 2 * SLOT:
        return None
    seq, chained = max(whole)
    return Head(seq, chained, len(slots) - len(whole))


@dataclass(frozen=True)
class Comparison:
    """How a head and a log fit. kind: "fits", "behind", "missing", "ahead" or "foreign"; text: for a person.

    "behind" by one event is what a crash between the two writes leaves. "ahead" and "foreign": events were lost.
    """

    kind: str
    text: str = ""
    by: int = 0

    @property
    def lost(self) -> bool:
        """Whether the log lacks events that it had."""
        return self.kind in ("ahead", "foreign")


def compare(head: Head | None, records: Sequence[Record]) -> Comparison:
    """Hold a log against the head that was kept apart from it."""
    last = len(records) - 1
    if head is None:
        text = "the head of the log is missing or can't be read, so events lost from the log's end would not show"
        return Comparison("missing", text)
    if head.seq > last:
        text = f"the log lost events: it ends with event {last}, its head knows of event {head.seq}"
        return Comparison("ahead", text, head.seq - last)
    if (START if head.seq < 0 else records[head.seq]["hash"]) != head.hash:
        return Comparison("foreign", f"event {head.seq} of the log is not the one that its head knows: it was replaced")
    if head.seq < last:
        return Comparison("behind", f"the head of the log is {last - head.seq} events behind it", last - head.seq)
    return Comparison("fits")


class HeadFile:
    """The head of one session, held open for writing."""

    def __init__(self, folder: Path) -> None:
        self._file = os.open(folder / HEAD, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        self._slot = 0

    def write(self, seq: int, chained: str) -> None:
        """Remember the last event and wait until the disk has it; on failure the older head stays."""
        self._write_slot(seq, chained)
        _sync(self._file)

    def renew(self, seq: int, chained: str) -> None:
        """As :meth:`write`, into both slots, whatever was in the file."""
        os.ftruncate(self._file, 2 * SLOT)
        for _ in range(2):
            self.write(seq, chained)

    def close(self) -> None:
        """Harmless when done twice."""
        if self._file >= 0:
            file, self._file = self._file, -1
            os.close(file)

    def _write_slot(self, seq: int, chained: str) -> None:
        line = _line(seq, chained)
        written = os.pwrite(self._file, line, self._slot * SLOT)
        if written != len(line):
            raise OSError(f"only {written} of {len(line)} bytes of the head were written")
        self._slot = 1 - self._slot


def new_head(folder: Path, records: Sequence[Record]) -> HeadFile:
    """The head of a log, made or made anew, and held open."""
    head = HeadFile(folder)
    try:
        head.renew(*((records[-1]["seq"], records[-1]["hash"]) if records else (-1, START)))
        sync_folder(folder)
    except BaseException:
        head.close()
        raise
    return head


# Length and place never change, so that the file's times need not reach the disk (not offered everywhere).
_sync = getattr(os, "fdatasync", os.fsync)


def _line(seq: int, chained: str) -> bytes:
    text = f"{seq:012d} {chained}"
    return f"{text} {hashlib.sha256(text.encode()).hexdigest()[:16]}\n".encode()


def _parsed(slot: bytes) -> tuple[int, str] | None:
    try:
        number, chained, _ = slot.decode("ascii").split(" ")
        seq = int(number)
    except ValueError:
        return None
    fits = len(chained) == len(START) and slot == _line(seq, chained)
    return (seq, chained) if fits else None
