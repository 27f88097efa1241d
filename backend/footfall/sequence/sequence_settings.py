"""With which settings a sequence is made and checked."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidSequence
from footfall.core.value import LATER, Value, value
from footfall.planning.compliance.compliance_settings import ComplianceSettings

FINEST, COARSEST = 1e-4, 0.02
"""Coarser samples would let a leg pass through a rock between two of them: a wheel moves 2 m for each radian."""


@value
class SequenceSettings(Value):
    """With what commands are made and checked.

    speed_fraction: how much of each joint's speed limit a made command uses (0…1]; edits may use all of it.
    sample: largest joint step between two checked postures [rad].
    clearance: added to every clearance of the robot description [m].
    conservative: check the supporting feet's conservative polygon, not the plain one.
    least_margin: least margin of the centre of mass to that polygon [m].
    friction: coefficient between wheel and ground, for the torque rule of a rigid rover.
    payload_mass [kg], payload_position (3,) [m]: as of BalanceSettings, what a rigid rover carries.
    compliance: how a rover sags, for sequences that know how it stood at rest; None: as its description says.
    """

    speed_fraction: float = 0.8
    sample: float = 0.01
    clearance: float = 0.0
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = FRICTION
    compliance: ComplianceSettings | None = field(default=None, metadata=LATER)
    payload_mass: float | None = field(default=None, metadata=LATER)
    payload_position: NDArray[np.float64] | None = field(default=None, metadata=LATER)

    @property
    def balance(self) -> BalanceSettings:
        """What the rover is held by: as ``compliance`` has it, else friction and payload, on Earth."""
        if self.compliance is not None:
            return self.compliance.balance
        return BalanceSettings(
            friction=self.friction, payload_mass=self.payload_mass, payload_position=self.payload_position
        )

    def check(self) -> None:
        """Raises InvalidSequence for what is out of range, InvalidInput for a payload that can't be."""
        if not 0 < self.speed_fraction <= 1:
            raise InvalidSequence("speed_fraction must be above 0 and at most 1", speed_fraction=self.speed_fraction)
        if not FINEST <= self.sample <= COARSEST:
            raise InvalidSequence(f"sample must be {FINEST:g}…{COARSEST:g} rad", sample=self.sample)
        require_not_negative("m", InvalidSequence, clearance=self.clearance, least_margin=self.least_margin)
        require_above_zero("", InvalidSequence, friction=self.friction)
        self.balance.check()
