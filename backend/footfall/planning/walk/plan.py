"""Plan a walk from where the rover stands to a goal; check everything; say no with a reason.

The method is that of Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006): a search
of stances, for each foot move a transition, and motions that stay feasible all the way.
"""

from collections import Counter
from dataclasses import replace

import numpy as np

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.answers import Check, No, Status
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.around import NoWay, cost_grid, is_easy, way_around
from footfall.planning.walk.assemble import checks_of, walk_of
from footfall.planning.walk.begins_near import begins_near
from footfall.planning.walk.body_way import At
from footfall.planning.walk.footfalls import Footfalls, footfalls
from footfall.planning.walk.footprint import Footprint, footprint
from footfall.planning.walk.goal_ground import goal_ground_refused
from footfall.planning.walk.ground_cost import costed
from footfall.planning.walk.guide import guide
from footfall.planning.walk.problem import (
    Blocked,
    Place,
    WalkGoal,
    WalkPlan,
    WalkResult,
    WalkSettings,
    foot_moves_in_words,
    goal_of,
)
from footfall.planning.walk.rappel import OnSlope, in_site, on_slope, provenance_of
from footfall.planning.walk.search import Search
from footfall.planning.walk.smooth import smoothed
from footfall.planning.walk.start import overloaded, start_of
from footfall.planning.walk.tether_refused import through_chassis
from footfall.planning.walk.transition_kernel import vector_of
from footfall.planning.walk.travel_cost import TravelCost, travel_cost
from footfall.planning.walk.world import World
from footfall.planning.watch import OutOfTime, Watch
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import Whole, without_holes_between

BESIDE = 4.5
"""Ground that is looked at beyond start and goal [m]."""
ASIDE = 10.0
"""How far beside the straight way to the goal the chassis may go around something [m]."""
MOST_NAMED = 8
"""Kinds of failures that are told."""
FARTHEST = 60.0
"""A goal is at most so far away [m]."""
NOTHING_KNOWN = "no ground at all is known between start and goal; build a terrain"
TRY = "choose another goal, raise the time limit, or allow less clearance, margin or reserve"

Goal = WalkGoal | tuple[float, float] | tuple[float, float, float]


def plan_walk(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: Goal,
    seed: int | None = None,
    settings: WalkSettings | None = None,
    progress: Progress = no_progress,
    tether: Tether | None = None,
) -> WalkResult:
    """Plan a walk to ``goal``.

    The same arguments give the same walk in any process, unless the time limit cuts search or smoothing short.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands at first.
        goal: a WalkGoal, or x, y [m] and, if it matters, yaw [rad] in site.
        seed: replaces that of ``settings``; None: theirs.
        settings: with what is planned and checked; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        tether: that the rover hangs on; None: none.

    Returns:
        The answer; a walk that is not found is an answer with a reason, and with the walk that comes nearest.

    Raises:
        InvalidInput: goal or settings make no sense, one names a leg that there is not, or the state is of another
            robot.
        NotFound: the robot does not have the posture that ``settings.smoothing`` names.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or WalkSettings()
    if not isinstance(settings, WalkSettings):
        raise InvalidInput("a walk takes WalkSettings")
    settings.require_legs(robot.description)
    if seed is not None:
        settings = replace(settings, seed=seed)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    if (posture := settings.smoothing.posture) is not None:
        robot.posture(posture)
        if not settings.smoothing.rounds:
            raise InvalidInput("smoothing comes near a posture: ask for 1 round of it or more, or for no posture")
    asked = goal_of(goal)
    if tether is not None:
        return _rappel(robot, dem, state, asked, settings, tether, progress)
    provenance = Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest}, settings, settings.seed)
    return _Attempt(robot, dem, state, asked, settings, provenance, progress).run()


def _rappel(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    goal: WalkGoal,
    settings: WalkSettings,
    tether: Tether,
    progress: Progress,
) -> WalkResult:
    """The walk of a rover on a tether, planned in the frame of its slope."""
    provenance = provenance_of(dem, state, robot, settings, tether)
    asked = goal_ground_refused(dem, goal) or on_slope(robot, dem, state, goal, settings, tether)
    if isinstance(asked, No):
        return WalkResult(asked.status, None, asked.reason, (), goal, provenance)
    ground = asked.hung.frame.ground
    attempt = _Attempt(robot, ground, state, asked.goal, asked.settings, provenance, progress, asked)
    return in_site(robot, dem, asked, attempt.run())


class _Attempt:
    def __init__(
        self,
        robot: Robot,
        dem: Dem,
        state: RobotState,
        goal: WalkGoal,
        settings: WalkSettings,
        provenance: Provenance,
        progress: Progress,
        slope: OnSlope | None = None,
    ) -> None:
        self.slope = slope
        self.robot, self.dem, self.state = robot, dem, state
        self.goal, self.settings, self.provenance = goal, settings, provenance
        self.watch = Watch(progress, settings.time_limit)

    def run(self) -> WalkResult:
        self.watch.phase(0.0, "looking at the ground")
        refusal = goal_ground_refused(self.dem, self.goal) if self.slope is None else None
        if refusal is not None:
            return self._no(refusal.status, refusal.reason)
        start = start_of(self.robot, self.dem, self.state) if self.slope is None else self.slope.start
        if isinstance(start, str):
            return self._no(Status.START_INVALID, start)
        refusal = overloaded(self.robot, start, self.settings) if self.slope is None else ""
        if refusal:
            return self._no(Status.START_INVALID, refusal)
        here, there = start.T_site_base[:2, 3], np.array([self.goal.x, self.goal.y])
        away = float(np.linalg.norm(there - here))
        if away > FARTHEST:
            reason = f"the goal is {away:z.1f} m away, a walk covers at most {FARTHEST:g} m; choose a nearer one"
            return self._no(Status.GOAL_INVALID, reason)
        low, high = np.minimum(here, there) - BESIDE, np.maximum(here, there) + BESIDE
        whole = self._whole(low, high, start)
        if whole is None:
            return self._no(Status.UNKNOWN_GROUND, NOTHING_KNOWN)
        places = self._places(low, high)
        ease = footprint(self.robot, self.settings.height)
        refusal = self._places_refused(places, ease)
        if refusal:
            return self._no(Status.GOAL_INVALID, refusal)
        begin = vector_of(np.ascontiguousarray(start.T_site_base[:3]))[[0, 1, 5]]
        end = np.array([self.goal.x, self.goal.y, begin[2] if self.goal.yaw is None else self.goal.yaw])
        spacing, standing = self.settings.spacing, start.stance.contacts
        cost = travel_cost(self.robot, self.dem, places, spacing, standing, ease, begin, end)
        through = None
        if not is_easy(cost):
            through = self._around(cost, start)
            if isinstance(through, NoWay):
                return self._no(Status.NO_PATH, self._enclosed(through))
            low, high = through.min(axis=0) - BESIDE, through.max(axis=0) + BESIDE
            whole = self._whole(low, high, start)
            if whole is None:
                return self._no(Status.UNKNOWN_GROUND, NOTHING_KNOWN)
            places = self._places(low, high)
        hung = None if self.slope is None else self.slope.hung
        with self.watch.uncounted():
            world = World(self.robot, Nearby(whole.dem, whole.filled), self.settings, start.T_site_base, hung)
        refusal = "" if hung is None else through_chassis(world, start)
        if refusal:
            return self._no(Status.START_INVALID, refusal)
        way = guide(whole.dem, begin, end, ease, through)
        self.watch.phase(0.05, "searching for foot moves")
        searches: list[Search] = []
        for attempt in range(self.settings.attempts):
            search = Search(world, places, way, self.goal, start, self.watch, attempt)
            searches.append(search)
            if (short := search.out_of_reach()) is not None:
                return self._no(Status.GOAL_INVALID, out_of_reach_in_words(*short) + self._near(world, start))
            if (missed := search.unreached_pin()) is not None:
                return self._no(Status.GOAL_INVALID, unreached_in_words(self._pin(missed[0]), missed[1]))
            try:
                found = search.run()
            except OutOfTime:
                return self._not_found(searches, Status.TIME_LIMIT)
            if found is not None:
                moves, closing, report = smoothed(world, start, found[0].way(), found[1], ease.height, self.watch)
                self.watch.phase(1.0, "done")
                plan = walk_of(self.goal, start, moves, closing, self.provenance)
                checks = checks_of(plan, self.settings)
                return WalkResult(Status.FOUND, plan, "", checks, self.goal, self.provenance, smoothed=report)
        return self._not_found(searches, Status.NO_PATH)

    def _whole(self, low: Array, high: Array, start: At) -> Whole | None:
        """The ground that is looked at between two corners (2,) [m] and under a tether; None where none is known."""
        if self.slope is not None:
            anchor = self.slope.hung.frame.tether(self.slope.hung.tether).anchor[:2]
            low, high = np.minimum(low, anchor), np.maximum(high, anchor)
        return without_holes_between(self.dem, low - BESIDE, high + BESIDE, np.array(start.stance.contacts))

    def _places(self, low: Array, high: Array) -> Footfalls:
        """Where feet may be put between two corners (2,) [m], and what that costs."""
        settings, radius, frame = self.settings, self.robot.wheel_radius, None
        weights = settings.footfall_costs
        if self.slope is None:
            found = footfalls(self.robot, self.dem, low, high, settings)
        else:
            frame, hung = self.slope.hung.frame, self.slope.hung
            found = footfalls(self.robot, self.dem, low, high, replace(settings, forbidden=()))
            found = hung.places(found, radius, settings.forbidden)
        return costed(self.dem, found, radius, weights, frame)

    def _around(self, straight: TravelCost, start: At) -> Array | NoWay:
        """The chassis' way to the goal, around what is in the straight one."""
        begin, end = straight.begin[:2], straight.end[:2]
        west, south, east, north = self.dem.geometry.bounds
        low = np.maximum(np.minimum(begin, end) - ASIDE, (west, south))
        high = np.minimum(np.maximum(begin, end) + ASIDE, (east, north))
        places = self._places(low - BESIDE, high + BESIDE)
        spacing, standing = self.settings.spacing, start.stance.contacts
        ease, turns = straight.footprint, (straight.begin, straight.end)
        cost = travel_cost(self.robot, self.dem, places, spacing, standing, ease, *turns)
        return way_around(cost_grid(cost, low, high), begin, end, self.goal.within)

    def _near(self, world: World, start: At) -> str:
        """Which bodies are nearer at the start than is asked for, to be put behind a refusal."""
        return begins_near(self.robot, world.ground, start, self.settings.clearance)

    def _in_site(self, x: float, y: float) -> tuple[float, float]:
        """A place on the ground that is planned on, in site [m]."""
        return (x, y) if self.slope is None else self.slope.hung.in_site(x, y)

    def _pin(self, number: int) -> Place:
        """A pinned place as it was asked for, in site."""
        asked = self.provenance.settings
        return (asked if isinstance(asked, WalkSettings) else self.settings).pinned[number]

    def _enclosed(self, nearest: NoWay) -> str:
        """Why the goal can't be reached, whatever is tried."""
        x, y = self._in_site(nearest.x, nearest.y)
        return (
            f"no way leads to the goal within {ASIDE:g} m beside the straight one: the chassis gets no nearer than "
            f"{nearest.short:z.1f} m, at ({x:z.1f}, {y:z.1f}), beyond which not every leg has a place "
            "to stand: the ground is unknown, too steep, too rough or forbidden; choose another goal, or allow more "
            "ground"
        )

    def _places_refused(self, places: Footfalls, ease: Footprint) -> str:
        """Why no stance can be at the goal; empty where there may be one."""
        if not len(places.contacts):
            return "no foot can be put anywhere between start and goal: all ground is unknown, too steep or too rough"
        for pin in range(len(self.settings.pinned)):
            if not (places.pinned == pin).any():
                place = self._pin(pin)
                return (
                    f"no foot can stand on the pinned place ({place.x:g}, {place.y:g}): it is unknown, too steep, too "
                    "rough, forbidden or too far; pin another place"
                )
        if self.goal.yaw is None:
            return ""
        feet = ease.at(self.goal.x, self.goal.y, self.goal.yaw)
        away, _ = places.tree.query(feet)
        leg = int(np.argmax(away))
        if away[leg] <= self.settings.longest:
            return ""
        x, y = self._in_site(*feet[leg].tolist())
        return (
            f"leg {leg} would have no place to stand at the goal: the nearest is {away[leg]:z.2f} m from where it "
            f"would be, ({x:z.2f}, {y:z.2f}); choose another goal or heading"
        )

    def _not_found(self, searches: list[Search], status: Status) -> WalkResult:
        best = min(searches, key=lambda search: search.nearest.left)
        nearest = best.nearest
        way = nearest.way()
        partial = walk_of(self.goal, best.start, way, None, self.provenance) if way else None
        at = nearest.at.T_site_base[:2, 3]
        short = float(np.hypot(self.goal.x - at[0], self.goal.y - at[1]))
        failures: Counter[tuple[str, int, float, float]] = Counter()
        for search in searches:
            failures.update(search.failures)
        failed = failures.most_common(MOST_NAMED)
        tried = sum(search.tried for search in searches)
        why = f"{self.settings.time_limit:g} s passed"
        if status is not Status.TIME_LIMIT:
            why = "nothing more was left to try"
        made = foot_moves_in_words(partial) if partial else "0 foot moves"
        unmet = [self._pin(pin) for pin in range(len(self.settings.pinned)) if pin not in nearest.pins]
        made += "".join(f", no foot on the pinned place ({pin.x:g}, {pin.y:g})" for pin in unmet)
        stopped = "; ".join(f"{_of(check, leg)} {count} times" for check, leg, count in _summed(failures)[:MOST_NAMED])
        reason = (
            f"no walk to the goal was found after {tried} foot moves were tried: {why}; the nearest comes within "
            f"{short:z.2f} m with {made}; what failed most: {stopped or 'nothing'}; {TRY}"
            f"{'' if self.settings.payload_mass is None else ', or take off payload'}"
            f"{self._near(best.world, best.start)}"
        )
        blocked = tuple(Blocked(check, leg if leg >= 0 else None, x, y, count) for (check, leg, x, y), count in failed)
        return self._no(status, reason, partial, blocked)

    def _no(
        self, status: Status, reason: str, partial: WalkPlan | None = None, blocked: tuple[Blocked, ...] = ()
    ) -> WalkResult:
        checks: tuple[Check, ...] = ()
        return WalkResult(status, None, reason, checks, self.goal, self.provenance, partial, blocked)


def out_of_reach_in_words(leg: int, left: float) -> str:
    """Why no walk ends at the goal; left: of the way to it where the leg has its last footfall [m]."""
    return (
        f"leg {leg} has no footfall on which it stands with the chassis at the goal: the last on the way is reached up "
        f"to {left:z.2f} m before it; choose a goal that much nearer, or another heading, take images that show more "
        "ground, or allow steeper ground or less spacing of footfalls"
    )


def unreached_in_words(place: Place, away: float) -> str:
    """Why no walk puts a foot on a pinned place; away: from the nearest where a leg that may comes to [m]."""
    who, other = ("every leg", "") if place.leg is None else (f"leg {place.leg}", ", leave it to any leg")
    nearest = f": it comes no nearer than {away:z.2f} m to it" if np.isfinite(away) else ""
    return (
        f"the pinned place ({place.x:g}, {place.y:g}) is out of reach of {who} on the way to the goal, or forbidden to "
        f"it{nearest}; pin another place{other}, or choose a goal by which the way leads nearer"
    )


def _of(check: str, leg: int) -> str:
    return f"{check} of leg {leg}" if leg >= 0 else check


def _summed(failures: Counter[tuple[str, int, float, float]]) -> list[tuple[str, int, int]]:
    """Check, leg and count, wherever it was; most often first."""
    counts: dict[tuple[str, int], int] = {}
    for (check, leg, _, _), count in failures.items():
        counts[check, leg] = counts.get((check, leg), 0) + count
    return [(check, leg, count) for (check, leg), count in sorted(counts.items(), key=lambda one: -one[1])]
