"""Requests for steps and walks of legged robots, and the answers."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.bounds import require_above_zero, require_distances
from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Provenance, Value, value
from footfall.planning.answers import Check, Status
from footfall.planning.motion import Motion

PHASES = ("body", "lift", "swing", "lower")


@value
class LeggedSettings(Value):
    """What steps and walks of a robot that others described keep to.

    least_margin: of the centre of mass to the support polygon, a share of the longest leg. conservative: with all feet
    on the ground that polygon must survive the loss of any one of them; four feet have none, so it is for six.

    most_effort: largest share of a joint's limit. stride: how far a foot goes in one foot move, a share of the stroke
    of the stance at ease. lift: of a swing over the ground under it, a share of the longest leg. steepest: slope under
    a foot [rad]. time_limit [s].
    """

    least_margin: float = 0.05
    conservative: bool = False
    most_effort: float = 0.9
    stride: float = 0.8
    lift: float = 0.1
    steepest: float = 0.45
    time_limit: float = 300.0

    def check(self) -> None:
        """Raises InvalidInput for a margin, lift, slope or time out of range, and shares not above 0 and at most 1."""
        require_distances(least_margin=self.least_margin)
        require_above_zero("s", time_limit=self.time_limit)
        require_above_zero(lift=self.lift, steepest=self.steepest)
        if not 0 < self.most_effort <= 1 or not 0 < self.stride <= 1:
            raise InvalidInput("most_effort and stride are shares above 0, at most 1")


@value
class LeggedState(Value):
    """A robot standing still. q: (joints,) in the order of LeggedRobot.joint_names; T_site_base: (4, 4).

    soles: (legs, 3) centres of the soles; contacts, normals: (legs, 3) of the ground under them; all in site [m].
    set_points: of its joints, (joints,) [rad or m], where it sags and they are known.
    """

    robot: str
    q: NDArray[np.float64]
    T_site_base: NDArray[np.float64]
    soles: NDArray[np.float64]
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    set_points: NDArray[np.float64] | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput for feet that lack numbers, and for numbers that are not finite."""
        if not self.soles.shape == self.contacts.shape == self.normals.shape or self.soles.shape[1:] != (3,):
            raise InvalidInput("soles, contacts and normals need three numbers for each leg")
        if not all(np.isfinite(part).all() for part in (self.q, self.T_site_base, self.soles)):
            raise InvalidInput("a state needs finite numbers")


@value
class LeggedPlan(Value):
    """A checked motion of one foot move or many.

    waypoints: (n, joints), straight between; Ts_site_base: (n, 4, 4). phases: (n,) of PHASES: what ends there. legs:
    (n,) the leg in the air on the way there, −1 for none. moves: (m,) which leg each foot move moves. start, end: the
    states before and after.
    """

    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    phases: tuple[str, ...]
    legs: NDArray[np.int64]
    moves: tuple[int, ...]
    start: LeggedState
    end: LeggedState

    def check(self) -> None:
        """Raises InvalidInput for waypoints that lack a pose, phase or leg, and for an unknown phase."""
        if not len(self.waypoints) == len(self.Ts_site_base) == len(self.phases) == len(self.legs):
            raise InvalidInput("a pose, a phase and a leg are needed for each waypoint")
        if not set(self.phases) <= set(PHASES):
            raise InvalidInput(f"a phase is one of {', '.join(PHASES)}")

    @property
    def motion(self) -> Motion:
        """What moves, row by row."""
        stays = self.legs[:, None] != np.arange(len(self.start.soles))
        return Motion(self.waypoints, self.Ts_site_base, stays, self.phases)

    @property
    def chassis_way(self) -> float:
        """How far the base's origin goes [m]."""
        return float(np.linalg.norm(np.diff(self.Ts_site_base[:, :3, 3], axis=0), axis=1).sum())


@value
class LeggedResult(Value):
    """The answer. reason: what failed, where, by how much; empty where a plan was found.

    refused: check → how often it refused a try of the last foot move. partial: how far a walk came that was not found.
    unchecked: what could not be judged, and why.
    """

    status: Status
    plan: LeggedPlan | None
    reason: str
    checks: tuple[Check, ...]
    refused: tuple[tuple[str, int], ...]
    unchecked: tuple[str, ...]
    provenance: Provenance
    partial: LeggedPlan | None = None
