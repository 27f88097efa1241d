"""Which shift of the chassis makes a footfall possible: how it is asked, and what comes back."""

from dataclasses import field, replace

from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance, Value, before, value
from footfall.maps.layers import LIFT, RAISE_TERRAIN
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.move import JOINT_RESERVE, REACH_RESERVE, BodyMovePlan, BodyMoveSettings
from footfall.planning.step.problem import Footfall


@value
class FindShiftSettings(Value):
    """What a shift of the chassis is looked for with.

    lift, raise_terrain, clearance, conservative, least_margin, friction: of the step that is to follow, and of the move
    of the chassis (see StepSettings).

    lever: what a turn of the chassis costs, in metres a radian: about how far the feet are from its middle [m].
    most_shift: largest dx, dy, dz [m]. most_tilt: largest droll, dpitch [rad]. most_turn: largest dyaw [rad].
    time_limit: wall clock [s]. reach_reserve [m], joint_reserve [rad]: of the move of the chassis (see
    BodyMoveSettings), where a shift keeps them.
    """

    lift: float = LIFT
    raise_terrain: float = RAISE_TERRAIN
    clearance: float = 0.0
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = FRICTION
    lever: float = 2.0
    most_shift: float = 0.8
    most_tilt: float = 0.2
    most_turn: float = 0.4
    time_limit: float = 30.0
    reach_reserve: float = field(default=REACH_RESERVE, metadata=before(0.0))
    joint_reserve: float = field(default=JOINT_RESERVE, metadata=before(0.0))

    def check(self) -> None:
        """Raises InvalidInput for lengths, angles, reserves, friction or time out of range."""
        require_above_zero(lift=self.lift, friction=self.friction, lever=self.lever)
        require_above_zero(most_shift=self.most_shift, most_tilt=self.most_tilt, most_turn=self.most_turn)
        require_above_zero(time_limit=self.time_limit)
        require_not_negative(raise_terrain=self.raise_terrain, clearance=self.clearance, least_margin=self.least_margin)
        require_not_negative(reach_reserve=self.reach_reserve, joint_reserve=self.joint_reserve)
        if self.most_shift > 2.0 or max(self.most_tilt, self.most_turn) > 1.0:
            raise InvalidInput("most_shift is at most 2 m, most_tilt and most_turn at most 1 rad")

    @property
    def bare(self) -> "FindShiftSettings":
        """These, but without any reserve."""
        return replace(self, reach_reserve=0.0, joint_reserve=0.0) if self.reach_reserve or self.joint_reserve else self

    @property
    def move(self) -> BodyMoveSettings:
        """Those of the move of the chassis."""
        return BodyMoveSettings(
            self.clearance,
            self.conservative,
            self.least_margin,
            self.friction,
            self.time_limit,
            self.reach_reserve,
            self.joint_reserve,
        )


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
        """Raises InvalidInput where a shift comes without the status for it, or a plan without its shift."""
        require_answer(self.status, self.shift, "a shift")
        if self.plan is not None and self.shift is None:
            raise InvalidInput("a plan comes with its shift")
