"""By how much each wheel cleared the ground where it was lowest in a run, from the telemetry that came while it went.

On its way up and down a wheel comes near the ground whatever it does: only the rows in which it swings tell something.
"""

import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field

from footfall.sequence.moved_legs import moved_legs
from footfall.session.answers.commands import LeastClearancesAnswer
from footfall.session.core import SessionCore
from footfall.session.log.fold import SessionState
from footfall.session.wheel_clearance import WheelClearance, clearances_by, row_on_its_way, sequence_of_run
from footfall.telemetry.state import TelemetryFrame

log = logging.getLogger(__name__)

EVERY = 0.2
"""Telemetry that is nearer to the frame looked at before is left out [s, rover clock]; a wheel swings for seconds."""
MOST_WAITING = 100
"""So many frames may wait to be looked at, 20 s of a run; more are missed, and counted."""


@dataclass
class _OfRun:
    """What was seen of one run. at: of the frame taken last [s, rover clock]; looks, missed: frames so far."""

    run: int = 0
    at: float | None = None
    looks: int = 0
    missed: int = 0
    lowest: dict[int, WheelClearance] = field(default_factory=dict)


class LeastClearances:
    """Of the latest run since the session was opened. Every method may be called from any thread.

    Looking takes milliseconds, the first time seconds, as it loads compiled code: it has a thread of its own, so that
    what the rover says next is not kept waiting.
    """

    def __init__(self, core: SessionCore) -> None:
        self._core = core
        self._guard = threading.Lock()
        self._seen = _OfRun()
        self._waiting = 0
        self._thread = ThreadPoolExecutor(1, "footfall-clearances")

    def look(self, frame: TelemetryFrame) -> None:
        """``frame``: the latest. Does not wait for what is made of it."""
        state, now = self._core.state, frame.state.time
        if state.run is None or row_on_its_way(state) is None or self._core.described is not None:
            return
        with self._guard:
            if self._seen.run != state.run.number:
                self._seen = _OfRun(state.run.number)
            seen = self._seen
            if seen.at is not None and 0 <= now - seen.at < EVERY:
                return
            seen.at = now
            if self._waiting >= MOST_WAITING:
                seen.missed += 1
                return
            self._waiting += 1
        # where the session is being closed nothing is taken any more
        with suppress(RuntimeError):
            self._thread.submit(self._look, seen, state, frame)

    def of(self, run: int) -> LeastClearancesAnswer:
        """As plain JSON: each wheel where it was lowest, by how many looks at telemetry. Empty for another run."""
        with self._guard:
            seen = self._seen if self._seen.run == run else _OfRun(run)
            wheels = [seen.lowest[leg].as_dict() for leg in sorted(seen.lowest)]
            return {"every_s": EVERY, "looks": seen.looks, "missed": seen.missed, "wheels": wheels}

    def close(self) -> None:
        """Look at nothing more; harmless when done twice."""
        self._thread.shutdown(cancel_futures=True)

    def _look(self, seen: _OfRun, state: SessionState, frame: TelemetryFrame) -> None:
        try:
            leg = self._swung(state)
            wheels = () if leg is None else clearances_by(self._core, state, frame).wheels
        except Exception:
            # nobody waits for it: what went wrong would be lost in the thread
            log.exception("the clearance of a wheel could not be measured")
            with self._guard:
                self._waiting -= 1
                seen.missed += 1
            return
        with self._guard:
            self._waiting -= 1
            seen.looks += leg is not None
            lower = [one for one in wheels if one.leg == leg and one.is_lower_than(seen.lowest.get(one.leg))]
            seen.lowest |= {one.leg: one for one in lower}

    def _swung(self, state: SessionState) -> int | None:
        """The leg that the row on its way swings; None where it does anything else."""
        row, sequence = row_on_its_way(state), sequence_of_run(self._core, state)
        if row is None or sequence is None or sequence.commands[row].phase != "swing":
            return None
        return moved_legs(sequence)[row]
