"""Whether the leg's own first link shuts it in: proven at once, where searches go on until they give up.

Where the first link is depends on the first joint alone. If at some angle it is too near to what does not move, no
posture with that angle is allowed, and no path gets past the angle, as a path is continuous.
"""

from collections.abc import Sequence

import numpy as np

from footfall.planning.step.edges import Array
from footfall.planning.step.situation import Situation

LOOKS = 0.02
"""Between two angles that are looked at [rad]; one that is barred is enough."""


def shut_in(situation: Situation, start: Array, goals: Sequence[Array]) -> str:
    """What bars every way from start to the goals, postures (6,), in words; empty where nothing bars one of them."""
    told = []
    for goal in goals:
        step = LOOKS if goal[0] > start[0] else -LOOKS
        barred = (what for angle in np.arange(start[0], goal[0], step) if (what := situation.first_link_barred(angle)))
        found = next(barred, "")
        if not found:
            return ""
        told.append(found)
    return "; ".join(dict.fromkeys(told))
