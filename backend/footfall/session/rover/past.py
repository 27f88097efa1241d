"""What the rover said in the last minutes, number by number, for plots of a page that was not open then.

In memory, in rings of fixed size: the recordings beside the log hold all of it, but reading them would take the
interpreter from whoever asks for a stop.
"""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.core.frames import rpy
from footfall.telemetry.state import TelemetryFrame

KEPT_FOR = 600.0
"""How far back it goes [s]."""
FRAMES = 6200
"""Of more the oldest go: ten a second for that long."""
MOST_PARTS = 1000
_LARGEST = float(np.finfo(np.float32).max)
_NO_ROWS = np.zeros((0, 0), np.float32)


QUANTITIES: Mapping[str, Callable[[TelemetryFrame], ArrayLike]] = MappingProxyType(
    {
        "torque": lambda frame: frame.state.joint_torques,
        "position": lambda frame: frame.state.posture,
        "error": lambda frame: frame.commanded - frame.state.posture,
        "force": lambda frame: frame.state.wheel_forces[:, 2],
        "place": lambda frame: frame.state.T_site_base[:3, 3],
        "lean": lambda frame: rpy(frame.state.T_site_base),
    }
)
"""Name → its numbers in a frame, in SI units: of each joint; of each wheel; x, y, z; roll, pitch, yaw."""


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
        with np.errstate(over="ignore"):  # what is no number of a rover must not end its telemetry
            rows = {name: np.clip(of(frame), -_LARGEST, _LARGEST).astype(np.float32) for name, of in QUANTITIES.items()}
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
        return _extremes(ages, rows, [*begins.tolist(), len(ages)])


def _extremes(ages: NDArray[np.float64], rows: NDArray[np.float32], edges: list[int]) -> PastTelemetry:
    moments: list[float] = []
    numbers: list[NDArray[np.float32]] = []
    for begin, end in pairwise(edges):
        block = rows[begin:end]
        if end - begin == 1:
            moments.append(float(ages[begin]))
            numbers.append(block[0])
            continue
        least_first = block.argmin(axis=0) <= block.argmax(axis=0)
        least, greatest = block.min(axis=0), block.max(axis=0)
        moments += [float(ages[begin]), float(ages[end - 1])]
        numbers += [np.where(least_first, least, greatest), np.where(least_first, greatest, least)]
    columns = np.array(numbers).T if numbers else np.zeros((rows.shape[1], 0))
    return PastTelemetry(tuple(moments), tuple(tuple(map(float, column)) for column in columns))
