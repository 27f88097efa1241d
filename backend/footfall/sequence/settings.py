"""With which settings a sequence is made and checked."""

import numpy as np

from footfall.core.errors import InvalidSequence
from footfall.core.value import Value, value


@value
class SequenceSettings(Value):
    """speed_fraction: how much of each joint's speed limit a made command uses (0…1]; edits may use all of it.
    sample: largest joint step between two checked postures [rad].
    clearance: added to every clearance of the robot description [m].
    conservative: check the supporting feet's conservative polygon, not the plain one.
    least_margin: least margin of the centre of mass to that polygon [m].
    """

    speed_fraction: float = 0.8
    sample: float = 0.01
    clearance: float = 0.0
    conservative: bool = False
    least_margin: float = 0.0

    def check(self) -> None:
        if not 0 < self.speed_fraction <= 1:
            raise InvalidSequence("speed_fraction must be above 0 and at most 1", speed_fraction=self.speed_fraction)
        if not 0 < self.sample < np.inf:
            raise InvalidSequence("sample must be above zero [rad]", sample=self.sample)
        if not 0 <= self.clearance < np.inf:
            raise InvalidSequence("clearance can't be negative [m]", clearance=self.clearance)
        if not np.isfinite(self.least_margin):
            raise InvalidSequence("least_margin must be finite [m]")
