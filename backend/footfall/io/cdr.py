"""Plain CDR, little-endian (OMG XCDR1), the form of ROS 2 messages: each number is aligned to its own size."""

import struct

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput

LITTLE = b"\x00\x01\x00\x00"
"""What every message begins with; alignment counts from behind it."""


class CdrWriter:
    """Writes one message, field by field in the order of its definition."""

    def __init__(self) -> None:
        self._body = bytearray()

    def pack(self, form: str, *numbers: float) -> None:
        """Numbers of one kind, a letter of :mod:`struct`. Raises struct.error where one does not fit into it."""
        size = struct.calcsize(f"<{form}")
        self._body += bytes(-len(self._body) % size)
        self._body += struct.pack(f"<{len(numbers)}{form}", *numbers)

    def string(self, text: str) -> None:
        """A text, UTF-8 with a zero behind it."""
        self.octets(text.encode() + b"\x00")

    def octets(self, content: bytes) -> None:
        """A sequence of bytes with its length."""
        self.pack("I", len(content))
        self._body += content

    def floats(self, numbers: NDArray[np.float64]) -> None:
        """A sequence of float64 with its length; every bit is kept."""
        self.pack("I", numbers.size)
        if numbers.size:
            self.fixed_floats(numbers)

    def fixed_floats(self, numbers: NDArray[np.float64]) -> None:
        """An array of float64 whose length the definition says."""
        self._body += bytes(-len(self._body) % 8)
        self._body += np.ascontiguousarray(numbers, "<f8").tobytes()

    def message(self) -> bytes:
        """The message."""
        return LITTLE + bytes(self._body)


class CdrReader:
    """Reads one message, field by field in the order of its definition. All raise InvalidInput where it ends early."""

    def __init__(self, message: bytes) -> None:
        if message[:4] != LITTLE:
            raise InvalidInput("the message is not in plain little-endian CDR", begins=message[:4].hex())
        self._body = message[4:]
        self._at = 0

    def one(self, form: str) -> float:
        """One number, of a letter of :mod:`struct`."""
        size = struct.calcsize(f"<{form}")
        self._at += -self._at % size
        return struct.unpack(f"<{form}", self._take(size))[0]

    def string(self) -> str:
        """A text."""
        content = self.octets()
        try:
            return content.removesuffix(b"\x00").decode()
        except UnicodeDecodeError as err:
            raise InvalidInput(f"a text of the message is not UTF-8, at byte {err.start}") from err

    def octets(self) -> bytes:
        """A sequence of bytes."""
        return self._take(int(self.one("I")))

    def floats(self) -> NDArray[np.float64]:
        """A sequence of float64, (n,)."""
        count = int(self.one("I"))
        return self.fixed_floats(count) if count else np.zeros(0)

    def fixed_floats(self, count: int) -> NDArray[np.float64]:
        """An array of float64, (count,)."""
        self._at += -self._at % 8
        return np.frombuffer(self._take(8 * count), "<f8").astype(np.float64)

    def _take(self, count: int) -> bytes:
        taken = self._body[self._at : self._at + count]
        if len(taken) != count:
            raise InvalidInput("the message is shorter than its definition says", bytes=len(self._body))
        self._at += count
        return taken
