"""One gait: what is asked, with which settings, and what comes back.

A *gait* is a periodic order of foot moves whose footfalls follow from the chassis' way alone (Wettergreen & Thorpe,
"Gait generation for legged robots", 1992): what a walk is compared with in Hauser, Bretl, Latombe & Wilcox, "Motion
planning for a six-legged lunar robot" (2006), fig. 7. The chassis stays while feet swing (a *discontinuous* gait,
González de Santos & Jiménez, "Generation of discontinuous gaits for quadruped walking vehicles", 1995), so that a step
of a gait has the phases of a foot move of a walk.
"""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Provenance, Value, value
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.body.move import JOINT_RESERVE, REACH_RESERVE
from footfall.planning.walk.problem import (
    CLEARANCE,
    LEAST_MARGIN,
    LIFT_HEIGHT,
    MOST_TORQUE,
    RAISED_TERRAIN,
    STEEPEST,
    CheckedMotion,
    Stance,
    WalkGoal,
    WalkPlan,
    WalkSettings,
)

TRIPOD, RIPPLE, WAVE = "tripod", "ripple", "wave"
GAITS: Mapping[str, str] = {
    TRIPOD: "three feet move while three stand",
    RIPPLE: "two feet opposite each other move while four stand",
    WAVE: "one foot after the other moves, rear to front, while five stand",
}
"""In words."""

SHORTEST = 0.1
"""Least stride [m]: with less there are more steps than can be looked at."""
MOST_TOLERANCE = 0.75
"""Places farther from an ideal footfall are not looked at [m]: around each of thousands they take gigabytes."""


@value
class GaitSettings(Value):
    """gait: one of GAITS. stride: how far a foot goes in one cycle, at most [m]; shorter ones are tried as well.

    tolerance: how far a foot is put from its ideal footfall, at most [m]. arc: the chassis leaves along its heading and
    turns evenly on an arc of a circle to the goal; else it goes straight and turns evenly. height: of the chassis above
    its feet [m]; None: chosen by what legs reach. The others: as of WalkSettings.
    """

    gait: str = TRIPOD
    stride: float = 0.4
    tolerance: float = 0.15
    arc: bool = False
    height: float | None = None
    lift: float = LIFT_HEIGHT
    steepest: float = STEEPEST
    least_margin: float = LEAST_MARGIN
    friction: float = FRICTION
    most_torque: float = MOST_TORQUE
    clearance: float = CLEARANCE
    reach_reserve: float = REACH_RESERVE
    joint_reserve: float = JOINT_RESERVE
    raise_terrain: float = RAISED_TERRAIN

    def check(self) -> None:
        """Raises InvalidInput for an unknown gait, a stride or tolerance out of range, and what no walk can have."""
        if self.gait not in GAITS:
            raise InvalidInput(f"gait is one of {', '.join(GAITS)}", gait=self.gait)
        require_above_zero(stride=self.stride)
        require_not_negative(tolerance=self.tolerance)
        if self.stride < SHORTEST:
            raise InvalidInput(f"the stride of a gait is at least {SHORTEST:g} m", stride=self.stride)
        if self.tolerance > MOST_TOLERANCE:
            raise InvalidInput(
                f"a foot is put at most {MOST_TOLERANCE:g} m from its ideal footfall", tolerance=self.tolerance
            )
        self.as_walk()

    def as_walk(self) -> WalkSettings:
        """The settings of a walk that is checked alike."""
        return WalkSettings(
            support="ignored",
            steepest=self.steepest,
            least_margin=self.least_margin,
            friction=self.friction,
            most_torque=self.most_torque,
            clearance=self.clearance,
            reach_reserve=self.reach_reserve,
            joint_reserve=self.joint_reserve,
            lift=self.lift,
            raise_terrain=self.raise_terrain,
            height=self.height,
        )


@value
class GaitFailure(Value):
    """The check that ends a gait. move: number of the foot move, 0…; group: its legs, none after the last.

    leg: whose check it is, or None. lacks: positive, in ``unit``; NaN where it is not known, inf where nothing would
    do. x, y: of the chassis before it [m]. posture: (legs × 6,) that was to be taken then [rad], over the feet as they
    were to stand; T_site_base: (4, 4) with the chassis there.
    """

    move: int
    group: tuple[int, ...]
    leg: int | None
    check_name: str
    lacks: float
    unit: str
    x: float
    y: float
    posture: NDArray[np.float64] | None = field(default=None, metadata=LATER)
    T_site_base: NDArray[np.float64] | None = field(default=None, metadata=LATER)

    @property
    def text(self) -> str:
        """For a person."""
        of = "" if self.leg is None else f" of leg {self.leg}"
        short = f" by {self.lacks:.3g} {self.unit}".rstrip() if np.isfinite(self.lacks) else ""
        legs = f"leg{'s' * (len(self.group) > 1)} {', '.join(str(leg) for leg in self.group)}"
        step = f"step {self.move + 1} ({legs})" if self.group else "the chassis' way after the last step"
        return f"{step} fails {self.check_name}{of}{short}, chassis at ({self.x:z.2f}, {self.y:z.2f})"


@value
class GaitPlan(CheckedMotion):
    """A checked gait: a walk in which several feet may move at once.

    groups: (m,) legs that each foot move moves together; stances: m + 1. The first ``settling`` foot moves put feet,
    one by one, from how the rover stood to where its gait has them. stride: taken [m]; duty: share of the foot moves of
    a cycle in which a foot stands. height: of the chassis above its feet [m]; tread: how far feet are from its middle
    at ease [m]. adapted: how many footfalls are not the ideal ones. The others: as of WalkPlan.
    """

    goal: WalkGoal
    groups: tuple[tuple[int, ...], ...]
    settling: int
    stances: tuple[Stance, ...]
    stride: float
    duty: float
    height: float
    tread: float
    adapted: int
    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    moves: NDArray[np.int64]
    phases: tuple[str, ...]
    margins: NDArray[np.float64]
    torques: NDArray[np.float64]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where waypoints lack something, and unless there is one stance more than foot moves."""
        self.require_complete("a gait")
        if len(self.stances) != len(self.groups) + 1:
            raise InvalidInput("a gait of m foot moves has m + 1 stances")

    @property
    def tethered(self) -> None:
        """No gait hangs on a tether."""
        return

    @property
    def feet_moved(self) -> int:
        """How many feet are removed and placed."""
        return sum(len(group) for group in self.groups)

    @property
    def walk(self) -> WalkPlan:
        """The same as a walk, which is exported and carried out. Raises InvalidInput where feet move together."""
        if any(len(group) > 1 for group in self.groups):
            raise InvalidInput("a walk moves one foot at a time, this gait moves several: ask for a wave")
        return WalkPlan(
            goal=self.goal,
            legs=tuple(group[0] for group in self.groups),
            stances=self.stances,
            waypoints=self.waypoints,
            Ts_site_base=self.Ts_site_base,
            moves=self.moves,
            phases=self.phases,
            margins=self.margins,
            torques=self.torques,
            provenance=self.provenance,
        )


@value
class GaitResult(Value):
    """The answer to one request for a gait. ``reason`` tells what failed, where, by how much, what to try.

    plan: where all checks hold all the way to the goal, with status FOUND, and only then; partial: otherwise the gait
    as far as all of them hold, where it begins at all; failure: the check that ended it. walked: how far the chassis
    comes along its way, by the foot that goes farthest [m]; checks: of what was planned, each where it has least left.
    """

    status: Status
    plan: GaitPlan | None
    partial: GaitPlan | None
    reason: str
    failure: GaitFailure | None
    walked: float
    checks: tuple[Check, ...]
    goal: WalkGoal
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where a plan comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)
