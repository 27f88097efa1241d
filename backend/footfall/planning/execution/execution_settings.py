"""How a planned step is to be commanded, and what its prediction must keep."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Value, value
from footfall.planning.compliance.compliance_settings import ComplianceSettings

MODES: Mapping[str, tuple[str, str]] = {
    "pose_held": (
        "pose held",
        "The standing legs are commanded too, so that the chassis keeps its pose while the load moves.",
    ),
    "droop_aware": (
        "droop-aware",
        "The leg is commanded so that its wheel goes where it was planned although the rover sags.",
    ),
    "as_commanded": (
        "as commanded",
        "The leg is commanded what was planned, lifted higher if its wheel would not clear the ground.",
    ),
}
"""mode → its name and what it does, for a person; the first is what is delivered."""

HELD = ("pose_held", "droop_aware")
"""Modes that a walk can be executed in; the others don't tell where a foot comes down."""


@value
class ExecutionSettings(Value):
    """mode: one of MODES.

    - pose_held: the supporting legs are commanded so that the chassis keeps its pose while the load moves.
    - droop_aware: the swing leg is commanded so that the sagging rover carries its wheel where it was planned.
    - as_commanded: the swing leg is commanded what was planned; the lift is raised until the wheel clears the ground.

    least_clearance: of the swing leg's wheel over the ground while it swings [m]; most_lift: of a plan [m].
    largest_offset: of the touch-down from the planned contact, seen from above [m]. least_load: on each supporting
    wheel [N]; spare_friction: share of its friction that stays unused, as the ground's normal under a wheel is known to
    some degrees only. speed_fraction: of the joints' speed limits. pause: at the end of each phase, to come to rest
    [s]. stop_share: lowering ends when the wheel's force has risen by this share of the weight that a wheel bears if
    all bear alike; overshoot: how far below the ground it aims [m]. tolerance: of the stiffnesses, as a share, for the
    uncertainty of the clearance. clearance: added to every clearance of the robot description [m].
    conservative: commands are asked for the conservative polygon of the feet that stand, not the plain one.
    """

    mode: str = "pose_held"
    least_clearance: float = 0.05
    most_lift: float = 0.5
    largest_offset: float = 0.1
    least_load: float = 50.0
    spare_friction: float = 0.1
    speed_fraction: float = 0.7
    pause: float = 0.8
    stop_share: float = 0.12
    overshoot: float = 0.06
    tolerance: float = 0.2
    clearance: float = 0.0
    compliance: ComplianceSettings = field(default_factory=ComplianceSettings)
    conservative: bool = field(default=False, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput for an unknown mode, and for lengths, shares and times out of range."""
        if self.mode not in MODES:
            raise InvalidInput(f"mode is one of {', '.join(MODES)}", mode=self.mode)
        for name in ("most_lift", "largest_offset", "stop_share", "overshoot"):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} must be above zero", **{name: getattr(self, name)})
        for name in ("least_clearance", "least_load", "pause", "clearance"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} can't be negative", **{name: getattr(self, name)})
        if not 0 < self.speed_fraction <= 1:
            raise InvalidInput("speed_fraction must be above 0 and at most 1", speed_fraction=self.speed_fraction)
        if not 0 < self.spare_friction < 1:
            raise InvalidInput("spare_friction must be above 0 and below 1", spare_friction=self.spare_friction)
        if not 0 <= self.tolerance < 0.9:
            raise InvalidInput("tolerance must be at least 0 and below 0.9", tolerance=self.tolerance)
