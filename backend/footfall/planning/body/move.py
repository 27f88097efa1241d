"""One move of the chassis over standing feet: with which settings, and what comes back."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.product import Product
from footfall.core.value import Provenance, Value, before, value
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.motion import BODY, Motion

REACH_RESERVE = 0.02
"""What a move of the chassis leaves every leg short of straight, unless asked otherwise [m]; `stand` leaves 3 cm."""
JOINT_RESERVE = 0.05
"""The same for a joint and its limits [rad]."""


@value
class BodyMoveSettings(Value):
    """clearance: added to every clearance of the robot description [m].

    conservative: check the feet's conservative polygon, not the plain one. least_margin: least margin of the centre of
    mass to that polygon [m]. friction: coefficient between wheel and ground, for the torque check.
    time_limit: wall clock [s].
    reach_reserve: how far a standing leg stays from straight and from folded where the chassis ends [m]. joint_reserve:
    how far its joints stay from their limits there [rad]. What has less already is only not to lose any; 0 asks for
    none.
    """

    clearance: float = 0.0
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = FRICTION
    time_limit: float = 30.0
    reach_reserve: float = field(default=REACH_RESERVE, metadata=before(0.0))
    joint_reserve: float = field(default=JOINT_RESERVE, metadata=before(0.0))

    def check(self) -> None:
        """Raises InvalidInput for friction, time, clearance, margin or reserves out of range."""
        require_above_zero(friction=self.friction, time_limit=self.time_limit)
        require_not_negative(clearance=self.clearance, least_margin=self.least_margin)
        require_not_negative(reach_reserve=self.reach_reserve, joint_reserve=self.joint_reserve)


@value
class BodyMovePlan(Product):
    """A checked motion of the chassis while every standing wheel stays locked where it is.

    waypoints: (n, legs × 6) postures [rad]; the first is the start, the last the goal; joints move in straight lines
    between. Ts_site_base: (n, 4, 4), the chassis pose at each: the origin on a straight line, the turn about one axis.
    standing: the legs whose wheels stand; contacts: where, site frame, (k, 3) [m].
    """

    shift: BodyShift
    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    standing: tuple[int, ...]
    contacts: NDArray[np.float64]
    provenance: Provenance

    @property
    def motion(self) -> Motion:
        """What moves, row by row; wheels that hang in the air go with the chassis."""
        count, legs = len(self.waypoints), self.waypoints.shape[1] // 6
        stays = np.zeros((count, legs), bool)
        stays[:, self.standing] = True
        return Motion(self.waypoints, self.Ts_site_base, stays, (BODY,) * count)


@value
class BodyMoveResult(Value):
    """The answer to one request to move the chassis. ``reason`` says what failed, where, by how much, what to try."""

    status: Status
    plan: BodyMovePlan | None
    reason: str
    checks: tuple[Check, ...]
    shift: BodyShift
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where a plan comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)
