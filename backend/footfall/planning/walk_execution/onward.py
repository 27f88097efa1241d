"""The next foot move of a walk from where the rover really is: the walk is kept where it still fits, else made anew."""

from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from footfall.core.progress import Progress, no_progress, part
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkPlan, WalkSettings
from footfall.planning.walk_execution.pins_left import pins_left
from footfall.planning.walk_execution.plan import foot_moves_of, plan_walk_execution
from footfall.planning.walk_execution.problem import FootMoveExecution, WalkExecutionResult
from footfall.planning.walk_execution.unpressed import unpressed
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


@dataclass(frozen=True)
class Onward:
    """walk: the one that is followed from here on; number: of its foot move that comes next.

    move: that foot move, or None where there is none, as ``reason`` says; empty where the walk is at its end. anew: why
    the walk was planned anew; empty where it was kept.
    """

    walk: WalkPlan
    number: int
    move: FootMoveExecution | None
    reason: str
    anew: str = ""


def onward(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    walk: WalkPlan,
    number: int,
    settings: ExecutionSettings | None = None,
    commanded: ArrayLike | None = None,
    progress: Progress = no_progress,
) -> Onward:
    """The execution of one foot move of a walk, from the state that was just measured.

    Where it can't be executed from there, a walk to the same goal is planned from there, with the same settings but for
    pinned places that have had their foot, and its first foot move is taken.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: as measured now.
        walk: as ``plan_walk`` has it.
        number: of the foot move, from 0.
        settings: as of :func:`plan_walk_execution`.
        commanded: the present set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The execution, and the walk that it is of.

    Raises:
        InvalidInput: walk, state or settings are of another robot or make no sense, or the walk is on a tether.
        Cancelled: ``progress`` raised it.
    """
    ahead = next_that_moves(walk, number)
    if ahead is None:
        return Onward(walk, walk.foot_moves, None, "")
    kept = plan_walk_execution(robot, dem, state, walk, settings, commanded, ahead, 1, part(progress, 0.0, 0.3))
    if kept.status is Status.FOUND:
        return Onward(walk, ahead, _move(kept), "")
    made_with = walk.provenance.settings
    asked = made_with if isinstance(made_with, WalkSettings) else None
    if asked is not None:
        asked = replace(asked, pinned=pins_left(walk, asked.pinned, ahead))
    found = plan_walk(robot, dem, unpressed(robot, state), walk.goal, settings=asked, progress=part(progress, 0.3, 0.7))
    if found.plan is None:
        return Onward(walk, ahead, None, f"{kept.reason}; and no other walk is found: {found.reason}", kept.reason)
    first = next_that_moves(found.plan, 0)
    if first is None:
        return Onward(found.plan, 0, None, "", kept.reason)
    result = plan_walk_execution(robot, dem, state, found.plan, settings, commanded, first, 1, part(progress, 0.7, 1.0))
    return Onward(found.plan, first, _move(result), result.reason, kept.reason)


def next_that_moves(walk: WalkPlan, number: int) -> int | None:
    """The first foot move from ``number`` on that moves anything; None where there is none."""
    parts = foot_moves_of(walk)
    moving = [at for at in range(number, len(parts)) if parts[at]]
    return moving[0] if moving else None


def _move(result: WalkExecutionResult) -> FootMoveExecution | None:
    return result.execution.moves[0] if result.execution is not None else None
