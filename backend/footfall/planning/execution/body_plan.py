"""A planned move of the chassis becomes set points whose predicted motion is the planned one; everything is checked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.planning.answers import No, Status
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.compliance.compliant_rover import RestingRover
from footfall.planning.execution.begin import Beginning, asked_of, beginning, moved
from footfall.planning.execution.body_course import ENDS, NEAREST, BodyCourse
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.forces import borne
from footfall.planning.execution.pace import durations, pauses
from footfall.planning.execution.prediction_checks import body_checks_of, judged
from footfall.planning.execution.problem import BodyExecution, BodyExecutionResult
from footfall.planning.execution.walker import Lost
from footfall.planning.motion import BODY
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def plan_body_execution(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    plan: BodyMovePlan,
    settings: ExecutionSettings | None = None,
    commanded: ArrayLike | None = None,
    progress: Progress = no_progress,
) -> BodyExecutionResult:
    """Plan what to command so that the chassis of the yielding rover goes the way of ``plan``; its wheels stay.

    Of the settings mode, lift and lowering count for nothing. Where the move fails a check with the forces that change
    least, it is tried with others, see :data:`.body_course.ENDS`.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: as measured now, where the plan starts.
        plan: the move, as ``plan_body_move`` has it.
        settings: how it is commanded and how the rover sags; None: as delivered.
        commanded: the present set points, (legs × 6,) [rad]; None: posture + torque / stiffness.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; a move that can't be executed is an answer with a reason.

    Raises:
        InvalidInput: plan, state or settings are of another robot or make no sense.
        Cancelled: ``progress`` raised it.
    """
    settings, provenance = asked_of(robot, dem, state, plan, settings)

    def no(status: Status, reason: str) -> BodyExecutionResult:
        return BodyExecutionResult(status, None, reason, (), provenance)

    progress(0.0, "looking at the ground")
    away = moved(state, plan.waypoints[0], plan.Ts_site_base[0])
    if away:
        return no(Status.START_INVALID, f"{away}; plan the move anew from where the rover is")
    began = beginning(robot, dem, state, settings, commanded)
    if isinstance(began, No):
        return no(began.status, began.reason)
    first = body_executed(began, plan, settings, provenance, progress).result
    if first.status is Status.FOUND:
        return first
    others = (body_executed(began, plan, settings, provenance, progress, end).result for end in ENDS[1:])
    return next((one for one in others if one.status is Status.FOUND), first)


@dataclass(frozen=True)
class BodyExecuted:
    """The answer, and how the rover rests after it; None where that was not predicted."""

    result: BodyExecutionResult
    end: RestingRover | None


def body_executed(
    began: Beginning,
    plan: BodyMovePlan,
    settings: ExecutionSettings,
    provenance: Provenance,
    progress: Progress = no_progress,
    end: str = NEAREST,
) -> BodyExecuted:
    """The move from the rest it begins with, measured or predicted, checked where the rover is predicted to be.

    end: which forces hold the rover then, one of :data:`.body_course.ENDS`.
    """
    rover = began.rover
    try:
        course = BodyCourse(rover, began.rest, plan, settings, part(progress, 0.0, 0.7), end)
    except Lost as lost:
        reason = f"{lost}; move the chassis less far, or step with that leg first"
        return BodyExecuted(BodyExecutionResult(Status.NO_PATH, None, reason, (), provenance), None)
    rests = course.rests
    commanded = np.array([one.commanded for one in rests])
    phases = (BODY,) * len(rests)
    forces, loads, use = borne(rover, rests, settings.least_load)
    done = BodyExecution(
        plan=plan,
        wanted=course.wanted,
        commanded=commanded,
        predicted=np.array([one.posture for one in rests]),
        Ts_site_base=np.array([one.T_site_base for one in rests]),
        durations=durations(rover.robot, commanded, phases, settings.speed_fraction),
        pauses=pauses(phases, settings.pause),
        forces=forces,
        loads=loads,
        friction_use=use,
        provenance=provenance,
    )
    progress(0.7, "checking where the rover will be")
    checks = body_checks_of(rover.robot, done, rests, began.body, settings)
    progress(1.0, "done")
    status, reason = judged(checks)
    return BodyExecuted(BodyExecutionResult(status, done, reason, checks, provenance), rests[-1])
