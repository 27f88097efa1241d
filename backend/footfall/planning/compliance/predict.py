"""How a commanded motion goes: where the rover stands at every waypoint, from springs alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover

STRIDE = 0.05
"""Largest change of a set point between two looks at the ground under wheels in the air [rad]."""


@dataclass(frozen=True, eq=False)
class PredictedMotion:
    """Equilibria along a commanded motion, one for each waypoint up to the last that has one.

    rests: m ≤ n of them; reason: why there are fewer than waypoints, else empty. gaps: (m, legs) [m], how far each rim
    is from the ground along its normal; negative: how much it is pressed in, the wheel touches.
    """

    rests: tuple[RestingRover, ...]
    reason: str
    gaps: Array

    @property
    def postures(self) -> Array:
        """(m, legs × 6) [rad]."""
        return np.array([rest.posture for rest in self.rests])

    @property
    def Ts_site_base(self) -> Array:
        """(m, 4, 4)."""
        return np.array([rest.T_site_base for rest in self.rests])

    @property
    def forces(self) -> Array:
        """Of the ground on the wheels, site, (m, legs, 3) [N]."""
        return np.array([rest.forces for rest in self.rests])


def predict(
    rover: CompliantRover, start: RestingRover, commanded: ArrayLike, progress: Progress = no_progress
) -> PredictedMotion:
    """Follow set points, straight from each to the next.

    Args:
        rover: the yielding rover on its ground.
        start: where it rests at first.
        commanded: set points, (n, legs × 6) [rad].
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The rests that it comes to.

    Raises:
        InvalidInput: the set points have another shape.
        Cancelled: ``progress`` raised it.
    """
    path = np.asarray(commanded, float)
    if path.ndim != 2 or path.shape[1] != len(start.commanded) or not np.isfinite(path).all():
        raise InvalidInput(
            f"a commanded motion needs n × {len(start.commanded)} finite joint angles [rad]", shape=list(path.shape)
        )
    rests: list[RestingRover] = []
    rest, reason = start, ""
    for i, target in enumerate(path):
        progress(i / len(path), "predicting how the rover gives way")
        rest = advanced(rover, rest, target)
        if not rest.settled:
            reason = f"at waypoint {i} nothing holds the rover in balance: it would tip over, slide or sit down"
            break
        rests.append(rest)
    gaps = np.array([rover.gaps(one) for one in rests]).reshape(len(rests), rover.robot.leg_count)
    return PredictedMotion(tuple(rests), reason, gaps)


def advanced(rover: CompliantRover, rest: RestingRover, commanded: Array) -> RestingRover:
    """The equilibrium after the set points went straight to others; the ground is looked at every ``STRIDE``.

    Args:
        rover: the yielding rover on its ground.
        rest: where it rests at first.
        commanded: the others, (legs × 6,) [rad].

    Returns:
        Where it rests then.
    """
    origin = rest.commanded
    parts = max(1, int(np.ceil(np.abs(commanded - origin).max() / STRIDE)))
    for part in range(1, parts + 1):
        target = commanded if part == parts else origin + part / parts * (commanded - origin)
        rest = rover.after(rest, target)
        if not rest.settled:
            break
    return rest
