"""A planned step becomes set points whose predicted motion is the planned one; everything is checked.

The method of the prediction is in :mod:`footfall.planning.compliance.compliant_rover`, that of each mode in
:mod:`footfall.planning.execution.course`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.planning.answers import Check, No, Status
from footfall.planning.compliance.compliance_settings import WIDEST, ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import predict
from footfall.planning.execution.begin import REACH_OUT, Beginning, asked_of, beginning, moved
from footfall.planning.execution.course import COMMANDERS, FALL, Course
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.forces import borne
from footfall.planning.execution.pace import GENTLE, durations, pauses
from footfall.planning.execution.prediction_checks import checks_of, judged
from footfall.planning.execution.problem import Execution, ExecutionResult
from footfall.planning.execution.rim import rim_clearance
from footfall.planning.execution.walker import Lost
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

MOST_LIFTS = 5
"""Heights of the lift that are tried."""
MORE = 0.02
"""Lifted more than what was lacking, as a higher lift sags more [m]."""


def plan_execution(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    plan: StepPlan,
    settings: ExecutionSettings | None = None,
    commanded: ArrayLike | None = None,
    progress: Progress = no_progress,
) -> ExecutionResult:
    """Plan what to command so that the yielding rover makes the step ``plan``, checked where it is predicted to be.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: as measured now, where the plan starts.
        plan: the step, as ``plan_step`` has it.
        settings: how it is commanded and how the rover sags; None: as delivered.
        commanded: the present set points, (legs × 6,) [rad]; None: from the measured torques, posture + torque /
            stiffness.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; a step that can't be executed is an answer with a reason.

    Raises:
        InvalidInput: plan, state or settings are of another robot or make no sense.
        Cancelled: ``progress`` raised it.
    """
    settings, provenance = asked_of(robot, dem, state, plan, settings)

    def no(status: Status, reason: str) -> ExecutionResult:
        return ExecutionResult(status, None, reason, (), provenance)

    progress(0.0, "looking at the ground")
    away = moved(state, plan.waypoints[0], plan.T_site_base)
    if away:
        return no(Status.START_INVALID, f"{away}; plan the step anew from where the rover is")
    began = beginning(robot, dem, state, settings, commanded, REACH_OUT)
    if isinstance(began, No):
        return no(began.status, began.reason)
    return executed(began, dem, state, plan, settings, provenance, progress).result


@dataclass(frozen=True)
class Executed:
    """The answer, and how the rover rests after it; None where that was not predicted."""

    result: ExecutionResult
    end: RestingRover | None


def executed(
    began: Beginning,
    dem: Dem,
    state: RobotState,
    plan: StepPlan,
    settings: ExecutionSettings,
    provenance: Provenance,
    progress: Progress = no_progress,
) -> Executed:
    """The step from the rest it begins with, measured or predicted, checked where the rover is predicted to be.

    state: what telemetry says, or would say, of that rest; dem: the map, where ``as_commanded`` plans a higher lift.
    """
    attempt = _Attempt(began, state, settings, provenance)
    try:
        if settings.mode == "as_commanded":
            done, checks = attempt.lifted_enough(dem, plan, progress)
        else:
            done, checks = attempt.run(plan, progress)
    except Lost as lost:
        reason = f"{lost}; move the chassis, choose another footfall, or take another mode"
        return Executed(ExecutionResult(Status.NO_PATH, None, reason, (), provenance), None)
    progress(1.0, "done")
    status, reason = judged(checks)
    return Executed(ExecutionResult(status, done, reason, checks, provenance), attempt.end)


class _Attempt:
    def __init__(
        self, began: Beginning, state: RobotState, settings: ExecutionSettings, provenance: Provenance
    ) -> None:
        self.rover, self.robot, self.body = began.rover, began.rover.robot, began.body
        self.state, self.start = state, began.rest
        self.settings, self.provenance = settings, provenance
        self.end: RestingRover | None = None

    def lifted_enough(self, dem: Dem, plan: StepPlan, progress: Progress) -> tuple[Execution, tuple[Check, ...]]:
        """The execution with the lift raised until the wheel clears the ground, or the last that could be planned."""
        made_with = plan.provenance.settings
        asked = made_with if isinstance(made_with, StepSettings) else StepSettings()
        lift, found = asked.lift, None
        for i in range(MOST_LIFTS):
            now = part(progress, i / MOST_LIFTS, (i + 1) / MOST_LIFTS)
            found = self.run(plan, now)
            done = found[0]
            lacking = self.settings.least_clearance - float(done.clearance[done.aloft].min())
            if lacking <= 0 or lift >= self.settings.most_lift:
                break
            # what is lifted more is partly lost to sag: by the share of the lift that arrived
            lift = min(lift + max(lacking, 0.0) + MORE, self.settings.most_lift)
            higher = plan_step(
                self.robot,
                dem,
                self.state,
                plan.leg,
                (plan.contact[0], plan.contact[1]),
                settings=replace(asked, lift=lift),
            )
            if higher.plan is None:
                break
            plan = higher.plan
        if found is None:
            raise Lost("no lift was tried")
        return found

    def run(self, plan: StepPlan, progress: Progress) -> tuple[Execution, tuple[Check, ...]]:
        """One execution of one plan with its checks. Raises Lost."""
        commander = COMMANDERS[self.settings.mode](
            self.rover, self.start, plan, self.settings, part(progress, 0.0, 0.6)
        )
        course = commander.course()
        progress(0.6, "how sure the clearance is")
        done = self._execution(plan, course)
        progress(0.7, "checking where the rover will be")
        self.end = course.rests[-1]
        return done, checks_of(self.robot, done, course.rests, self.body, self.settings)

    def _execution(self, plan: StepPlan, course: Course) -> Execution:
        rests, leg, settings = course.rests, plan.leg, self.settings
        forces, loads, use = borne(self.rover, rests, settings.least_load)
        clearance = rim_clearance(
            self.body.ground.dem, np.array([one.hubs[leg] for one in rests]), self.robot.wheel_radius
        )
        touched = [i for i in range(course.guarded_from, len(rests)) if rests[i].touching[leg]]
        touch_down = rests[touched[0]].contacts[leg] if touched else np.full(3, np.nan)
        guarded = slice(
            course.guarded_from + 1, course.stopped_at + 1 if course.stopped_at >= 0 else len(course.phases)
        )
        return Execution(
            leg=leg,
            mode=settings.mode,
            plan=plan,
            commanded=course.commanded,
            predicted=np.array([one.posture for one in rests]),
            Ts_site_base=np.array([one.T_site_base for one in rests]),
            phases=course.phases,
            durations=durations(
                self.robot, course.commanded, course.phases, settings.speed_fraction, guarded, FALL / GENTLE
            ),
            pauses=pauses(course.phases, settings.pause),
            forces=forces,
            loads=loads,
            friction_use=use,
            clearance=clearance,
            clearance_uncertainty=clearance - self._softer(course, leg),
            guarded_from=course.guarded_from,
            stopped_at=course.stopped_at,
            lowest=course.lowest,
            stop_force=course.stop_force,
            touch_down=touch_down,
            touch_down_offset=float(np.linalg.norm((touch_down - plan.contact)[:2])),
            provenance=self.provenance,
        )

    def _softer(self, course: Course, leg: int) -> Array:
        """Clearance (n,) [m] with all springs softer by the tolerance, started from the same telemetry; NaN beyond."""
        own = self.settings.compliance
        soft = CompliantRover(self.robot, self.rover.dem, softer(own, self.settings.tolerance), self.rover.unseen)
        motion = predict(soft, measured(soft, self.state, self.start.commanded, fitted=False), course.commanded)
        out = np.full(len(course.rests), np.nan)
        hubs = np.array([one.hubs[leg] for one in motion.rests])
        out[: len(hubs)] = rim_clearance(self.body.ground.dem, hubs.reshape(-1, 3), self.robot.wheel_radius)
        return out


def softer(settings: ComplianceSettings, share: float) -> ComplianceSettings:
    """The settings with all springs softer by a share 0…1."""
    joint, wheel = (max(scale * (1 - share), 1 / WIDEST) for scale in (settings.joint_scale, settings.wheel_scale))
    return replace(settings, joint_scale=joint, wheel_scale=wheel)
