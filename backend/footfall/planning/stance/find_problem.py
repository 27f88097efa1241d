"""Which shift of the chassis makes a footfall possible: how it is asked, and what comes back."""

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance, Value, value
from footfall.planning.stance.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.stance.shift import BodyShift
from footfall.planning.step.problem import Check, Footfall, Status


@value
class FindShiftSettings(Value):
    """lift, raise_terrain, clearance, conservative, least_margin, friction: of the step that is to follow, and of the
    move of the chassis (see StepSettings).

    lever: what a turn of the chassis costs, in metres a radian: about how far the feet are from its middle [m].
    most_shift: largest dx, dy, dz [m]. most_tilt: largest droll, dpitch [rad]. most_turn: largest dyaw [rad].
    time_limit: wall clock [s].
    """

    lift: float = 0.2
    raise_terrain: float = 0.15
    clearance: float = 0.0
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = 0.6
    lever: float = 2.0
    most_shift: float = 0.8
    most_tilt: float = 0.2
    most_turn: float = 0.4
    time_limit: float = 30.0

    def check(self) -> None:
        for name in ("lift", "friction", "lever", "most_shift", "most_tilt", "most_turn", "time_limit"):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} must be above zero", **{name: getattr(self, name)})
        for name in ("raise_terrain", "clearance", "least_margin"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} can't be negative", **{name: getattr(self, name)})
        if self.most_shift > 2.0 or max(self.most_tilt, self.most_turn) > 1.0:
            raise InvalidInput("most_shift is at most 2 m, most_tilt and most_turn at most 1 rad")

    @property
    def move(self) -> BodyMoveSettings:
        """Those of the move of the chassis."""
        return BodyMoveSettings(self.clearance, self.conservative, self.least_margin, self.friction, self.time_limit)


@value
class ShiftResult(Value):
    """The answer to one request. ``reason`` says what limits, by how much, what to try; or that no shift is needed.

    shift: no shift at all where the footfall is possible as the rover stands; then plan is None.
    plan: the checked move to the shift. cost: √(dx² + dy² + dz² + lever² · (droll² + dpitch² + dyaw²)) [m].
    checks: those of the move.
    """

    status: Status
    shift: BodyShift | None
    plan: BodyMovePlan | None
    cost: float
    reason: str
    checks: tuple[Check, ...]
    footfall: Footfall
    provenance: Provenance

    def check(self) -> None:
        if (self.status is Status.FOUND) != (self.shift is not None):
            raise InvalidInput("a shift comes with status FOUND, and only then")
        if self.plan is not None and self.shift is None:
            raise InvalidInput("a plan comes with its shift")
