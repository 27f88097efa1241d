"""What physics says of the commands of a robot that others described."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.robot.legged.legged_robot import LeggedRobot


@dataclass(frozen=True)
class LeggedLimits:
    """What is still good. air: how long a foot that stands may be off the ground at a time [s]; slip: over the ground
    while it stands [m]; off: of the chassis from where the plan has it, and of a foot that is put down from its place,
    as a share of the longest leg; effort: share of a joint's limit.
    """

    air: float = 0.1
    slip: float = 0.01
    off: float = 0.1
    effort: float = 1.0


@dataclass(frozen=True)
class LeggedReport:
    """What came of a sequence in physics, beside what was planned.

    commands: how many rows were done; seconds: until then. tipped: why it fell, or "". contacts: (what, row, largest
    force [N]) that nobody planned. air: (legs,) longest time that a foot was off the ground while it stands [s];
    air_row: (legs,) the row when that was, −1 for never. slip: (legs,) longest way over the ground from when a foot
    came down until it is lifted [m]. touch: (legs,) how far a foot was put down from its place, seen from above, at
    most [m]; NaN for legs that are not moved. stayed: (leg, row) of foot moves whose foot did not leave the ground, and
    where they end. settled: how much lower than planned the chassis stands before the first row [m]. drift, sink, lean:
    how far it was from where the plan has it, seen from above [m], down [m], and turned [rad], at most; settled counts
    to sink. effort: largest share of a limit, NaN where no limit is said. assumed: what no description says. failures:
    what does not hold, in words.
    """

    commands: int
    seconds: float
    tipped: str
    contacts: tuple[tuple[str, int, float], ...]
    air: Array
    air_row: NDArray[np.int64]
    slip: Array
    touch: Array
    stayed: tuple[tuple[int, int], ...]
    settled: float
    drift: float
    sink: float
    lean: float
    effort: float
    assumed: tuple[str, ...]
    failures: tuple[str, ...] = ()

    @property
    def touched(self) -> bool:
        """Whether a foot was put down."""
        return bool(np.isfinite(self.touch).any())

    @property
    def passed(self) -> bool:
        """Whether everything held."""
        return not self.failures


def legged_failures(robot: LeggedRobot, found: LeggedReport, limits: LeggedLimits) -> tuple[str, ...]:
    """What does not hold, in words: what it was, by how much, and how much would be good."""
    names, far = robot.leg_names, limits.off * robot.length
    good = f"{1000 * far:z.0f} mm are good"
    said = [found.tipped] if found.tipped else []
    said += [f"row {row + 1}: {what} touched with {force:z.1f} N" for what, row, force in found.contacts]
    said += [f"row {row + 1}: foot {names[leg]} did not leave the ground" for leg, row in found.stayed]
    for leg in robot.legs:
        if found.air[leg] > limits.air:
            said.append(
                f"row {found.air_row[leg] + 1}: foot {names[leg]}, which stands, was off the ground for "
                f"{found.air[leg]:z.2f} s; {limits.air:g} s are good"
            )
        if found.slip[leg] > limits.slip:
            slipped, most = 1000 * found.slip[leg], 1000 * limits.slip
            said.append(f"foot {names[leg]}, which stands, slipped {slipped:z.1f} mm; {most:g} mm are good")
        if found.touch[leg] > far:
            said.append(f"foot {names[leg]} was put down {1000 * found.touch[leg]:z.0f} mm from its place; {good}")
    for way, size in (("beside", found.drift), ("below", found.sink)):
        if size > far:
            said.append(f"the chassis was {1000 * size:z.0f} mm {way} where the plan has it; {good}")
    if found.effort > limits.effort:
        said.append(f"a joint took {found.effort:.0%} of its limit")
    return tuple(said)
