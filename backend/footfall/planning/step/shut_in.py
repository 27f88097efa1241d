"""Whether the leg's own upper links shut it in: proven at once, where searches go on until they give up.

Where the first link is depends on the first joint alone, where the second is on the first two. If at some angle of the
first joint its link is too near to what does not move, or the second link is at every angle of the second joint, no
posture with that angle is allowed, and no path gets past the angle, as a path is continuous.

One look tells of many angles of the second joint: where its link lacks s of the distance that it must keep, it lacks
some until the joint has turned by s / r, as no point of a link that reaches r from the axis moves farther than s then.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.step.situation import Situation
from footfall.robot.description import PARTS, link_name

LOOKS = 0.02
"""Between two angles of the first joint that are looked at [rad]; one that is barred is enough."""
LEAST = 1e-4
"""Where a look proves less than this of the second joint, the link is taken to have room [rad]."""
_ROUNDING = 1e-6
"""By how much a distance may be wrong [m]."""


def shut_in(situation: Situation, start: Array, goals: Sequence[Array]) -> str:
    """What bars every way from a start to goals.

    Args:
        situation: what the leg may do.
        start: posture of the leg, (6,) [rad].
        goals: postures of the leg, (6,) each [rad].

    Returns:
        Words; empty where nothing bars one of them.
    """
    reasons, links = [], _UpperLinks(situation, start)
    for goal in goals:
        step = LOOKS if goal[0] > start[0] else -LOOKS
        barred = (what for angle in np.arange(start[0], goal[0], step) if (what := links.barred(float(angle))))
        found = next(barred, "")
        if not found:
            return ""
        reasons.append(found)
    return "; ".join(dict.fromkeys(reasons))


class _UpperLinks:
    """The first two links of a leg, turned by its first joint."""

    def __init__(self, situation: Situation, start: Array) -> None:
        self._situation, self._start = situation, start
        self._first, self._second = (link_name(situation.leg, part) for part in PARTS[:2])
        vertices = situation.robot.description.meshes[self._second].vertices
        self._reach = float(np.linalg.norm(vertices, axis=1).max())
        self._free = float(start[1])
        self._known: dict[float, str] = {}

    def barred(self, angle: float) -> str:
        """What no posture with the first joint at this angle [rad] gets away from, in words; empty: one may."""
        if angle not in self._known:
            self._known[angle] = self._looked(angle)
        return self._known[angle]

    def _looked(self, angle: float) -> str:
        q, met = self._start.copy(), Counter[str]()
        q[0] = angle
        # what had room a little before mostly has it here
        pitch, last = self._free, float(self._situation.upper[1])
        hinted = True
        while pitch <= last:
            q[1], lacking, what = pitch, 0.0, ""
            for hit in self._situation.fixed_contacts(q):
                if hit.link_a == self._first:
                    return f"{hit.link_a} can't turn past {hit.link_b}: at {angle:z.2f} rad it is too near"
                lacks = hit.required - max(hit.distance, 0.0) - _ROUNDING
                if hit.link_a == self._second and lacks > lacking:
                    lacking, what = lacks, hit.link_b
            if lacking < LEAST * self._reach:
                self._free = pitch
                return ""
            if hinted:
                pitch, hinted = float(self._situation.lower[1]), False
                continue
            met[what] += 1
            pitch += lacking / self._reach
        past = met.most_common(1)[0][0]
        return f"{self._second} can't pass {past}: with {self._first} at {angle:z.2f} rad it is too near at every angle"
