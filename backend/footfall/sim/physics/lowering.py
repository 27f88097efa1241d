"""Feeling the ground: a wheel that is lowered has touched when its force has risen above what it was before."""

from collections import deque

from footfall.sim.physics.physics_settings import TIME_STEP

AVERAGED = 0.1
"""Forces are averaged over this long, against noise and the swing of the leg [s]."""

BASELINE = 4.0
"""The force is compared with its least average in this time [s]: it moves along with a reading that drifts, and still
sees a slow touch-down, whose force rises over seconds."""


class TouchSense:
    """Fed with the wheel's force along the site's up at every time step."""

    def __init__(self, force: float) -> None:
        self._force = force
        self._recent: deque[float] = deque(maxlen=round(AVERAGED / TIME_STEP))
        self._averages: deque[float] = deque(maxlen=round(BASELINE / TIME_STEP))

    def touched(self, up: float) -> bool:
        """Whether the average has risen by the force [N] above the baseline, with ``up`` [N] as the newest reading."""
        self._recent.append(up)
        if len(self._recent) < (self._recent.maxlen or 0):
            return False
        average = sum(self._recent) / len(self._recent)
        self._averages.append(average)
        return average - min(self._averages) >= self._force
