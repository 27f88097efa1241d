"""Plan one step: lift, swing, lower; check everything; say no with a reason.

The method is that of "Motion planning for a six-legged lunar robot" (Hauser, Bretl, Latombe & Wilcox, 2006)
and of FootFall: the chassis and the other legs stay, the wheel goes straight up to a waypoint above its start, swings
in joint space over ground that is raised by a safety height, and comes straight down onto its goal.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.answers import Check, No, Status
from footfall.planning.looking.how_to_see import how_to_see
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.scene.lift import branch_of
from footfall.planning.step.footing import LegStance
from footfall.planning.step.goals import ADVICE, Goal, Goals
from footfall.planning.step.lift_off import lift_off
from footfall.planning.step.nearest_place import Place, nearest_place, place_in_words
from footfall.planning.step.planners import REGISTRY, PlannerAnswer, SwingProblem
from footfall.planning.step.problem import Decision, Footfall, PlanResult, Point, StepPlan, StepSettings
from footfall.planning.step.rise import space_of
from footfall.planning.step.search.smooth import smooth
from footfall.planning.step.shut_in import shut_in
from footfall.planning.step.situation import RAISED, Situation
from footfall.planning.step.through import require_points, via_postures
from footfall.planning.step.turns import QUICK, Turn, Turns
from footfall.planning.step.up_and_back import where_it_stands
from footfall.planning.step.verify import recheck
from footfall.planning.watch import OutOfTime, OutOfTurn, Watch
from footfall.robot.model import Robot
from footfall.robot.tolerance import state_inside
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def plan_step(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    target: tuple[float, float],
    planner: str = "auto",
    seed: int | None = None,
    settings: StepSettings | None = None,
    progress: Progress = no_progress,
    *,
    through: Sequence[Point] = (),
    explain: bool = False,
    instead: Sequence[Place] | None = None,
) -> PlanResult:
    """Plan how ``leg`` steps onto ``target``.

    The same arguments give the same plan in any process, unless the time limit cuts a search short.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands; the chassis and the other legs stay so.
        leg: number of the leg that steps, from 0.
        target: where its wheel is to touch, (x, y) in site [m].
        planner: replaces that of ``settings``; "auto": theirs.
        seed: replaces that of ``settings``; None: theirs.
        settings: with what is planned and checked; None: as delivered.
        progress: called with a fraction 0…1 and a text at least every 0.3 s; may raise Cancelled.
        through: points (x, y, z) in site [m] that the wheel's centre passes during the swing, in this order.
        explain: whether the result says what was tried and taken, and why; that takes a few hundredths of a second.
        instead: places (x, y) [m] that maps call good, nearest first: a refusal for unknown ground names the nearest
            good one; None: it names none.

    Returns:
        The answer; a step that can't be made is an answer with a reason.

    Raises:
        InvalidInput: leg, target, points or settings make no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    leg = robot.require_leg(leg)
    settings = settings or StepSettings()
    if planner != "auto":
        settings = replace(settings, planner=planner)
    if seed is not None:
        settings = replace(settings, seed=seed)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(f"the state is of {state.robot}, the robot is {robot.name}")
    if len(target) != 2:
        raise InvalidInput("a target needs x and y [m] in the site frame")
    footfall = Footfall(leg, float(target[0]), float(target[1]))
    points = require_points(through)
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    provenance = Provenance(parents, settings, settings.seed)
    watch = Watch(progress, settings.time_limit)
    watch.phase(0.0, "looking at the ground")
    attempt = _Attempt(robot, dem, state_inside(robot, state), leg, settings, watch, points, explain)
    try:
        found = attempt.run(footfall)
    except OutOfTime:
        reason = f"{settings.time_limit:g} s passed while {watch.text}; raise time_limit or take another planner"
        found = No(Status.TIME_LIMIT, reason)
    if isinstance(found, No):
        decisions = found.decisions if isinstance(found, _Nowhere) else ()
        reason, other = found.reason, None
        if found.status is Status.UNKNOWN_GROUND:
            way = how_to_see(robot, dem, state, (footfall.x, footfall.y), robot.wheel_radius)
            reason = f"{reason}; {way}" if way else reason
            other = None if instead is None else nearest_place(robot, dem, footfall.x, footfall.y, instead)
            reason = reason if other is None else f"{reason}; {place_in_words(footfall.x, footfall.y, other)}"
        rest = (found.checks, footfall, provenance, decisions, points, other)
        return PlanResult(found.status, None, reason, *rest)
    plan = StepPlan(
        leg=leg,
        waypoints=found.waypoints,
        phases=found.phases,
        T_site_base=state.T_site_base,
        contact=found.contact.point,
        normal=found.contact.normal,
        branch=found.branch,
        planner=found.planner,
        provenance=provenance,
    )
    watch.phase(1.0, "done")
    return PlanResult(Status.FOUND, plan, "", found.checks, footfall, provenance, found.decisions, points)


@dataclass(frozen=True)
class _Nowhere(No):
    """No planner led to the footfall. decisions: what was tried, where that was asked for."""

    decisions: tuple[Decision, ...] = ()


@dataclass(frozen=True)
class _Yes:
    waypoints: Array
    phases: tuple[str, ...]
    checks: tuple[Check, ...]
    contact: Contact
    branch: int
    planner: str
    decisions: tuple[Decision, ...]


@dataclass(frozen=True)
class _Failure:
    """A planner that did not lead to a goal; why: said when asked, as saying it takes the meshes.

    for_good: more looks would not help it.
    """

    why: Callable[[], str]
    checks: tuple[Check, ...] = ()
    for_good: bool = True

    @property
    def failed(self) -> Check | None:
        """The first check that does not hold of a path that was found."""
        return next((check for check in self.checks if not check.holds), None)


_Failures = dict[str, list[_Failure]]
"""Of each planner those of its last turn, a goal each."""


class _Attempt:
    def __init__(
        self,
        robot: Robot,
        dem: Dem,
        state: RobotState,
        leg: int,
        settings: StepSettings,
        watch: Watch,
        through: tuple[Point, ...],
        explain: bool,
    ) -> None:
        self.robot, self.dem, self.state, self.leg = robot, dem, state, leg
        self.settings, self.watch = settings, watch
        self.through, self.explain = through, explain

    def run(self, footfall: Footfall) -> _Yes | No:
        stance = LegStance(self.robot, self.dem, self.state, self.leg)
        contact = footfall_contact(self.robot, self.dem, footfall.x, footfall.y)
        if not isinstance(contact, No):
            return self._step(stance, contact)
        unseen = contact.status is Status.UNKNOWN_GROUND and not self.through
        stands = where_it_stands(stance, footfall) if unseen else None
        return contact if stands is None else self._up_and_back(stance, stands)

    def _step(self, stance: LegStance, contact: Contact) -> _Yes | No:
        start = lift_off(stance, self.settings, self.watch)
        if isinstance(start, No):
            return start
        situation, up = start.situation, start.up
        self.watch.phase(0.2, "choosing how the leg stands at the goal")
        goals = Goals(situation, self.watch, stance, contact, up[0])
        if goals.refusal:
            return No(Status.GOAL_INVALID, goals.refusal)
        return self._search(situation, contact, up, goals)

    def _up_and_back(self, stance: LegStance, contact: Contact) -> _Yes | No:
        """Onto the contact that the wheel has, joint for joint as it was lifted."""
        start = lift_off(stance, self.settings, self.watch)
        if isinstance(start, No):
            return start
        up = start.up
        waypoints, phases = self._joined(up, up[-1:], up[::-1])
        self.watch.phase(0.85, "checking the whole path")
        checks = recheck(start.situation, self.dem, waypoints, phases, self.watch.pulse)
        bad = next((check for check in checks if not check.holds), None)
        if bad is not None:
            return No(Status.NO_PATH, f"up and back fails the check of {_check_in_words(bad)}; {ADVICE}", checks)
        return _Yes(waypoints, phases, checks, contact, branch_of(self.robot, self.leg, up[0]), "line", ())

    def _search(self, situation: Situation, contact: Contact, up: Array, goals: Goals) -> _Yes | No:
        if self.through:
            space = space_of(situation, self.watch, RAISED)
            vias = [via_postures(situation, space, self.through, up[-1], goal.up[-1]) for goal in goals]
            if all(isinstance(via, str) for via in vias):
                return No(Status.NO_PATH, f"the swing can't pass the points that were asked for: {vias[0]}")
        turns, barred = Turns(self.settings.planner), None
        last: _Failures = {}
        for number, turn in enumerate(turns):
            if barred is None and last and turn.planner not in QUICK:
                barred = shut_in(situation, up[-1], [goal.up[-1] for goal in goals])
                if barred:
                    return self._nowhere(last, f"{barred}; choose a footfall on this side of it")
            failures = last[turn.planner] = []
            for goal in goals:
                suited = situation.for_swing(up[-1], goal.up[-1])
                # how many turns there will be is not known
                self.watch.phase(0.25 + 0.5 * number / (number + 4), f"planning the swing with {turn.planner}")
                path = self._swing(suited, turn, up[-1], goal)
                if isinstance(path, _Failure):
                    failures.append(path)
                    continue
                waypoints, phases = self._joined(up, path, goal.up[::-1])
                self.watch.phase(0.85, "checking the whole path")
                checks = recheck(suited, self.dem, waypoints, phases, self.watch.pulse)
                bad = [check for check in checks if not check.holds]
                if not bad:
                    decisions = self._decisions(goals, goal, last, turn) if self.explain else ()
                    return _Yes(waypoints, phases, checks, contact, goal.candidate.branch, turn.planner, decisions)
                why = partial("a path of {} fails the check of {}".format, turn.planner, _check_in_words(bad[0]))
                failures.append(_Failure(why, checks))
            if all(failure.for_good for failure in failures):
                turns.has_failed(turn.planner)
        return self._nowhere(last)

    def _nowhere(self, last: _Failures, barred: str = "") -> _Nowhere:
        """The answer after planners failed. barred: what proves that none can succeed, with what to try."""
        self.watch.lift_limit()
        said = _said(last)
        why = barred or f"{'; '.join(_once(last))}; {ADVICE}"
        checks = next((one.checks for failures in last.values() for one in failures if one.checks), ())
        reason = f"no way to the footfall was found: {why}"
        return _Nowhere(Status.NO_PATH, reason, checks, tuple(_tried(said)) if self.explain else ())

    def _decisions(self, goals: Goals, goal: Goal, last: _Failures, turn: Turn) -> tuple[Decision, ...]:
        self.watch.lift_limit()
        self.watch.phase(0.95, "saying why")
        won = f" in turn {turn.number} of the race" if isfinite(turn.looks) else ""
        found = Decision("planner", True, f"{turn.planner} found the swing{won}")
        return *goals.decisions(goal), *_tried(_said(last)), found

    def _swing(self, situation: Situation, turn: Turn, start: Array, goal: Goal) -> Array | _Failure:
        """Waypoints (n, 6) from above the start to above a goal, through all points; shortened between them."""
        space = space_of(situation, self.watch, RAISED)
        via = via_postures(situation, space, self.through, start, goal.up[-1])
        if isinstance(via, str):
            return _Failure(lambda: via)
        path = start[None]
        for there in [*via, goal.up[-1]]:
            try:
                with self.watch.at_most(turn.looks):
                    answer: PlannerAnswer = REGISTRY[turn.planner](SwingProblem(situation, space, path[-1], there))
            except OutOfTurn:
                return _Failure(lambda: f"its last turn, of {turn.looks} looks, ended", for_good=False)
            if answer.path is None:
                return _Failure(answer.why)
            self.watch.phase(0.75, "shortening the path")
            path = np.concatenate([path, (answer.path if answer.short else smooth(space, answer.path))[1:]])
        return path

    def _joined(self, up: Array, swing: Array, down: Array) -> tuple[Array, tuple[str, ...]]:
        """Whole postures of the three phases and the phase that ends at each."""
        q = np.concatenate([up, swing[1:], down[1:]])
        phases = ("lift",) * len(up) + ("swing",) * (len(swing) - 1) + ("lower",) * (len(down) - 1)
        waypoints = np.tile(np.asarray(self.state.posture), (len(q), 1))
        waypoints[:, 6 * self.leg : 6 * self.leg + 6] = q
        return waypoints, phases


def _said(last: _Failures) -> dict[str, list[str]]:
    """The reasons of each planner, a goal each."""
    return {planner: [failure.why() for failure in failures] for planner, failures in last.items() if failures}


def _once(last: _Failures) -> list[str]:
    """Every reason once: several goals often fail for one, and paths of several planners at one check."""
    reasons: dict[str, None] = {}
    failed: dict[str, tuple[Check, dict[str, None]]] = {}
    for planner, failures in last.items():
        for failure in failures:
            if failure.failed is None:
                reasons[failure.why()] = None
            else:
                failed.setdefault(failure.failed.name, (failure.failed, {}))[1][planner] = None
    for check, planners in failed.values():
        paths = (
            f"paths of {', '.join(planners)} fail" if len(planners) > 1 else f"a path of {next(iter(planners))} fails"
        )
        reasons[f"{paths} the check of {_check_in_words(check)}"] = None
    return list(reasons)


def _tried(said: dict[str, list[str]]) -> list[Decision]:
    """One decision for each planner that failed, in the order in which they were tried."""
    found = []
    for planner, whys in said.items():
        goals = f"{len(whys)} goal postures" if len(whys) > 1 else "a goal posture"
        found.append(Decision("planner", False, f"{planner} did not lead to {goals}: {'; '.join(dict.fromkeys(whys))}"))
    return found


def _check_in_words(check: Check) -> str:
    size = f" by {-check.margin:z.3f} {check.unit}" if check.margin < 0 else ""
    return f"{check.name}{size} ({check.where})"
