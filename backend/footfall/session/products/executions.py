"""Executions of a session: what is commanded so that the rover, which sags, makes the planned step."""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.problem import BodyExecutionResult, ExecutionResult
from footfall.planning.queue.problem import PlanQueue
from footfall.planning.walk_execution.problem import WalkExecutionResult
from footfall.sequence.commands import Sequence
from footfall.session.answers.plans import WayMode, WayOfCommands
from footfall.session.core import SessionCore, present
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import ExecutionRequest, FootMovesRequest
from footfall.session.log.fold_commands import CommandRecord
from footfall.session.log.records import ProductRecord
from footfall.session.products.kinds import (
    BODY_MOVE,
    EXECUTION,
    GROUND,
    HELD_MOVE,
    HELD_QUEUE,
    KINDS,
    PLAN,
    QUEUE,
    Kind,
)
from footfall.session.products.plans import StepPlans
from footfall.session.products.sag import Calibration, MeasuredSag, Sag, calibration_of, sag_of
from footfall.session.products.terrains import SHORT_JOB
from footfall.session.products.up_to_date import SENT, difference
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.state import RobotState, TelemetryFrame

if TYPE_CHECKING:
    from footfall.sequence.make import RigidPlan

MOST_RUNS = 20
"""Runs before the latest that are asked how far the rover gave way."""

HELD = "the standing legs are commanded too, so that the chassis keeps its pose although the rover sags"
HOLDS = "telemetry shows that the rover's joints do not give way"
SAG_UNKNOWN = (
    "neither telemetry nor the state that is planned from tells what the joints bear, so how the rover sags is not "
    "known: they are commanded as planned; touch-down is not predicted"
)

_NAMED = {
    EXECUTION.name: ("step", "its touch-down"),
    HELD_QUEUE.name: ("queue", "where feet touch down"),
}
"""Kind of an execution → what it is of, and what is not predicted without it."""

SAG_NOT_SAID = (
    "the robot's description does not say how its joints give way: they are commanded as planned; touch-down is not "
    "predicted"
)


@dataclass(frozen=True)
class CommandWay:
    """mode: "pose_held", or "rigid" where sag is not known; reason: why, for a person."""

    mode: WayMode
    reason: str


class Executions:
    """Plans as set points, for a rover that sags; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore, rover: LinkedRover, plans: StepPlans) -> None:
        self._core, self._rover, self._plans = core, rover, plans

    def way_of_commands(self) -> CommandWay:
        """How a planned step is commanded unless an order says otherwise: with the pose held where sag is known."""
        described = self._core.described
        if described is not None:
            return CommandWay("pose_held", HELD) if described.sags else CommandWay("rigid", SAG_NOT_SAID)
        if self._rover.seen_to_give_way is not None:
            return CommandWay("pose_held", HELD) if self._rover.seen_to_give_way else CommandWay("rigid", HOLDS)
        state = None if self._core.state.state is None else self._core.typed(RobotState, self._core.state.state)
        if state is None or not (state.joint_torques.any() or state.wheel_forces.any()):
            return CommandWay("rigid", SAG_UNKNOWN)
        return CommandWay("pose_held", HELD)

    def way_of(self, sequence: str) -> WayOfCommands:
        """How the commands of a sequence take the rover, as plain JSON; doubt: it sags otherwise than they know."""
        if self._core.typed(Sequence, sequence).at_rest is not None:
            asked = self.executed_with(sequence)
            if asked is None and self._core.described is not None:
                return {"mode": "pose_held", "text": f"pose held: {HELD}", "doubt": False}
            if asked is None:
                return {"mode": "for_sag", "text": "commanded for sag, as the file says", "doubt": False}
            title, text = MODES[asked.mode]
            return {"mode": asked.mode, "text": f"{title}: {text}", "doubt": False}
        if self._rover.seen_to_give_way is False:
            return {"mode": "rigid", "text": f"as commanded: {HOLDS}", "doubt": False}
        sags = "the rover sags" if self.way_of_commands().mode == "pose_held" else "whether the rover sags is not known"
        return {"mode": "rigid", "text": f"as commanded: {sags}; touch-down is not predicted", "doubt": True}

    def executed_with(self, sequence: str) -> ExecutionSettings | None:
        """Settings of the execution that a sequence goes back to; None where it goes back to none."""
        own, behind = (
            self._core.state.products.get(self._core.state.before_edits(sequence)),
            self._core.state.plan_behind(sequence),
        )
        for made in (own, behind):
            asked = None if made is None or made.settings is None else self._core.get(made.settings)
            if isinstance(asked, (ExecutionRequest, FootMovesRequest)):
                return asked.settings
        return None

    def executed(self, plan: str, settings: ExecutionSettings | None = None) -> str:
        """The execution of a planned step, move of the chassis or queue, made unless the present one was
        asked for with the same; its digest.

        Raises InvalidInput where it can't be commanded so.
        """
        made = self._core.state.products[plan]
        kind, request = KINDS[KINDS[made.kind].executed_by], self._request(made, plan, settings)
        there = self._core.state.newest(kind)
        known = None if there is None else self._core.state.products[there]
        if there is None or known is None or known.parents["plan"] != plan or known.settings != request.digest:
            job = self._core.product_jobs.submit(kind, _with_plan(made, plan), request, urgent=True)
            there = job.finish(SHORT_JOB * self._entries(plan))
        found = self._core.get(there)
        answers = ExecutionResult, BodyExecutionResult, WalkExecutionResult
        if isinstance(found, answers) and found.status is not Status.FOUND:
            mode = MODES[request.settings.mode][0]
            what, blind = _NAMED.get(kind.name, ("move", "where the chassis ends"))
            other = "or take another mode, " if kind is EXECUTION else ""
            raise InvalidInput(
                f"the {what} can't be commanded {mode}: {found.reason}; {other}or ask for it as commanded: the rover "
                f"then sags, and {blind} is not predicted",
                status=found.status.value,
                mode=request.settings.mode,
            )
        return there

    def _entries(self, plan: str) -> int:
        """How many plans are executed with one: as many as a queue has."""
        found = getattr(self._core.get(plan), "plan", None)
        return len(found.entries) if isinstance(found, PlanQueue) else 1

    def plan(self, plan: str | None = None, settings: ExecutionSettings | None = None) -> Job:
        """What to command for a planned step (None: the present one), from the state that it was planned from.

        settings: as :meth:`settings_for` has them. Set points are the rover's present ones where it still stands so,
        else those that its torques tell. Raises Conflict where there is no plan, NotFound.
        """
        digest, made = self._plans.made(plan)
        self._plans.found(digest)
        return self._core.product_jobs.submit(
            EXECUTION, {**made.parents, "plan": digest}, self._request(made, digest, settings)
        )

    def plan_held_move(self, plan: str | None = None, settings: ExecutionSettings | None = None) -> Job:
        """What to command for a move of the chassis (None: the one planned last), with the pose held; settings as in
        :meth:`plan`. Raises Conflict where there is none, NotFound, InvalidInput for another mode.
        """
        newest = self._core.state.newest(BODY_MOVE)
        digest = plan or present(newest, "there is no move of the chassis yet; plan one")
        return self._held(HELD_MOVE, digest, "move of the chassis", settings)

    def plan_held_queue(self, plan: str | None = None, settings: ExecutionSettings | None = None) -> Job:
        """What to command for a queue (None: the present one), with the pose held; as :meth:`plan_held_move`."""
        digest = plan or present(self._core.state.queue, "there is no queue yet; put a plan into it")
        return self._held(HELD_QUEUE, digest, "queue", settings)

    def _held(self, kind: Kind, digest: str, called: str, settings: ExecutionSettings | None) -> Job:
        made = self._core.state.products.get(digest)
        if made is None or KINDS[made.kind].executed_by != kind.name:
            raise NotFound(f"the session holds no {called} {digest}", digest=digest)
        found = self._core.get(digest)
        if getattr(found, "plan", None) is None:
            raise Conflict(f"no {called} was found there: {getattr(found, 'reason', '')}")
        return self._core.product_jobs.submit(kind, _with_plan(made, digest), self._request(made, digest, settings))

    def _request(self, made: ProductRecord, digest: str, settings: ExecutionSettings | None) -> ExecutionRequest:
        if settings is not None and settings.mode != "pose_held" and made.kind != PLAN.name:
            called = "a queue" if made.kind == QUEUE.name else "a move of the chassis"
            raise InvalidInput(
                f"{called} can't be commanded {MODES[settings.mode][0]}: take the mode pose_held, or "
                "ask for it as commanded",
                mode=settings.mode,
            )
        state = self._core.typed(RobotState, made.parents["state"])
        plan = getattr(self._core.get(digest), "plan", None)
        chosen = settings or self.settings_in_force() if plan is None else self.settings_for(plan, settings)
        return ExecutionRequest(chosen, set_points_at(self._rover.link.frame, state))

    def set_points_now(self) -> NDArray[np.float64] | None:
        """Set points of an ATHLETE that sags as it stands, (legs × 6,) [rad]; None where it doesn't, or nothing tells.

        Without telemetry from there they are as the measured torques tell.
        """
        digest = self._core.state.state
        if digest is None or self._core.described is not None or self.way_of_commands().mode == "rigid":
            return None
        state = self._core.typed(RobotState, digest)
        told = set_points_at(self._rover.link.frame, state)
        if told is not None or not state.joint_torques.any():
            return told
        return state.posture + state.joint_torques / (self._core.state.joint_scale * self._core.robot.stiffness)

    def found(self, digest: str | None = None) -> str:
        """Digest of a step's execution (None: the present one), or of a held move. Raises Conflict where
        there is none, NotFound.
        """
        digest = digest or present(self._core.state.execution, "there is no execution of the present plan yet")
        made = self._core.state.products.get(digest)
        if made is None or KINDS[made.kind].given_as != EXECUTION.given_as:
            raise NotFound(f"the session holds no execution {digest}", digest=digest)
        return digest

    def settings_in_force(self, settings: ExecutionSettings | None = None) -> ExecutionSettings:
        """Those given (None: as delivered), their joints as stiff as was taken over last."""
        settings = settings or ExecutionSettings()
        return replace(settings, compliance=replace(settings.compliance, joint_scale=self._core.state.joint_scale))

    def settings_for(self, plan: "RigidPlan", settings: ExecutionSettings | None) -> ExecutionSettings:
        """Those of an order for a plan; None: as delivered, on ground with the plan's friction.

        The conservative polygon is asked for where the plan was made with it, whatever the order says.
        """
        from footfall.sequence.as_planned import as_planned, with_support_of

        return as_planned(plan, self.settings_in_force()) if settings is None else with_support_of(plan, settings)

    def sag(self) -> MeasuredSag:
        """How far the rover gave way in the latest run, compared with what its sequence predicted, and what that says.

        Raises Conflict where no sequence that knows sag was sent, InvalidInput where too little was to give way.
        """
        sent = [one for one in self._core.state.commands if one.run == self._core.state.runs]
        if not sent:
            raise Conflict("nothing was sent to the rover yet, so there is no sag to compare")
        postures = {
            one.payload["id"]: one.payload["posture"] for one in self._core.events() if "posture" in one.payload
        }

        def of_run(rows: list[CommandRecord]) -> Sag:
            seen = {one.row: np.array(postures[one.id]) for one in rows if one.id in postures}
            return sag_of(self._core.typed(Sequence, rows[0].sequence), seen)

        latest = of_run(sent)
        alike = [latest]
        for run in range(max(1, self._core.state.runs - MOST_RUNS), self._core.state.runs):
            # a run that says nothing of sag takes nothing from those that do
            with suppress(Conflict, InvalidInput):
                rows = [one for one in self._core.state.commands if one.run == run]
                found = of_run(rows) if rows else None
                if found is not None and found.stiffnesses == latest.stiffnesses:
                    alike.insert(-1, found)
        calibration, refused = None, ""
        try:
            calibration = calibration_of(alike, self._core.state.joint_scale)
        except InvalidInput as err:
            refused = err.message
        return MeasuredSag(**vars(latest), calibration=calibration, refused=refused)

    def take_over_stiffness(self, joint_scale: float | None = None) -> Calibration:
        """Take the joints to be as stiff as :meth:`sag` says from now on, where an order does not say; can be undone.

        joint_scale: what is thought to be taken over; None: whatever it says. Raises Conflict where it says another by
        now, or that is taken over already, and what :meth:`sag` raises.
        """
        with self._core.folded_log.lock:
            sag = self.sag()
            found = sag.calibration
            if found is None:
                raise Conflict(f"what was measured can't be taken over: {sag.refused}")
            if joint_scale is not None and not np.isclose(joint_scale, found.now, rtol=1e-6):
                raise Conflict(
                    f"the measured stiffness is {found.now:z.4f} times the described by now; look at it again",
                    yours=joint_scale,
                    present=found.now,
                )
            if np.isclose(found.now, found.was, rtol=1e-9):
                raise Conflict(f"the joints are taken to be {found.now:z.4f} times as stiff as described already")
            payload = {"joint_scale": found.now, "was": found.was, "ratio": found.ratio, "steps": found.steps}
            self._core.folded_log.record("stiffness_taken_over", {**payload, "sequence": sag.sequence})
        return found


def _with_plan(made: ProductRecord, plan: str) -> dict[str, str]:
    """Parents of the execution of a plan that was made so."""
    return {**{name: made.parents[name] for name in GROUND}, "plan": plan}


def set_points_at(frame: TelemetryFrame | None, state: RobotState) -> NDArray[np.float64] | None:
    """Set points (legs × 6,) [rad] of a rover that stands as ``state`` says within what the gate accepts, else None."""
    if frame is None or frame.state.posture.shape != state.posture.shape:
        return None
    names = tuple(map(str, range(len(state.posture))))
    found = difference(state.posture, state.T_site_base, frame.state, names)
    return None if found.beyond(*SENT) else frame.commanded
