"""One walk: what is asked, with which settings, and what comes back.

Terms are those of Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006): a *step*
places or removes one foot, a *foot move* is a removal and a placement. A walk of m foot moves has m + 1 stances, and
before each foot move, and after the last one, the chassis moves over all its feet.
"""

from collections.abc import Mapping
from dataclasses import field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.friction import FRICTION
from footfall.balance.tether import Tether
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.product import Product
from footfall.core.value import LATER, Provenance, Value, before, value
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.body.move import JOINT_RESERVE, REACH_RESERVE
from footfall.planning.motion import BODY, Motion
from footfall.planning.walk.smoothing import Smoothed, Smoothing

if TYPE_CHECKING:
    from footfall.robot.description import RobotDescription

SUPPORTS: Mapping[str, str] = {
    "required": "the feet that stand always have a conservative support polygon around the centre of mass",
    "preferred": "stances and poses with a conservative support polygon first, others where there are none",
    "ignored": "the support polygon of the feet that stand is enough",
}
"""What the conservative support polygon counts for. On a tether polygons are seen along the slope's normal; in every
case forces of the ground and the tether must hold the rover, and with ``required`` also without any one of the feet
that stand. The tether itself is not thought lost."""

FINEST = 0.05
"""Least spacing of footfalls [m]: with less there are more of them than can be looked at."""

MOST_ATTEMPTS = 12
"""Searches for one walk: each may try twice as much as the one before, and more would not end within hours."""

LEAST_MARGIN = 0.05
"""What walks, gaits and closed loops keep of the support polygon unless asked otherwise [m]."""
MOST_TORQUE = 0.9
"""The share of a joint's torque limit that they may take."""
CLEARANCE = 0.01
"""What walks and gaits add to every clearance of the robot description [m]."""
STEEPEST = 0.9
"""The slope under a footfall that they take at most [rad]."""
LIFT_HEIGHT, RAISED_TERRAIN = 0.2, 0.05
"""How high they lift a wheel straight up, and by how much they raise the terrain for a swing [m]."""

LIFT, SWING, LOWER = "lift", "swing", "lower"
"""Phases of a foot move, in their order, after :data:`.motion.BODY`, in which the chassis moves."""


@value
class WalkGoal(Value):
    """Where the chassis is to be: x, y [m] and yaw [rad] in site; yaw None: whichever way it faces.

    within: how far its origin may be from there, seen from above [m]. turned: how far its heading may be off [rad].
    """

    x: float
    y: float
    yaw: float | None = None
    within: float = 0.15
    turned: float = 0.15

    def check(self) -> None:
        """Raises InvalidInput for a place or heading that is not finite, and for a nearness that is not above zero."""
        if not np.isfinite([self.x, self.y]).all() or (self.yaw is not None and not np.isfinite(self.yaw)):
            raise InvalidInput("a goal needs finite x and y [m], and a finite yaw [rad] or none")
        require_above_zero(within=self.within, turned=self.turned)


def goal_of(goal: WalkGoal | tuple[float, ...]) -> WalkGoal:
    """A goal as it is, or of x, y [m] and, if it matters, yaw [rad]. Raises InvalidInput for more numbers, or fewer."""
    if isinstance(goal, WalkGoal):
        return goal
    if len(goal) not in (2, 3):
        raise InvalidInput("a goal needs x and y [m], and yaw [rad] if it matters", given=len(goal))
    return WalkGoal(*map(float, goal))


@value
class Place(Value):
    """A place on the ground that the operator speaks about: x, y [m], as large as ``radius`` [m].

    leg: whose; None: of every leg.
    """

    x: float
    y: float
    radius: float = 0.2
    leg: int | None = None

    def check(self) -> None:
        """Raises InvalidInput for a place that is not finite, and for a radius that is not above zero."""
        if not np.isfinite([self.x, self.y]).all():
            raise InvalidInput("a place needs finite x and y [m]")
        require_above_zero(radius=self.radius)


@value
class FootfallCosts(Value):
    """What a footfall costs by the ground under its wheel, in foot moves; 0: it is no matter.

    slope: of each radian. roughness: of each metre that the ground is off its plane (RMS). age: of each hour by which
    the oldest of it was measured before the newest of the map. deviation: of each metre of the standard deviation of
    its heights. A map that does not say how old or how sure it is costs nothing for that.
    """

    slope: float = 0.0
    roughness: float = 0.0
    age: float = 0.0
    deviation: float = 0.0

    def check(self) -> None:
        """Raises InvalidInput for a cost that is negative."""
        require_not_negative(slope=self.slope, roughness=self.roughness, age=self.age, deviation=self.deviation)


@value
class WalkSettings(Value):
    """spacing: between footfalls that are considered [m]. steepest: slope under a footfall, at most [rad].

    support: one of SUPPORTS. least_margin: of the centre of mass to the support polygon of the feet that stand [m].
    friction: between wheel and ground. most_torque: largest share of a joint's torque limit.
    footfall_costs: by the ground under the wheel, in whose place as good ground beside it is taken.
    payload_mass [kg], payload_position (3,) [m]: as of BalanceSettings, in support, friction and torques; the box that
    must stay clear is that of the robot's description.
    clearance: added to every clearance of the robot description [m].
    reach_reserve: how far every leg on the ground stays from straight and from folded [m]; joint_reserve: how far
    joints stay from their limits [rad]. What the start has less of is only not to get less.
    lift: how high a wheel is lifted straight up and let down [m]. raise_terrain: the swing is checked against terrain
    raised by this much [m].
    longest: foot move, at most [m]. height: of the chassis above its feet that is preferred [m]; None: the planner's.
    forbidden: ground on which no foot is put. pinned: places each of which a foot is put on, in any order.
    seed: of all that is random. time_limit: wall clock [s]. smoothing: of the walk that is found.
    attempts: searches that are begun before there is no walk, each of which may try twice as much as the one before.
    """

    spacing: float = 0.2
    steepest: float = STEEPEST
    support: str = "preferred"
    least_margin: float = LEAST_MARGIN
    friction: float = FRICTION
    most_torque: float = MOST_TORQUE
    clearance: float = CLEARANCE
    reach_reserve: float = REACH_RESERVE
    joint_reserve: float = JOINT_RESERVE
    lift: float = LIFT_HEIGHT
    raise_terrain: float = RAISED_TERRAIN
    longest: float = 1.2
    height: float | None = None
    forbidden: tuple[Place, ...] = ()
    pinned: tuple[Place, ...] = ()
    seed: int = 0
    time_limit: float = 60.0
    smoothing: Smoothing = field(default=Smoothing(), metadata=before(Smoothing(rounds=0)))
    payload_mass: float | None = field(default=None, metadata=LATER)
    payload_position: NDArray[np.float64] | None = field(default=None, metadata=LATER)
    footfall_costs: FootfallCosts = field(default=FootfallCosts(), metadata=before(FootfallCosts()))
    attempts: int = field(default=8, metadata=LATER)

    @property
    def balance(self) -> BalanceSettings:
        """What the rover is held by: friction and payload, on Earth."""
        return BalanceSettings(
            friction=self.friction, payload_mass=self.payload_mass, payload_position=self.payload_position
        )

    def check(self) -> None:
        """Raises InvalidInput for an unknown kind of support, and for numbers out of range."""
        if self.support not in SUPPORTS:
            raise InvalidInput(f"support is one of {', '.join(SUPPORTS)}", support=self.support)
        require_above_zero(
            spacing=self.spacing,
            steepest=self.steepest,
            friction=self.friction,
            most_torque=self.most_torque,
            lift=self.lift,
            longest=self.longest,
            height=1.0 if self.height is None else self.height,
            time_limit=self.time_limit,
        )
        require_not_negative(
            least_margin=self.least_margin,
            clearance=self.clearance,
            reach_reserve=self.reach_reserve,
            joint_reserve=self.joint_reserve,
            raise_terrain=self.raise_terrain,
        )
        if self.spacing < FINEST:
            raise InvalidInput(f"the spacing of footfalls is at least {FINEST:g} m", spacing=self.spacing)
        if self.seed < 0 or not self.most_torque <= 1.0:
            raise InvalidInput("the seed must not be negative, and most_torque at most 1")
        if not 1 <= self.attempts <= MOST_ATTEMPTS:
            raise InvalidInput(f"a walk is searched in 1 to {MOST_ATTEMPTS} attempts", attempts=self.attempts)
        self.balance.check()

    def require_legs(self, robot: "RobotDescription") -> None:
        """Raises InvalidInput for a forbidden or pinned place of a leg that the robot does not have."""
        for one in (*self.forbidden, *self.pinned):
            if one.leg is not None and not 0 <= one.leg < len(robot.legs):
                what = f"the place ({one.x:g}, {one.y:g}) is said of leg {one.leg}"
                raise InvalidInput(f"{what}: {robot.name} has legs 0 to {len(robot.legs) - 1}", leg=one.leg)


@value
class Stance(Value):
    """Where the feet stand, all of them on the ground: one row a leg.

    contacts: (legs, 3) site [m]; normals: (legs, 3) of the ground there, unit. Ts_site_wheel: (legs, 4, 4) where the
    wheels are, which neither roll nor turn while they stand. branches: (legs,) of the inverse kinematics.
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    Ts_site_wheel: NDArray[np.float64]
    branches: NDArray[np.int64]


@value
class Tethered(Value):
    """A walk's tether. up: (3,) unit, the normal of the slope, along which support polygons are seen.

    lengths: (n,) from anchor to attachment at each waypoint, which the drum has paid out there [m]. pulls: (n,) with
    which the rover is held there [N].
    """

    tether: Tether
    up: NDArray[np.float64]
    lengths: NDArray[np.float64]
    pulls: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidInput for a normal that is not of length 1, and where a waypoint lacks its length or pull."""
        if self.up.shape != (3,) or not abs(float(np.linalg.norm(self.up)) - 1.0) < 1e-6:
            raise InvalidInput("the normal of a tethered walk's slope needs three numbers, of length 1")
        if self.lengths.ndim != 1 or self.lengths.shape != self.pulls.shape:
            raise InvalidInput("every waypoint of a tethered walk needs a length and a pull")


class CheckedMotion(Product):
    """Base of a walk and of a gait, whose own fields these are, as in :class:`WalkPlan`.

    groups: (m,) legs that each foot move moves together.
    """

    __slots__ = ()

    goal: WalkGoal
    groups: tuple[tuple[int, ...], ...]
    stances: tuple[Stance, ...]
    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    moves: NDArray[np.int64]
    phases: tuple[str, ...]
    margins: NDArray[np.float64]
    torques: NDArray[np.float64]
    tethered: Tethered | None

    @property
    def motion(self) -> Motion:
        """What moves, row by row. Raises InvalidInput where a foot is lifted in none of the foot moves."""
        stays = np.ones((len(self.waypoints), len(self.stances[0].contacts)), bool)
        for row, (move, phase) in enumerate(zip(self.moves, self.phases, strict=True)):
            if phase == BODY:
                continue
            if not 0 <= move < len(self.groups):
                raise InvalidInput(f"waypoint {row} lifts a foot in foot move {move}, there are {len(self.groups)}")
            stays[row, list(self.groups[move])] = False
        return Motion(self.waypoints, self.Ts_site_base, stays, self.phases)

    @property
    def chassis_way(self) -> float:
        """How far the chassis' origin goes [m]."""
        return float(sum(np.linalg.norm(b - a) for a, b in pairwise(self.Ts_site_base[:, :3, 3])))

    def require_complete(self, called: str) -> None:
        """Raises InvalidInput unless all is told of each waypoint; called: what this is, for a person."""
        columns = (self.Ts_site_base, self.moves, self.phases, self.margins, self.torques)
        if {len(each) for each in columns} != {len(self.waypoints)}:
            raise InvalidInput(f"every waypoint of {called} needs a pose, a foot move, a phase, a margin and a torque")


@value
class WalkPlan(CheckedMotion):
    """A checked walk. Joints move in straight lines between waypoints.

    stances: m + 1, of which each differs from the next by the foot of legs[i]; legs: (m,). waypoints: (n, legs × 6)
    [rad]; Ts_site_base: (n, 4, 4), between them the chassis' origin is on a straight line and it turns about one
    axis. moves: (n,) the number of the foot move, 0…m, that a waypoint's motion belongs to (m: the chassis' way
    after the last one). phases: (n,) ``body``, ``lift``, ``swing`` or ``lower``: the phase whose motion ends at the
    waypoint; of each foot move in this order, the chassis fixed in all but ``body``. The first waypoint is the
    start.
    margins: (n,) of the centre of mass to the polygon that the settings ask for, of the feet that stand [m].
    torques: (n,) largest share of a joint's torque limit there. tethered: how a walk on a tether uses it: of that
    margins are seen along the slope's normal, and torques may be the share of the drum's most force.
    """

    goal: WalkGoal
    legs: tuple[int, ...]
    stances: tuple[Stance, ...]
    waypoints: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    moves: NDArray[np.int64]
    phases: tuple[str, ...]
    margins: NDArray[np.float64]
    torques: NDArray[np.float64]
    provenance: Provenance
    tethered: Tethered | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput where waypoints lack something, and unless there is one stance more than foot moves."""
        if self.tethered is not None and len(self.tethered.lengths) != len(self.waypoints):
            raise InvalidInput("every waypoint of a tethered walk needs a length and a pull")
        self.require_complete("a walk")
        if len(self.stances) != len(self.legs) + 1:
            raise InvalidInput("a walk of m foot moves has m + 1 stances")

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The legs that each foot move moves: one."""
        return tuple((leg,) for leg in self.legs)

    @property
    def foot_moves(self) -> int:
        """How many feet are removed and placed; in the paper's count that is twice as many steps."""
        return len(self.legs)

    @property
    def paid_out(self) -> NDArray[np.float64]:
        """What the tether gets longer in each foot move, and in what is after the last, (m + 1,) [m].

        Less than zero is hauled in, and without a tether there is nothing.
        """
        out = np.zeros(self.foot_moves + 1)
        if self.tethered is not None:
            np.add.at(out, self.moves[1:], np.diff(self.tethered.lengths))
        return out


def part_name(number: int, of: int) -> str:
    """What part ``number``, 0…, of a walk of so many foot moves is called, for a person: who counts from 1."""
    return f"foot move {number + 1}" if number < of else "the chassis' last way"


def foot_moves_in_words(plan: WalkPlan) -> str:
    """How many there are, in words."""
    return f"{plan.foot_moves} foot move{'' if plan.foot_moves == 1 else 's'}"


@value
class Blocked(Value):
    """What stopped a search most often: the check that failed, where, and how often.

    check: its name. leg: whose, or None. x, y: where on the ground [m], NaN where that has no place. Of the check that
    ended a gait x, y are the chassis', and move is the number of the foot move, 0…; lacks: by how much it fails, in
    ``unit``, NaN where that is not known.
    """

    check_name: str
    leg: int | None
    x: float
    y: float
    count: int
    move: int | None = field(default=None, metadata=LATER)
    lacks: float | None = field(default=None, metadata=LATER)
    unit: str = field(default="", metadata=LATER)


@value
class WalkResult(Value):
    """The answer to one request for a walk. ``reason`` says what failed, where, by how much, what to try.

    plan: with status FOUND, and only then. partial: otherwise the walk that comes nearest to the goal, checked as far
    as it goes, where there is one. blocked: what stopped the search, most often first. smoothed: what
    smoothing came to, where there was any.
    """

    status: Status
    plan: WalkPlan | None
    reason: str
    checks: tuple[Check, ...]
    goal: WalkGoal
    provenance: Provenance
    partial: WalkPlan | None = None
    blocked: tuple[Blocked, ...] = field(default=())
    smoothed: Smoothed | None = field(default=None, metadata=LATER)

    def check(self) -> None:
        """Raises InvalidInput where a plan comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)
