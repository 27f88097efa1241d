"""The server's end of the rover link: who is there, what it said last and how long ago."""

import threading
import time
from collections.abc import Callable
from typing import Any

from footfall.core.errors import Conflict
from footfall.telemetry.state import TelemetryFrame

Send = Callable[[str], None]


RESTART_AFTER = 5
"""So many frames on end with old numbers and times are no stragglers: the rover's counter and clock began anew."""


class RoverLink:
    """Holds the latest telemetry frame and the way down to the rover. Thread-safe; never blocks for long.

    frames: how many came; gaps: frames that were missing between them; restarts: how often counting began anew;
    late: frames that came again, or after newer ones, and were dropped; clock_jumps: how often the rover's clock
    went back; fault, faults: the latest complaint of the rover, or about what it sent, and how many there were.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._guard = threading.Lock()
        self._send: Send | None = None
        self._frame: TelemetryFrame | None = None
        self._taken_at = 0.0
        self._straggler: TelemetryFrame | None = None
        self._stragglers = 0
        self.frames = self.gaps = self.restarts = self.late = self.clock_jumps = self.faults = 0
        self.fault = ""

    def connect(self, send: Send) -> None:
        """A rover is there; ``send`` hands it one text frame, without blocking, from any thread."""
        with self._guard:
            self._send = send
            # what is there now may be another rover, or the same one after a restart
            self._straggler, self._stragglers = None, RESTART_AFTER

    def disconnect(self, send: Send | None = None) -> bool:
        """The rover is gone. With ``send``: only if that is still the one in use. Whether anything changed."""
        with self._guard:
            if self._send is None or (send is not None and send is not self._send):
                return False
            self._send = None
            return True

    def take(self, frame: TelemetryFrame, at: float | None = None) -> bool:
        """Keep a frame as the latest, unless it is older than that one; whether it was kept.

        at: when it came, by this link's clock; None: now.
        """
        with self._guard:
            self.frames += 1
            latest = self._frame
            if latest is not None and self._is_late(frame, latest):
                self.late += 1
                return False
            if latest is not None:
                if frame.number <= latest.number:
                    self.restarts += 1
                else:
                    self.gaps += frame.number - latest.number - 1
                self.clock_jumps += frame.state.time < latest.state.time
            self._frame, self._taken_at = frame, self._clock() if at is None else at
            self._stragglers = 0
            return True

    def _is_late(self, frame: TelemetryFrame, latest: TelemetryFrame) -> bool:
        """Whether a frame is a straggler or a repetition: one of those must not pass for news."""
        repeated = frame.number == latest.number and frame.state.time <= latest.state.time
        if not repeated and not (frame.number < latest.number and frame.state.time < latest.state.time):
            return False
        before, self._straggler = self._straggler, frame
        moves_on = before is None or frame.number > before.number
        self._stragglers = self._stragglers + 1 if moves_on else min(self._stragglers, RESTART_AFTER - 1)
        return self._stragglers <= RESTART_AFTER

    def complain(self, text: str) -> bool:
        """Keep what went wrong between server and rover, for the operator; whether it differs from the last."""
        with self._guard:
            self.faults += 1
            news, self.fault = text != self.fault, text
            return news

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
            "late": self.late,
            "clock_jumps": self.clock_jumps,
            "faults": self.faults,
            "fault": self.fault,
        }
