"""Plan one step: lift, swing, lower; check everything; say no with a reason.

The method is that of "Motion planning for a six-legged lunar robot" (Hauser, Bretl, Latombe & Wilcox, 2006)
and of FootFall: the chassis and the other legs stay, the wheel goes straight up to a waypoint above its start, swings
in joint space over ground that is raised by a safety height, and comes straight down onto its goal.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.step.edges import Array, Space
from footfall.planning.step.fast import compile_search
from footfall.planning.step.footing import Stance, ground_near, impossible
from footfall.planning.step.ground import Contact, Refused, footfall_contact
from footfall.planning.step.lift import branch_of, vertical
from footfall.planning.step.planners import REGISTRY, Swing, chain
from footfall.planning.step.problem import Check, Footfall, PlanResult, Status, StepPlan, StepSettings
from footfall.planning.step.situation import RAISED, TRUE, Situation
from footfall.planning.step.smooth import smooth
from footfall.planning.step.target import Candidate, candidates
from footfall.planning.step.verify import recheck
from footfall.planning.step.watch import OutOfTime, Watch
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

MOST_GOALS = 3
"""Goal postures whose lowering works that are handed to the planners, best first."""
ADVICE = "choose a footfall nearer to the leg's present one or on more open ground, or lower raise_terrain or clearance"

LIFT_ADVICE = "change the stance, or ask for another lift, raise_terrain, clearance or margin"


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
) -> PlanResult:
    """Plan how ``leg`` steps onto ``target``, (x, y) in site [m].

    planner, seed: replace those of ``settings`` unless left at "auto" and None. progress: called at least every 0.3 s;
    may raise Cancelled.

    Returns a result; a step that can't be made is a result with a reason. Raises InvalidInput where leg, target or
    settings make no sense or the state is of another robot. The same arguments give the same plan in any process,
    unless the time limit cuts a search short.
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
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    provenance = Provenance(parents, settings, settings.seed)
    watch = Watch(progress, settings.time_limit)
    watch.phase(0.0, "looking at the ground")
    attempt = _Attempt(robot, dem, state, leg, settings, watch)
    try:
        found = attempt.run(footfall)
    except OutOfTime:
        reason = f"{settings.time_limit:g} s passed while {watch.text}; raise time_limit or take another planner"
        found = _No(Status.TIME_LIMIT, reason)
    if isinstance(found, _No):
        return PlanResult(found.status, None, found.reason, found.checks, footfall, provenance)
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
    return PlanResult(Status.FOUND, plan, "", found.checks, footfall, provenance)


@dataclass(frozen=True)
class _No:
    status: Status
    reason: str
    checks: tuple[Check, ...] = ()


@dataclass(frozen=True)
class _Yes:
    waypoints: Array
    phases: tuple[str, ...]
    checks: tuple[Check, ...]
    contact: Contact
    branch: int
    planner: str


@dataclass(frozen=True)
class _Goal:
    """A goal posture that the wheel can be lowered to. up: (n, 6) from the goal to above it."""

    candidate: Candidate
    up: Array


class _Goals:
    """Goals, best first, each worked out when it is first asked for."""

    def __init__(self, rest: Iterator[_Goal]) -> None:
        self._found: list[_Goal] = []
        self._rest = rest

    def __iter__(self) -> Iterator[_Goal]:
        yield from self._found
        for goal in self._rest:
            self._found.append(goal)
            yield goal


class _Attempt:
    def __init__(
        self, robot: Robot, dem: Dem, state: RobotState, leg: int, settings: StepSettings, watch: Watch
    ) -> None:
        self.robot, self.dem, self.state, self.leg = robot, dem, state, leg
        self.settings, self.watch = settings, watch

    def run(self, footfall: Footfall) -> _Yes | _No:
        contact = footfall_contact(self.robot, self.dem, footfall.x, footfall.y)
        if isinstance(contact, Refused):
            return _No(contact.status, contact.reason)
        stance = Stance(self.robot, self.dem, self.state, self.leg)
        objection = impossible(stance)
        if objection:
            advice = "correct the state or the terrain, or put the legs down first"
            return _No(Status.START_INVALID, f"the rover can't stand as its state says: {objection}; {advice}")
        ground = ground_near(stance)
        if isinstance(ground, Refused):
            return _No(ground.status, ground.reason)
        self.watch.phase(0.05, "building the collision scene")
        with self.watch.uncounted():
            situation = Situation(self.robot, self.dem, self.state, self.leg, ground, self.settings)
            situation.first_unsure(situation.lower[None], TRUE)
            compile_search(situation.footing.certificate)
        up = self._lift(situation)
        if isinstance(up, _No):
            return up
        branch = branch_of(self.robot, self.leg, up[0])
        self.watch.phase(0.2, "choosing how the leg stands at the goal")
        goals = self._goals(situation, contact, stance, up[0], branch)
        if isinstance(goals, _No):
            return goals
        return self._search(situation, contact, up, goals)

    def _space(self, situation: Situation, terrain: str) -> Space:
        return Space(
            situation.lower,
            situation.upper,
            lambda q: situation.free(q, terrain),
            self.settings.epsilon,
            self.watch.tick,
            lambda qs: situation.first_unsure(qs, terrain),
        )

    def _lift(self, situation: Situation) -> Array | _No:
        """Straight up from where the leg stands, (n, 6)."""
        q = np.array(self.state.leg(self.leg))
        objection = situation.objection(q, TRUE)
        if objection:
            advice = "correct the state or the terrain, move the chassis, or ask for less clearance or margin"
            return _No(Status.START_INVALID, f"the leg can't move from where it stands: {objection}; {advice}")
        lift = self.settings.lift
        up = vertical(self.robot, self.leg, situation.T_site_base, q, lift)
        if isinstance(up, str):
            reason = f"the wheel can't be lifted {lift:.2f} m straight up: {up}; lower lift or change the stance"
            return _No(Status.NO_PATH, reason)
        if not self._passes(situation, up):
            blocked = self._blocked(situation, up)
            reason = f"the wheel can't be lifted {lift:.2f} m straight up: {blocked}; {LIFT_ADVICE}"
            return _No(Status.NO_PATH, reason)
        return up

    def _passes(self, situation: Situation, up: Array) -> bool:
        """Whether a vertical move is free, and its upper end as the start of a swing."""
        return self._space(situation, TRUE).path_is_free(up) and self._space(situation, RAISED).is_free(up[-1])

    def _blocked(self, situation: Situation, up: Array) -> str:
        """What forbids a vertical move that does not pass."""
        space = self._space(situation, TRUE)
        height = self.settings.lift / (len(up) - 1)
        for i, q in enumerate(up):
            if not space.is_free(q):
                return f"{i * height:.2f} m above the ground {situation.objection(q, TRUE)}"
        for i, (a, b) in enumerate(itertools.pairwise(up)):
            t = None if space.edge_is_free(a, b) else space.first_blocked(a, b)
            if t is not None:
                return f"{(i + t) * height:.2f} m above the ground {situation.objection(a + t * (b - a), TRUE)}"
        return f"{self.settings.lift:.2f} m above the ground {situation.objection(up[-1], RAISED)}"

    def _goals(
        self, situation: Situation, contact: Contact, stance: Stance, q_start: Array, branch: int
    ) -> _Goals | _No:
        """Up to MOST_GOALS postures on the contact, each with its free way up; there is at least one."""
        possible = candidates(self.robot, self.leg, contact, situation.T_site_base, q_start, branch)
        x, y, _ = contact.point
        if not possible:
            away, reach = float(np.linalg.norm(contact.point - stance.hip)), stance.reach
            too_far = f", farther than the {reach:.2f} m it can reach" if away > reach else ""
            reason = (
                f"leg {self.leg} can't stand at ({x:.2f}, {y:.2f}): it is {away:.2f} m from its hip{too_far}; no joint "
                "angles inside the limits put the wheel upright there; choose a footfall that the reach map shows green"
            )
            return _No(Status.GOAL_INVALID, reason)
        goals = _Goals(self._worked_out(situation, possible))
        if next(iter(goals), None) is None:
            reason = (
                f"leg {self.leg} can't stand at ({x:.2f}, {y:.2f}): none of {len(possible)} postures that reach it is "
                f"allowed; in the nearest, {self._goal_objection(situation, possible[0])}; {ADVICE}"
            )
            return _No(Status.GOAL_INVALID, reason)
        return goals

    def _worked_out(self, situation: Situation, possible: list[Candidate]) -> Iterator[_Goal]:
        space, found = self._space(situation, TRUE), 0
        for candidate in possible:
            self.watch.tick()
            if not space.is_free(candidate.q):
                continue
            up = vertical(self.robot, self.leg, situation.T_site_base, candidate.q, self.settings.lift)
            if not isinstance(up, str) and self._passes(situation, up):
                found += 1
                yield _Goal(candidate, up)
                if found == MOST_GOALS:
                    return

    def _goal_objection(self, situation: Situation, candidate: Candidate) -> str:
        """What forbids a goal posture or its way up."""
        objection = situation.objection(candidate.q, TRUE)
        if objection:
            return objection
        up = vertical(self.robot, self.leg, situation.T_site_base, candidate.q, self.settings.lift)
        return f"the wheel can't be lowered: {up}" if isinstance(up, str) else self._blocked(situation, up)

    def _search(self, situation: Situation, contact: Contact, up: Array, goals: _Goals) -> _Yes | _No:
        space = self._space(situation, RAISED)
        reasons: list[Callable[[], str]] = []
        failed: tuple[Check, ...] = ()
        names = chain(self.settings.planner)
        for i, name in enumerate(names):
            for goal in goals:
                self.watch.phase(0.25 + 0.5 * i / len(names), f"planning the swing with {name}")
                swing = Swing(situation, space, up[-1], goal.up[-1])
                answer = REGISTRY[name](swing)
                if answer.path is None:
                    reasons.append(answer.why)
                    continue
                self.watch.phase(0.75, "shortening the path")
                path = answer.path if answer.short else smooth(space, answer.path)
                waypoints, phases = self._joined(up, path, goal.up[::-1])
                self.watch.phase(0.85, "checking the whole path")
                checks = recheck(situation, self.dem, waypoints, phases, self.watch.pulse)
                bad = [check for check in checks if not check.holds]
                if not bad:
                    return _Yes(waypoints, phases, checks, contact, goal.candidate.branch, name)
                failed = failed or checks
                reasons.append(partial("a path of {} fails the check of {}".format, name, _told(bad[0])))
        # said only now, as saying it takes the meshes; several goals often fail for one reason
        told = "; ".join(dict.fromkeys(reason() for reason in reasons))
        return _No(Status.NO_PATH, f"no way to the footfall was found: {told}; {ADVICE}", failed)

    def _joined(self, up: Array, swing: Array, down: Array) -> tuple[Array, tuple[str, ...]]:
        """Whole postures of the three phases and the phase that ends at each."""
        q = np.concatenate([up, swing[1:], down[1:]])
        phases = ("lift",) * len(up) + ("swing",) * (len(swing) - 1) + ("lower",) * (len(down) - 1)
        waypoints = np.tile(np.asarray(self.state.posture), (len(q), 1))
        waypoints[:, 6 * self.leg : 6 * self.leg + 6] = q
        return waypoints, phases


def _told(check: Check) -> str:
    size = f" by {-check.margin:.3f} {check.unit}" if check.margin < 0 else ""
    return f"{check.name}{size} ({check.where})"
