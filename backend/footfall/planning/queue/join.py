"""A step or a move of the chassis is put at the end of a queue, where it begins exactly there."""

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.frames import pose_difference
from footfall.core.value import Provenance
from footfall.planning.answers import Check, Status, least_of
from footfall.planning.body.find_problem import ShiftResult
from footfall.planning.body.move import BodyMovePlan, BodyMoveResult
from footfall.planning.motion import Motion
from footfall.planning.queue.problem import PlanQueue, QueuedPlan, QueueResult
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Answer = PlanResult | BodyMoveResult | ShiftResult
"""What can be queued."""
FROM_ITS_END = "plan it from the queue's end"


def queued(robot: Robot, dem: Dem, state: RobotState, answer: Answer, before: PlanQueue | None = None) -> QueueResult:
    """Put a plan at the end of a queue.

    Nothing is planned anew: the plan has to begin in the posture and pose that the queue ends in, to the last bit, as
    it does where it was planned from there.

    Args:
        robot: the rover.
        dem: the ground, in site, that the plan and the queue were planned on.
        state: that the queue starts from; without ``before``, that the plan starts from.
        answer: with the plan.
        before: the queue so far; None: the plan begins one.

    Returns:
        The answer; START_INVALID where the plan does not begin where the queue ends, and by how much.

    Raises:
        InvalidInput: the answer has no plan.
    """
    plan = answer.plan
    if plan is None:
        raise InvalidInput(f"there is no plan to queue: {answer.reason}", status=answer.status.value)
    parents = {"robot": robot.digest, "dem": dem.digest, "state": state.digest, "plan": answer.digest}
    provenance = Provenance(parents if before is None else parents | {"queue": before.digest})
    against = _against(robot, dem, plan, before)
    if against:
        return QueueResult(Status.START_INVALID, None, against, (), provenance)
    step, move = (plan, None) if isinstance(plan, StepPlan) else (None, plan)
    entries = (() if before is None else before.entries) + (QueuedPlan(answer.digest, step, move, answer.checks),)
    checks = _least(entries)
    count = "1 entry" if len(entries) == 1 else f"{len(entries)} entries"
    return QueueResult(Status.FOUND, PlanQueue(entries, provenance), f"the queue has {count}", checks, provenance)


def _against(robot: Robot, dem: Dem, plan: StepPlan | BodyMovePlan, before: PlanQueue | None) -> str:
    """Why a plan can't follow a queue; "" where it can."""
    called = f"the step of leg {plan.leg}" if isinstance(plan, StepPlan) else "the move of the chassis"
    for name, now, what in (("robot", robot.digest, "for another robot"), ("dem", dem.digest, "on other ground")):
        if plan.parents.get(name, now) != now:
            return f"{called} was planned {what} than the queue: plan it again, or empty the queue"
    if before is None:
        return ""
    ends, begins = before.motion, plan.motion
    off = _apart(robot, ends, begins)
    if not off:
        return ""
    return f"{called} does not begin where entry {len(before.entries)} of the queue ends: {off}; {FROM_ITS_END}"


def _apart(robot: Robot, ends: Motion, begins: Motion) -> str:
    """How far the beginning of one motion is from the end of another, in words; "" where they are the same."""
    turned = begins.waypoints[0] - ends.waypoints[-1]
    joint = int(np.argmax(np.abs(turned)))
    moved = pose_difference(begins.Ts_site_base[0], ends.Ts_site_base[-1])
    found = []
    if moved:
        found.append(f"the chassis is {moved:.2g} m or rad from there")
    if turned[joint]:
        found.append(f"{robot.joint_names[joint]} is {turned[joint]:+.2g} rad from there")
    return ", ".join(found)


def _least(entries: tuple[QueuedPlan, ...]) -> tuple[Check, ...]:
    """Of each check the one with the least margin, and of which entry that is."""
    return least_of(
        Check(one.name, one.holds, one.margin, one.unit, f"entry {number}: {one.where}")
        for number, entry in enumerate(entries, 1)
        for one in entry.checks
    )
