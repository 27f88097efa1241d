"""What the rover said in the last minutes, number by number, for plots of a page that was not open then.

In memory, in rings of fixed size: the recordings beside the log hold all of it, but reading them would take the
interpreter from whoever asks for a stop.
"""

import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.telemetry.quantities import QUANTITIES, extremes, numbers_of
from footfall.telemetry.state import TelemetryFrame

KEPT_FOR = 600.0
"""How far back it goes [s]."""
FRAMES = 6200
"""Of more the oldest go: ten a second for that long."""
MOST_PARTS = 1000
_NO_ROWS = np.zeros((0, 0), np.float32)


@dataclass(frozen=True)
class PastTelemetry:
    """ages: of each moment, oldest first [s]. numbers: of each channel, one for each moment."""

    ages: tuple[float, ...]
    numbers: tuple[tuple[float, ...], ...]


class Past:
    """Thread-safe; takes no memory before the first frame."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._times = np.zeros(0)
        self._rings: dict[str, NDArray[np.float32]] = {}
        self._count = 0

    def take(self, frame: TelemetryFrame, at: float) -> None:
        """``at``: when it came, time.monotonic() [s]; not before those before it."""
        rows = numbers_of(frame)
        with self._guard:
            if not self._rings:
                self._times = np.zeros(FRAMES)
                self._rings = {name: np.zeros((FRAMES, row.size), np.float32) for name, row in rows.items()}
            slot = self._count % FRAMES
            self._times[slot] = at
            for name, row in rows.items():
                self._rings[name][slot] = row
            self._count += 1

    def looked_at(
        self, quantity: str, first: int, count: int, since: float, until: float, parts: int, now: float | None = None
    ) -> PastTelemetry:
        """Channels first … first + count − 1 of a quantity, heard between two ages [s].

        The time is cut into so many parts. Of each part come one or two moments, the first and the last that was
        heard in it, with the least and the greatest number of the part, in the order that they were heard: no peak is
        lost, and where nothing was heard there is nothing. Raises InvalidInput.
        """
        if quantity not in QUANTITIES:
            raise InvalidInput(
                f"there is no quantity {quantity!r}; there are {', '.join(QUANTITIES)}", quantity=quantity
            )
        if not 0 <= until < since <= KEPT_FOR:
            raise InvalidInput(f"the ages go from {KEPT_FOR:g} s at most down to 0 s", since=since, until=until)
        now = time.monotonic() if now is None else now
        with self._guard:
            held = np.arange(max(0, self._count - FRAMES), self._count) % FRAMES
            ages = now - self._times[held]
            wanted = (ages <= since) & (ages >= until)
            ages = ages[wanted]
            ring = self._rings.get(quantity, _NO_ROWS)
            rows = ring[held[wanted], first : first + count]
        part = np.minimum(((since - ages) / (since - until) * parts).astype(int), parts - 1)
        begins = np.flatnonzero(np.diff(part, prepend=-1))
        moments, numbers = extremes(ages, rows, [*begins.tolist(), len(ages)])
        return PastTelemetry(tuple(moments.tolist()), tuple(tuple(column) for column in numbers.T.tolist()))
