"""A session against its plan: where what is planned starts, whether the rover stands there, and what a ghost plays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.planning.step.problem import PlanResult
from footfall.sequence.commands import Sequence
from footfall.session.commanded import CommandedSession
from footfall.session.gate.checks import POSE_TOLERANCE, STALE_AFTER, START_TOLERANCE, pose_difference, worst_joint
from footfall.session.log.fold import SEQUENCES, SessionState


class PlannedSession(CommandedSession):
    """The part of a session that holds plan and rover together; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    def plan_matches_rover(self) -> dict[str, Any]:
        """Whether the rover stands where what was planned last starts; ok is None where that can't be told.

        older_ground: whether it was planned on other ground than is there now, where the gate refuses it.
        """
        state, frame = self.state, self.frame
        start, age = self._start_of(state), self.link.age
        older = start is not None and self._ground_of(state) != state.dem
        unknown = ""
        if start is None:
            unknown = "there is no plan yet"
        elif frame is None or age is None:
            unknown = "the rover has sent no telemetry yet"
        elif not self.link.connected:
            unknown = "the rover is not connected"
        elif age > STALE_AFTER:
            unknown = f"the latest telemetry is {age:.1f} s old"
        if unknown or start is None or frame is None:
            return {"ok": None, "joint": None, "difference": None, "reason": unknown, "older_ground": older}
        posture, T_site_base = start
        joint, difference = worst_joint(posture, frame.state, self.description.joint_names)
        moved = pose_difference(T_site_base, frame.state.T_site_base)
        if abs(difference) > START_TOLERANCE:
            reason = f"{joint} is {difference:+.4f} rad from where the plan starts"
        elif moved > POSE_TOLERANCE:
            reason = f"the chassis has moved by {moved:.3f} m since the plan was made"
        else:
            reason = ""
        told = {"joint": joint, "difference": difference, "reason": reason, "older_ground": older}
        return {"ok": not reason, **told}

    @property
    def played(self) -> str | None:
        """Digest of what a ghost plays: the plan, or the sequence where that is newer and moves otherwise.

        It does where it was edited, or moves the chassis: what is looked at is what would be sent.
        """
        state = self.state
        for event in reversed(self.events()):
            kind = event.payload.get("kind") if event.type == "product" else None
            if kind == "plan" or event.type == "plan_chosen":
                break
            if kind in SEQUENCES and state.sequence is not None:
                edited = state.products[state.sequence].kind in ("edit", "import")
                moves = self._shelf.typed(Sequence, state.sequence).Ts_site_base is not None
                return state.sequence if edited or moves else state.plan
        return state.plan

    @property
    def commands_of_another_plan(self) -> bool:
        """Whether the present commands go back to another plan, or move, than what was planned last."""
        state = self.state
        made = None if state.sequence is None else state.products.get(state.before_edits(state.sequence))
        if made is None:
            return False
        behind = made.parents.get("plan", "")
        executed = state.products.get(made.parents.get("execution", ""))
        if executed is not None:
            behind = executed.parents["plan"]
        source = state.products.get(behind)
        if source is not None and source.kind == "plan":
            return behind != state.plan
        return state.plan is not None and self.played == state.plan

    def _ground_of(self, state: SessionState) -> str | None:
        """Digest of the terrain that what was planned last was planned on."""
        if state.sequence is not None and not self.commands_of_another_plan:
            return self._planned_on(state.sequence)
        return None if state.plan is None else state.products[state.plan].parents["dem"]

    def _start_of(self, state: SessionState) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Posture and T_site_base where what was planned last starts: by its commands, or the plan without them."""
        if state.sequence is not None and not self.commands_of_another_plan:
            sequence = self._shelf.typed(Sequence, state.sequence)
            return sequence.start, sequence.T_site_base
        plan = None if state.plan is None else self._shelf.typed(PlanResult, state.plan).plan
        return None if plan is None else (plan.waypoints[0], plan.T_site_base)
