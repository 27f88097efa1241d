"""A queue of steps and moves of the chassis becomes executions, each from where the one before is predicted to rest."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.maps.standing import contacts, standing
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.execution.begin import require_fit
from footfall.planning.execution.execution_settings import HELD, ExecutionSettings
from footfall.planning.queue.problem import PlanQueue, entries_in_words
from footfall.planning.walk_execution.plan import HeldWay, Part
from footfall.planning.walk_execution.problem import WalkExecutionResult
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def plan_queue_execution(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    queue: PlanQueue,
    settings: ExecutionSettings | None = None,
    commanded: ArrayLike | None = None,
    progress: Progress = no_progress,
) -> WalkExecutionResult:
    """Plan what to command so that the yielding rover makes all of a queue.

    Each step and move is executed from where the one before it is predicted to rest; one that fails a check ends it.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: as measured, where the queue starts.
        queue: as ``queued`` has it.
        settings: their mode, one of HELD, is that of the steps. None: as delivered.
        commanded: the present set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; where an entry can't be executed, that says which and why, and holds those before it.

    Raises:
        InvalidInput: queue, state or settings are of another robot or make no sense.
        Cancelled: ``progress`` raised it.
    """
    settings = settings or ExecutionSettings()
    if settings.mode not in HELD:
        raise InvalidInput(f"a queue is executed in a mode of {', '.join(HELD)}", mode=settings.mode)
    require_fit(robot, state, queue.parents)
    groups = _groups(queue)
    parents = {"queue": queue.digest, "state": state.digest, "dem": dem.digest, "robot": robot.digest}

    def stay(number: int) -> BodyMovePlan:
        return _stay(robot, dem, queue, groups[number][0])

    way = HeldWay(robot, dem, state, commanded, settings, Provenance(parents, settings), stay)
    asked = [(i, tuple(queue.entries[at].plan for at in group)) for i, group in enumerate(groups)]
    return way.foot_moves(asked, lambda number: entries_in_words(groups[number]), progress)


def _groups(queue: PlanQueue) -> list[tuple[int, ...]]:
    """Entries that are executed together: a step with the move of the chassis just before it; others alone."""
    found: list[tuple[int, ...]] = []
    for own in queue.foot_moves():
        alone = own[:-2] if queue.entries[own[-1]].step is not None else own
        found += [(number,) for number in alone]
        if len(alone) < len(own):
            found.append(own[len(alone) :])
    return found


def _stay(robot: Robot, dem: Dem, queue: PlanQueue, number: int) -> BodyMovePlan:
    """A move of the chassis from where an entry begins to there: forces shift, nothing else."""
    begins: Part = queue.entries[number].plan
    posture, T_site_base = begins.motion.waypoints[0], begins.motion.Ts_site_base[0]
    down = tuple(standing(robot, dem, posture, T_site_base, robot.legs))
    return BodyMovePlan(
        shift=BodyShift(),
        waypoints=np.array([posture, posture]),
        Ts_site_base=np.array([T_site_base, T_site_base]),
        standing=down,
        contacts=contacts(robot, dem, posture, T_site_base, down).points,
        provenance=Provenance({"queue": queue.digest, "robot": robot.digest, "dem": dem.digest}),
    )
