"""Whether the wall clock jumped: events carry its time, and the operator is told when it can't be believed."""

import time
from collections.abc import Callable
from dataclasses import dataclass

TOLERANCE = 1.0
"""A difference between the clocks that is no jump [s]."""
DRIFT = 1e-3
"""How fast a clock may be steered without jumping [s/s]; network time steers by at most 5e-4."""


def _steady() -> float:
    # Where there is one, the clock that also runs while the machine sleeps.
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


@dataclass(frozen=True)
class Reading:
    """Both clocks at one moment, and by how much the wall clock jumped since the last accepted reading [s]."""

    wall: float
    steady: float
    jump: float


class ClockWatch:
    """Compares the wall clock with a steady one.

    last: wall time of the last event that was written, maybe by another process; None: there is none.
    """

    def __init__(
        self, last: float | None, wall: Callable[[], float] = time.time, steady: Callable[[], float] = _steady
    ) -> None:
        self._wall, self._steady = wall, steady
        self._last = last
        self._accepted: Reading | None = None

    def read(self) -> Reading:
        """Read both clocks. jump is 0.0 where they agree.

        Before a reading was accepted only a jump back behind the last event can be seen; it was at least so far.
        """
        wall, steady = self._wall(), self._steady()
        elapsed = jump = 0.0
        if self._accepted is not None:
            elapsed = steady - self._accepted.steady
            jump = wall - self._accepted.wall - elapsed
        elif self._last is not None:
            jump = min(wall - self._last, 0.0)
        return Reading(wall, steady, jump if abs(jump) > TOLERANCE + DRIFT * elapsed else 0.0)

    def accept(self, reading: Reading) -> None:
        """Measure from this reading on: an event carries its time."""
        self._accepted = reading
