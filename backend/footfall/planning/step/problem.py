"""One step: what is asked, with which settings, and what comes back."""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance, Value, value, value_enum

PLANNERS = ("auto", "line", "fast", "astar", "sbl", "rrtconnect")


@value_enum
class Status(Enum):
    """How planning ended. Only FOUND comes with a plan."""

    FOUND = "found"
    NO_PATH = "no_path"
    TIME_LIMIT = "time_limit"
    START_INVALID = "start_invalid"
    GOAL_INVALID = "goal_invalid"
    OFF_MAP = "off_map"
    UNKNOWN_GROUND = "unknown_ground"


@value
class StepSettings(Value):
    """planner: one of PLANNERS; ``auto`` tries line, then fast, then astar, then sbl.

    lift: height of the waypoints above start and goal [m].
    raise_terrain: the swing is checked against terrain raised by this much [m].
    clearance: added to every clearance of the robot description [m].
    epsilon: bisection resolution of edge checks [rad].
    milestones: SBL's bound s on milestones.
    radius: SBL's largest connection distance ρ [rad].
    cell: A*'s task-space grid [m].
    conservative: check the remaining feet's conservative polygon, not the plain one.
    least_margin: least margin of the centre of mass to that polygon [m].
    friction: coefficient between wheel and ground, for the torque check.
    seed: of every random choice.
    time_limit: wall clock [s]; a search that would run longer stops with TIME_LIMIT.
    """

    planner: str = "auto"
    lift: float = 0.2
    raise_terrain: float = 0.15
    clearance: float = 0.0
    epsilon: float = 0.01
    milestones: int = 5000
    radius: float = 0.4
    cell: float = 0.2
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = 0.6
    seed: int = 0
    time_limit: float = 30.0

    def check(self) -> None:
        if self.planner not in PLANNERS:
            raise InvalidInput(f"planner is one of {', '.join(PLANNERS)}", planner=self.planner)
        for name in ("lift", "epsilon", "radius", "cell", "friction", "time_limit"):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} must be above zero", **{name: getattr(self, name)})
        for name in ("raise_terrain", "clearance", "least_margin"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} can't be negative", **{name: getattr(self, name)})
        if self.milestones < 1 or self.seed < 0:
            raise InvalidInput("milestones must be at least 1 and the seed not negative")


@value
class Footfall(Value):
    """The chosen contact of one leg: where the wheel is to touch, site frame [m]."""

    leg: int
    x: float
    y: float

    def check(self) -> None:
        if self.leg < 0 or not np.isfinite([self.x, self.y]).all():
            raise InvalidInput("a footfall needs a leg 0… and finite x and y [m]")


@value
class Check(Value):
    """One thing that was checked. margin: positive = held by that much; NaN where it has no size.

    where: where the margin is least (waypoint, phase, pair of links…), for a person.
    """

    name: str
    holds: bool
    margin: float
    unit: str
    where: str


@value
class StepPlan(Value):
    """A checked motion of one leg; the chassis and the other legs stay as they are.

    waypoints: (n, legs × 6) postures [rad]; the first is the start, the last the goal.
    phases: (n,) "lift", "swing" or "lower": the phase whose motion ends at the waypoint (the first: "lift").
    T_site_base: chassis pose, (4, 4).
    contact: where the wheel will touch, site frame, (3,) [m]; normal: of the ground there, (3,).
    branch: id of the inverse-kinematics branch at the goal.
    planner: which planner found it (never "auto").
    """

    leg: int
    waypoints: NDArray[np.float64]
    phases: tuple[str, ...]
    T_site_base: NDArray[np.float64]
    contact: NDArray[np.float64]
    normal: NDArray[np.float64]
    branch: int
    planner: str
    provenance: Provenance

    @property
    def parents(self) -> dict[str, str]:
        """name → digest of the values it was planned from."""
        return dict(self.provenance.parents)


@value
class PlanResult(Value):
    """The answer to one request for a step. ``reason`` says what failed, where, by how much, what to try."""

    status: Status
    plan: StepPlan | None
    reason: str
    checks: tuple[Check, ...]
    footfall: Footfall
    provenance: Provenance

    def check(self) -> None:
        if (self.status is Status.FOUND) != (self.plan is not None):
            raise InvalidInput("a plan comes with status FOUND, and only then")
