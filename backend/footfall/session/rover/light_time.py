"""The one-way light time between ground and rover, and the line on which messages spend it.

The delay is made here: it is for a rover that is simulated, or near by, and shall be worked with as if it were far.
One that is far already has its delay on the way; set none for it.
"""

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

from footfall.core.errors import Conflict, FootFallError, InvalidInput
from footfall.session.answers.commands import LightTimeAnswer

MOON = 1.28
"""Earth to Moon [s]."""
LONGEST = 1500.0
"""Longest delay [s]: Mars at its farthest is 1 340 s away."""
MOST_ON_THE_WAY = 50_000
"""Messages on one line; an hour and more of telemetry at ten a second."""

T = TypeVar("T")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class LightTime:
    """One-way delays [s]. telemetry: what the rover says; commands: what it is told.

    Raises InvalidInput unless both are from 0 to ``LONGEST``.
    """

    telemetry: float = 0.0
    commands: float = 0.0

    def __post_init__(self) -> None:
        for name in ("telemetry", "commands"):
            delay = getattr(self, name)
            if not 0.0 <= delay <= LONGEST:
                raise InvalidInput(f"the delay of {name} is 0 to {LONGEST:g} s (the Moon: {MOON:g} s), not {delay}")

    @property
    def round_trip(self) -> float:
        """From sending a command to the earliest acknowledgement [s]."""
        return self.telemetry + self.commands

    def as_dict(self) -> LightTimeAnswer:
        """Plain JSON."""
        return {"telemetry_s": self.telemetry, "commands_s": self.commands, "round_trip_s": self.round_trip}


class DelayLine(Generic[T]):
    """What is on its way: comes out in the order in which it went in, nothing lost, nothing before its time.

    Times are the caller's, of any clock [s]. Not thread-safe.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[float, T]] = deque()
        self._last = float("-inf")

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, item: T, now: float, delay: float) -> float:
        """Send an item on its way; when it arrives. What went before it arrives before it, also where that was
        sent with a longer delay."""
        self._last = max(self._last, now + delay) if self._waiting else now + delay
        self._waiting.append((self._last, item))
        return self._last

    def take(self, now: float) -> T | None:
        """The next item that has arrived by ``now``; None: none has."""
        if not self._waiting or self._waiting[0][0] > now:
            return None
        return self._waiting.popleft()[1]

    @property
    def next(self) -> float | None:
        """When the next item arrives; None: nothing is on its way."""
        return self._waiting[0][0] if self._waiting else None


class _Sent(NamedTuple):
    call: Callable[[], Any]
    lost: Callable[[], None] | None

    def is_lost(self) -> None:
        if self.lost is not None:
            self.lost()


class LightPath:
    """One direction of the link: calls are made when what they bring has arrived, one after the other. Thread-safe.

    Without a delay, and with nothing on its way, a call is made at once by the caller's thread.
    """

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._name = name
        self._clock = clock
        self._changed = threading.Condition()
        self._line: DelayLine[_Sent] = DelayLine()
        self._arriving = False
        self._closed = False
        self._thread: threading.Thread | None = None

    def carry(
        self, call: Callable[[], Any], delay: float, now: float | None = None, lost: Callable[[], None] | None = None
    ) -> float:
        """Make ``call`` ``delay`` after ``now`` (None: the clock's); when that is. Raises Conflict where too much is
        on its way, and, without a delay, what the call raises. lost: called instead where it does not arrive any more.
        """
        now = self._clock() if now is None else now
        with self._changed:
            direct = delay == 0.0 and not self._line and not self._arriving
            if not direct:
                return self._put(_Sent(call, lost), now, delay)
        call()
        return now

    def close(self) -> None:
        """What is still on its way does not arrive any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        with self._changed:
            while (one := self._line.take(math.inf)) is not None:
                one.is_lost()

    def _put(self, one: "_Sent", now: float, delay: float) -> float:
        if self._closed:
            one.is_lost()
            return now + delay
        if len(self._line) >= MOST_ON_THE_WAY:
            raise Conflict(f"{MOST_ON_THE_WAY} messages are on their way already ({self._name}); this one is refused")
        at = self._line.put(one, now, delay)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=f"footfall-{self._name}", daemon=True)
            self._thread.start()
        self._changed.notify_all()
        return at

    def _run(self) -> None:
        while True:
            with self._changed:
                self._arriving = False
                one = None
                while not self._closed and (one := self._line.take(self._clock())) is None:
                    due = self._line.next
                    self._changed.wait(None if due is None else max(due - self._clock(), 0.0))
                if one is None:
                    return
                self._arriving = True
            try:
                one.call()
            except FootFallError as error:
                _log.warning("a message was lost on the way (%s): %s", self._name, error.message)
            except Exception:
                _log.exception("a message could not be used when it arrived (%s)", self._name)
