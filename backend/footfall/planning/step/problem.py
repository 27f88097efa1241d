"""One step: what is asked, with which settings, and what comes back."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.product import Product
from footfall.core.value import LATER, Provenance, Value, before, value
from footfall.maps.layers import LIFT, RAISE_TERRAIN
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.motion import Motion
from footfall.robot.leg_branches import BRANCHES

PLANNERS: Mapping[str, str] = {
    "auto": "line, then fast, then astar, then sbl: the first that leads to a plan that passes every check",
    "line": "a straight line in joint space",
    "fast": "SBL, compiled over the certificate of clearance",
    "astar": "A* on a grid of wheel positions; the wheel's way is the shortest on that grid",
    "sbl": "SBL with meshes: lazy, from both ends",
    "rrtconnect": "RRT-Connect with meshes",
    "kpiece": "KPIECE1 with meshes, one tree",
    "bitstar": "BIT* with meshes, its first path",
    "race": "all planners in turn, each turn longer: the first that leads to a plan that passes every check",
}
"""Planners by name, with what each does."""
GOAL_ORDERS: Mapping[str, str] = {
    "motion": "the knee bent as at the start first, then the shortest motion",
    "clearance": "the posture with the most room at the footfall first, however far the leg has to move",
}
"""Orders in which postures at the footfall are tried, with what comes first in each."""
MOST_THROUGH = 20
"""Points that one swing may be asked to pass."""

Point = tuple[float, float, float]


@value
class StepSettings(Value):
    """planner: one of PLANNERS; ``auto`` tries line, then fast, then astar, then sbl; ``race`` lets all race.

    lift: height of the waypoints above start and goal [m].
    raise_terrain: the swing is checked against terrain raised by this much [m].
    clearance: added to every clearance of the robot description [m].
    epsilon: bisection resolution of edge checks [rad].
    milestones: SBL's bound s on milestones.
    radius: SBL's ρ, how far from a milestone the next is placed; ``sbl`` joins its trees within it, too [rad].
    cell: A*'s task-space grid [m].
    conservative: check the remaining feet's conservative polygon, not the plain one.
    least_margin: least margin of the centre of mass to that polygon [m].
    friction: coefficient between wheel and ground, for the torque check.
    seed: of every random choice.
    time_limit: wall clock [s]; a search that would run longer stops with TIME_LIMIT.
    branch: of the inverse kinematics at the goal, 0…7 (robot/ik.py), or None for whichever suits best. Its wrist does
        not count: a straight wrist joins two branches.
    goals: one of GOAL_ORDERS, which of the postures that stand on the footfall are tried first. Of clearances within
        1 mm the order is that of ``motion``.
    steep_ground: whether the compiled check of the swing looks at the wheel's own shape where the balls around it leave
        unsure whether it keeps off the ground, as they mostly do where that is steep. None: where an end of the swing
        is unsure.
    """

    planner: str = "auto"
    lift: float = LIFT
    raise_terrain: float = RAISE_TERRAIN
    clearance: float = 0.0
    epsilon: float = 0.01
    milestones: int = 5000
    radius: float = 0.4
    cell: float = 0.2
    conservative: bool = False
    least_margin: float = 0.0
    friction: float = FRICTION
    seed: int = 0
    time_limit: float = 30.0
    branch: int | None = field(default=None, metadata=LATER)
    goals: str = field(default="motion", metadata=LATER)
    steep_ground: bool | None = field(default=None, metadata=before(False))

    def check(self) -> None:
        """Raises InvalidInput for an unknown planner, order of goals or branch, and for numbers out of range."""
        if self.planner not in PLANNERS:
            raise InvalidInput(f"planner is one of {', '.join(PLANNERS)}", planner=self.planner)
        require_above_zero(lift=self.lift, epsilon=self.epsilon, radius=self.radius, cell=self.cell)
        require_above_zero(friction=self.friction, time_limit=self.time_limit)
        require_not_negative(raise_terrain=self.raise_terrain, clearance=self.clearance, least_margin=self.least_margin)
        if self.milestones < 1 or self.seed < 0:
            raise InvalidInput("milestones must be at least 1 and the seed not negative")
        if self.branch is not None and self.branch not in range(BRANCHES):
            raise InvalidInput(f"branch is 0…{BRANCHES - 1}, or None for whichever suits best", branch=self.branch)
        if self.goals not in GOAL_ORDERS:
            raise InvalidInput(f"goals is one of {', '.join(GOAL_ORDERS)}", goals=self.goals)


@value
class Footfall(Value):
    """The chosen contact of one leg: where the wheel is to touch, site frame [m]."""

    leg: int
    x: float
    y: float

    def check(self) -> None:
        """Raises InvalidInput for a negative leg, and for a place that is not finite."""
        if self.leg < 0 or not np.isfinite([self.x, self.y]).all():
            raise InvalidInput("a footfall needs a leg 0… and finite x and y [m]")


@value
class Decision(Value):
    """One thing that was decided on the way to an answer. about: "goal" or "planner".

    taken: whether this one was taken; a goal or planner that was tried and not taken has False. text: which, how it
    ranked, and why not.
    """

    about: str
    taken: bool
    text: str


@value
class StepPlan(Product):
    """A checked motion of one leg; the chassis and the other legs stay as they are.

    waypoints: (n, legs × 6) postures [rad]; the first is the start, the last the goal.
    phases: (n,) "lift", "swing" or "lower": the phase whose motion ends at the waypoint (the first: "lift").
    T_site_base: chassis pose, (4, 4).
    contact: where the wheel will touch, site frame, (3,) [m]; normal: of the ground there, (3,).
    branch: id of the inverse-kinematics branch at the goal.
    planner: which planner found it (never "auto" or "race").
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
    def motion(self) -> Motion:
        """What moves, row by row."""
        count, legs = len(self.waypoints), self.waypoints.shape[1] // 6
        stays = np.ones((count, legs), bool)
        stays[1:, self.leg] = False
        return Motion(self.waypoints, np.tile(self.T_site_base, (count, 1, 1)), stays, self.phases)


@value
class NearestPlace(Value):
    """A good place near one that was refused: x, y in the site, how far it is away [m].

    of: "maps", where they call it reachable and stable, or "ground", where it is known.
    """

    x: float
    y: float
    away: float
    of: str


@value
class PlanResult(Value):
    """The answer to one request for a step. ``reason`` says what failed, where, by how much, what to try.

    decisions: what was tried and taken, where that was asked for. through: the points, site [m], that the wheel's
    centre was to pass during the swing. instead: the nearest good place, where that was asked for and unknown ground is
    what refused.
    """

    status: Status
    plan: StepPlan | None
    reason: str
    checks: tuple[Check, ...]
    footfall: Footfall
    provenance: Provenance
    decisions: tuple[Decision, ...] = field(default=(), metadata=LATER)
    through: tuple[Point, ...] = field(default=(), metadata=LATER)
    instead: NearestPlace | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput where a plan comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)
