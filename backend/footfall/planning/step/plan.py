"""Plan one step: lift, swing, lower; check everything; say no with a reason.

The method is that of "Motion planning for a six-legged lunar robot" (Hauser, Bretl, Latombe & Wilcox, 2006)
and of FootFall: the chassis and the other legs stay, the wheel goes straight up to a waypoint above its start, swings
in joint space over ground that is raised by a safety height, and comes straight down onto its goal.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.maps.standing import contacts
from footfall.planning.step.edges import Array, Space
from footfall.planning.step.ground import Contact, Refused, footfall_contact, nearby
from footfall.planning.step.lift import branch_of, vertical
from footfall.planning.step.planners import REGISTRY, Swing, chain
from footfall.planning.step.problem import Check, Footfall, PlanResult, Status, StepPlan, StepSettings
from footfall.planning.step.situation import RAISED, TRUE, Situation
from footfall.planning.step.smooth import smooth
from footfall.planning.step.start import start_objection
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
        objection = start_objection(self.robot, self.dem, self.state, self.leg)
        if objection:
            advice = "correct the state or the terrain, or put the legs down first"
            return _No(Status.START_INVALID, f"the rover can't stand as its state says: {objection}; {advice}")
        hip = (np.asarray(self.state.T_site_base) @ self.robot.description.legs[self.leg].T_base_hip)[:3, 3]
        foot = contacts(self.robot, self.dem, self.state.posture, self.state.T_site_base, [self.leg]).points
        ground = nearby(self.dem, hip[:2], self._reach() + 0.5, foot)
        if isinstance(ground, Refused):
            return _No(ground.status, ground.reason)
        self.watch.phase(0.05, "building the collision scene")
        situation = Situation(self.robot, self.dem, self.state, self.leg, ground, self.settings)
        up = self._lift(situation)
        if isinstance(up, _No):
            return up
        branch = branch_of(self.robot, self.leg, up[0])
        self.watch.phase(0.2, "choosing how the leg stands at the goal")
        goals = self._goals(situation, contact, hip, up[0], branch)
        if isinstance(goals, _No):
            return goals
        return self._search(situation, contact, up, goals)

    def _reach(self) -> float:
        spec = self.robot.description.legs[self.leg]
        return float(np.linalg.norm(spec.hip_offset) + spec.thigh + spec.shank + spec.foot + self.robot.wheel_radius)

    def _space(self, situation: Situation, terrain: str) -> Space:
        return Space(
            situation.lower,
            situation.upper,
            lambda q: situation.free(q, terrain),
            self.settings.epsilon,
            self.watch.tick,
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
        blocked = self._blocked(situation, up)
        if blocked:
            reason = f"the wheel can't be lifted {lift:.2f} m straight up: {blocked}; {LIFT_ADVICE}"
            return _No(Status.NO_PATH, reason)
        return up

    def _blocked(self, situation: Situation, up: Array) -> str:
        """What forbids a vertical move, or its upper end as the start of a swing; empty where nothing does."""
        space = self._space(situation, TRUE)
        height = self.settings.lift / (len(up) - 1)
        for i, q in enumerate(up):
            if not space.is_free(q):
                return f"{i * height:.2f} m above the ground {situation.objection(q, TRUE)}"
        for i, (a, b) in enumerate(itertools.pairwise(up)):
            t = None if space.edge_is_free(a, b) else space.first_blocked(a, b)
            if t is not None:
                return f"{(i + t) * height:.2f} m above the ground {situation.objection(a + t * (b - a), TRUE)}"
        if not self._space(situation, RAISED).is_free(up[-1]):
            return f"{self.settings.lift:.2f} m above the ground {situation.objection(up[-1], RAISED)}"
        return ""

    def _goals(
        self, situation: Situation, contact: Contact, hip: Array, q_start: Array, branch: int
    ) -> list[_Goal] | _No:
        """Up to MOST_GOALS postures on the contact, each with its free way up."""
        possible = candidates(self.robot, self.leg, contact, situation.T_site_base, q_start, branch)
        x, y, _ = contact.point
        if not possible:
            away, reach = float(np.linalg.norm(contact.point - hip)), self._reach()
            too_far = f", farther than the {reach:.2f} m it can reach" if away > reach else ""
            reason = (
                f"leg {self.leg} can't stand at ({x:.2f}, {y:.2f}): it is {away:.2f} m from its hip{too_far}; no joint "
                "angles inside the limits put the wheel upright there; choose a footfall that the reach map shows green"
            )
            return _No(Status.GOAL_INVALID, reason)
        goals: list[_Goal] = []
        first_objection = ""
        for candidate in possible:
            self.watch.tick()
            objection = situation.objection(candidate.q, TRUE)
            up: Array | str = objection
            if not objection:
                up = vertical(self.robot, self.leg, situation.T_site_base, candidate.q, self.settings.lift)
                objection = f"the wheel can't be lowered: {up}" if isinstance(up, str) else self._blocked(situation, up)
            if objection:
                first_objection = first_objection or objection
            elif not isinstance(up, str):
                goals.append(_Goal(candidate, up))
                if len(goals) == MOST_GOALS:
                    break
        if not goals:
            reason = (
                f"leg {self.leg} can't stand at ({x:.2f}, {y:.2f}): none of {len(possible)} postures that reach it is "
                f"allowed; in the nearest, {first_objection}; {ADVICE}"
            )
            return _No(Status.GOAL_INVALID, reason)
        return goals

    def _search(self, situation: Situation, contact: Contact, up: Array, goals: list[_Goal]) -> _Yes | _No:
        space = self._space(situation, RAISED)
        reasons: list[str] = []
        failed: tuple[Check, ...] = ()
        names = chain(self.settings.planner)
        for i, name in enumerate(names):
            for goal in goals:
                self.watch.phase(0.25 + 0.5 * i / len(names), f"planning the swing with {name}")
                swing = Swing(situation, space, up[-1], goal.up[-1])
                answer = REGISTRY[name](swing)
                if answer.path is None:
                    if answer.why not in reasons:
                        reasons.append(answer.why)
                    continue
                self.watch.phase(0.75, "shortening the path")
                waypoints, phases = self._joined(up, smooth(space, answer.path), goal.up[::-1])
                self.watch.phase(0.85, "checking the whole path")
                checks = recheck(situation, self.dem, waypoints, phases, self.watch.pulse)
                bad = [check for check in checks if not check.holds]
                if not bad:
                    return _Yes(waypoints, phases, checks, contact, goal.candidate.branch, name)
                failed = failed or checks
                reasons.append(f"a path of {name} fails the check of {_told(bad[0])}")
        return _No(Status.NO_PATH, f"no way to the footfall was found: {'; '.join(reasons)}; {ADVICE}", failed)

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
