"""The server's end of the rover link: who is there, what it said last and how long ago."""

import threading
import time
from collections.abc import Callable
from typing import Any

from footfall.core.errors import Conflict
from footfall.telemetry.state import TelemetryFrame

Send = Callable[[str], None]


class RoverLink:
    """Holds the latest telemetry frame and the way down to the rover. Thread-safe; never blocks for long.

    frames: how many came; gaps: frames that were missing between them; restarts: how often counting began anew.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._guard = threading.Lock()
        self._send: Send | None = None
        self._frame: TelemetryFrame | None = None
        self._taken_at = 0.0
        self.frames = self.gaps = self.restarts = 0

    def connect(self, send: Send) -> None:
        """A rover is there; ``send`` hands it one text frame, without blocking, from any thread."""
        with self._guard:
            self._send = send

    def disconnect(self, send: Send | None = None) -> bool:
        """The rover is gone. With ``send``: only if that is still the one in use. Whether anything changed."""
        with self._guard:
            if self._send is None or (send is not None and send is not self._send):
                return False
            self._send = None
            return True

    def take(self, frame: TelemetryFrame) -> None:
        """Keep a frame as the latest."""
        with self._guard:
            if self._frame is not None:
                missing = frame.number - self._frame.number - 1
                if missing < 0:
                    self.restarts += 1
                else:
                    self.gaps += missing
            self._frame, self._taken_at = frame, self._clock()
            self.frames += 1

    def send(self, text: str) -> None:
        """Hand one text frame to the rover. Raises Conflict where none is connected, or it can't be reached."""
        with self._guard:
            send = self._send
        if send is None:
            raise Conflict("no rover is connected")
        try:
            send(text)
        except Exception as err:
            raise Conflict(f"the rover can't be reached: {err}") from err

    @property
    def connected(self) -> bool:
        """Whether a rover is connected."""
        return self._send is not None

    @property
    def frame(self) -> TelemetryFrame | None:
        """The latest frame."""
        return self._frame

    @property
    def age(self) -> float | None:
        """Seconds since the latest frame came; None before the first."""
        with self._guard:
            return None if self._frame is None else self._clock() - self._taken_at

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON for the interface."""
        return {
            "connected": self.connected,
            "age_s": self.age,
            "frames": self.frames,
            "gaps": self.gaps,
            "restarts": self.restarts,
        }
