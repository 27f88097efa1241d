"""A planned walk becomes executions: foot move by foot move, each from where the one before is predicted to rest."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.planning.answers import Check, No, Status, least_of
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.compliance.compliant_rover import RestingRover
from footfall.planning.execution.begin import REACH_OUT, Beginning, beginning, require_fit
from footfall.planning.execution.body_course import ENDS, NEAREST
from footfall.planning.execution.body_plan import BodyExecuted, body_executed
from footfall.planning.execution.execution_settings import HELD, ExecutionSettings
from footfall.planning.execution.plan import Executed, executed
from footfall.planning.execution.problem import BodyExecution, Execution
from footfall.planning.step.problem import StepPlan
from footfall.planning.walk.parts import parts_of, stay
from footfall.planning.walk.problem import WalkPlan, part_name
from footfall.planning.walk_execution.off_walk import off_walk
from footfall.planning.walk_execution.payload import with_load_of
from footfall.planning.walk_execution.problem import FootMoveExecution, WalkExecution, WalkExecutionResult
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Part = BodyMovePlan | StepPlan


def plan_walk_execution(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    walk: WalkPlan,
    settings: ExecutionSettings | None = None,
    commanded: ArrayLike | None = None,
    first: int = 0,
    count: int | None = None,
    progress: Progress = no_progress,
) -> WalkExecutionResult:
    """Plan what to command so that the yielding rover makes foot moves of a walk.

    The chassis is held on its planned way; feet go where they were planned, from where they are predicted to stand.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: as measured now, where foot move ``first`` starts.
        walk: as ``plan_walk`` has it.
        settings: their mode, one of HELD, is that of the steps; where they name no payload, that of the walk's settings
            counts. None: as delivered.
        commanded: the present set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        first: number of the first foot move, from 0.
        count: how many; None: all that are left and the chassis' way after the last one.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; where a foot move can't be executed, that says which and why, and holds those before it.

    Raises:
        InvalidInput: walk, state or settings are of another robot or make no sense, or the walk is on a tether.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or ExecutionSettings()
    if not isinstance(settings, ExecutionSettings) or settings.mode not in HELD:
        raise InvalidInput(f"a walk is executed with ExecutionSettings of a mode of {', '.join(HELD)}")
    settings = with_load_of(walk, settings)
    if walk.tethered is not None:
        raise InvalidInput("a walk on a tether is not executed yet: how the rover sags on one is not predicted")
    asked = _asked(walk, first, count)
    require_fit(robot, state, walk.parents)
    parents = {"walk": walk.digest, "state": state.digest, "dem": dem.digest, "robot": robot.digest}
    provenance = Provenance(parents, settings)
    way = HeldWay(robot, dem, state, commanded, settings, provenance, lambda number: stay(walk, number))
    return way.foot_moves(asked, lambda number: part_name(number, walk.foot_moves), progress)


def foot_moves_of(walk: WalkPlan) -> tuple[tuple[Part, ...], ...]:
    """The parts of each foot move, and of the chassis' way after the last, m + 1 of them; empty where nothing moves."""
    moves: list[tuple[Part, ...]] = []
    now: tuple[Part, ...] = ()
    for one in parts_of(walk):
        now = (*now, one)
        if isinstance(one, StepPlan):
            moves.append(now)
            now = ()
    return (*moves, now)


class HeldWay:
    """A rover that gives way on its way, at rest between the parts of a walk or a queue."""

    def __init__(
        self,
        robot: Robot,
        dem: Dem,
        state: RobotState,
        commanded: ArrayLike | None,
        settings: ExecutionSettings,
        provenance: Provenance,
        stay: Callable[[int], BodyMovePlan],
    ) -> None:
        """stay: before foot move ``number``, a move of the chassis to where it is, so that only forces shift."""
        self._stay = stay
        self.robot, self.dem, self.settings, self.provenance = robot, dem, settings, provenance
        self.state, self._commanded = state, commanded
        self.rest: RestingRover | None = None
        self.checks: list[Check] = []

    def foot_moves(
        self, asked: Sequence[tuple[int, tuple[Part, ...]]], name: Callable[[int], str], progress: Progress
    ) -> WalkExecutionResult:
        """The executions of some foot moves, by number and parts; up to the first that fails.

        Args:
            asked: number and parts of each.
            name: of a foot move, by its number, for a person.
            progress: called with a fraction 0…1 and a text; may raise Cancelled.

        Returns:
            The answer.

        Raises:
            Cancelled: ``progress`` raised it.
        """
        done: list[FootMoveExecution] = []
        for i, (number, parts) in enumerate(asked):
            called, now = name(number), part(progress, i / len(asked), (i + 1) / len(asked))
            found = self.foot_move(number, called, parts, _saying(called, now))
            if isinstance(found, No):
                return self._result(found.status, done, number, found.reason, found.checks)
            done.append(found)
        progress(1.0, "done")
        return self._result(Status.FOUND, done, None, "", least_of(self.checks))

    def foot_move(self, number: int, called: str, parts: Iterable[Part], progress: Progress) -> FootMoveExecution | No:
        """The executions of a foot move, all of whose checks hold, or why there are none.

        Where one fails, and other forces may hold the rover where its chassis has moved, or stays, those are tried.
        """
        parts = tuple(parts)
        before = self.state, self.rest, tuple(self.checks)
        first = self._with_forces(number, called, parts, NEAREST, progress)
        if not isinstance(first, No) or first.status is not Status.NO_PATH:
            return first
        begun = parts if isinstance(parts[0], BodyMovePlan) else (self._stay(number), *parts)
        for end in ENDS[1:]:
            self.state, self.rest, self.checks = before[0], before[1], list(before[2])
            found = self._with_forces(number, called, begun, end, progress)
            if not isinstance(found, No):
                return found
        return first

    def _with_forces(
        self, number: int, called: str, parts: tuple[Part, ...], end: str, progress: Progress
    ) -> FootMoveExecution | No:
        """As :meth:`foot_move`. end: one of ENDS, which forces hold the rover where its chassis has moved to."""
        body: BodyExecution | None = None
        step: Execution | None = None
        for i, one in enumerate(parts):
            found = self._part(called, one, end, part(progress, i / len(parts), (i + 1) / len(parts)))
            if isinstance(found, No):
                return replace(found, reason=f"{called}: {found.reason}")
            if isinstance(found, Execution):
                step = found
            else:
                body = found
        return FootMoveExecution(number, body, step)

    def _result(
        self,
        status: Status,
        done: list[FootMoveExecution],
        failed_at: int | None,
        reason: str,
        checks: tuple[Check, ...],
    ) -> WalkExecutionResult:
        execution = WalkExecution(tuple(done), self.provenance) if done else None
        return WalkExecutionResult(status, execution, reason, checks, self.provenance, failed_at)

    def _part(self, called: str, plan: Part, end: str, progress: Progress) -> BodyExecution | Execution | No:
        progress(0.0, "looking at the ground")
        motion = plan.motion
        away = off_walk(self.robot, self.state, motion.waypoints[0], motion.Ts_site_base[0])
        if away:
            return No(Status.START_INVALID, f"{away}; plan anew from there")
        # the rest that the part before ended in; of the first part the measured one
        began = beginning(self.robot, self.dem, self.state, self.settings, self._commanded, REACH_OUT, self.rest)
        if isinstance(began, No):
            return began
        found = self._executed(began, plan, end, progress)
        result = found.result
        checks = tuple(replace(check, where=f"{called}: {check.where}") for check in result.checks)
        if result.status is not Status.FOUND or result.execution is None or found.end is None:
            return No(result.status, result.reason, checks)
        self.checks += checks
        self.rest, self.state = found.end, began.rover.state(found.end, self.state.time)
        return result.execution

    def _executed(self, began: Beginning, plan: Part, end: str, progress: Progress) -> BodyExecuted | Executed:
        provenance = replace(self.provenance, parents=dict(self.provenance.parents) | {"plan": plan.digest})
        if isinstance(plan, BodyMovePlan):
            return body_executed(began, plan, self.settings, provenance, progress, end)
        return executed(began, self.dem, self.state, plan, self.settings, provenance, progress)


def _asked(walk: WalkPlan, first: int, count: int | None) -> list[tuple[int, tuple[Part, ...]]]:
    """Number and parts of the foot moves that are asked for and move something."""
    last = walk.foot_moves if count is None else first + count - 1
    if not 0 <= first <= last <= walk.foot_moves:
        raise InvalidInput(
            f"a walk of {walk.foot_moves} foot moves is executed from one of 0 to {walk.foot_moves} on, one or more",
            first=first,
            count=count,
        )
    moves: Iterator[tuple[int, tuple[Part, ...]]] = enumerate(foot_moves_of(walk))
    asked = [(number, parts) for number, parts in moves if first <= number <= last and parts]
    if not asked:
        raise InvalidInput("the walk goes nowhere there: there is nothing to execute", first=first, count=count)
    return asked


def _saying(called: str, progress: Progress) -> Progress:
    return lambda share, text: progress(share, f"{called}: {text}")
