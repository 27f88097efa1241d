"""A session against its plan: where what is planned starts, whether the rover stands there, and what a ghost plays."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.planning.step.problem import PlanResult, Status
from footfall.planning.walk.problem import WalkResult
from footfall.sequence.commands import Sequence
from footfall.session.carried_out import carried_out, to_command
from footfall.session.commanded import CommandedSession
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.log.fold import SessionState
from footfall.session.products.kinds import KINDS, PLAN, SEQUENCE, WALK
from footfall.session.products.up_to_date import MEASURED, SENT, Difference, difference, near_told
from footfall.telemetry.state import RobotState


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
            unknown = f"the latest telemetry is {age:z.1f} s old"
        if unknown or start is None or frame is None:
            return {"ok": None, "joint": None, "difference": None, "reason": unknown, "older_ground": older}
        posture, T_site_base = start
        place, names = self.place_on_map(frame.state), self.description.joint_names
        found = max((difference(posture, T_site_base, one, names) for one in place.possible), key=lambda one: one.moved)
        what = found.beyond(*SENT)
        doubt = f": {place.doubt}" if place.doubt else ""
        reason = {
            "": near_told(found),
            "chassis": f"the chassis has moved by {found.moved:z.3f} m since the plan was made{doubt}",
            "joint": f"{found.joint} is {found.turned:+z.4f} rad from where the plan starts",
        }[what]
        told = {"joint": found.joint, "difference": found.turned, "reason": reason, "older_ground": older}
        return {"ok": not what, **told}

    def moved_since_frozen(self) -> bool:
        """Whether the rover stands otherwise than the state says that is, or counts as, how it stands."""
        measured, frozen = self._measured(), self.state.what_if or self.state.state
        if measured is None or frozen is None:
            return False
        return bool(self._between(self._stance(frozen), measured.state).beyond(*MEASURED))

    def stands_in_what_if(self) -> RobotState | None:
        """How a rover at rest stands that has gone to where the what-if has it; None where that is not so.

        It stands there now, or its latest run was to end there: where a rover that sags ends is somewhat else.
        """
        state, frame = self.state, self.frame
        if state.what_if is None or state.state is None or frame is None or frame.state.mode != "idle":
            return None
        if self._commanding.gate.run is not None or not self.moved_since_frozen():
            return None
        now, there = self.place_on_map(frame.state).state, self._stance(state.state)
        left, came = self._between(self._stance(state.what_if), now), self._between(there, now)
        arrived = not came.beyond(*SENT) and came.moved <= left.moved and abs(came.turned) <= abs(left.turned)
        return now if arrived or self._ran_to(there) else None

    def _ran_to(self, there: RobotState) -> bool:
        """Whether the latest run was carried out since the what-if was asked, and was to end ``there``."""
        state = self.state
        if state.run is None or state.run.outcome != "done":
            return False
        for event in reversed(self.events()):
            if event.type == "run_ended":
                break
            if event.payload.get("digest") == state.state and event.type == "product":
                return False  # asked after it
        sequence = self._shelf.typed(Sequence, state.run.sequence)
        end = replace(there, posture=sequence.predicted[-1], T_site_base=sequence.poses[-1])
        return not self._between(there, end).beyond(*SENT)

    def _between(self, then: RobotState, now: RobotState) -> Difference:
        return difference(then.posture, then.T_site_base, now, self.description.joint_names)

    @property
    def played(self) -> str | None:
        """Digest of what a ghost plays: the walk or the planned step, whichever is newer or the view asks for since."""
        walk, step = self._walk_played, self.step_played
        if walk is None or step is None:
            return walk or step
        view = self.view
        for event in reversed(self.events()):
            if view.plays != "newest" and event.seq <= view.plays_since:
                return walk if view.plays == "walk" else step
            kind = KINDS[event.payload["kind"]] if event.type == "product" else None
            if kind is WALK:
                return walk
            if event.type == "plan_chosen" or (kind is not None and (kind is PLAN or kind.is_commands)):
                return step
        return step

    @property
    def _walk_played(self) -> str | None:
        """Digest of the latest walk, where it was found or comes part of its way."""
        digest = self.state.newest(WALK)
        found = None if digest is None else self._shelf.typed(WalkResult, digest)
        return None if found is None or (found.plan or found.partial) is None else digest

    @property
    def step_played(self) -> str | None:
        """Digest of what a ghost plays of a step: the plan, or the sequence where that is newer and moves otherwise.

        It does where it was edited, or moves the chassis: what is looked at is what would be sent.
        """
        state = self.state
        for event in reversed(self.events()):
            kind = KINDS[event.payload["kind"]] if event.type == "product" else None
            if kind is PLAN or event.type == "plan_chosen":
                break
            if kind is not None and kind.is_commands and state.sequence is not None:
                edited = state.kind_of(state.sequence) is not SEQUENCE
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
        if source is not None and source.kind == PLAN.name:
            return behind != state.plan
        return state.plan is not None and self.step_played == state.plan

    @property
    def to_command(self) -> dict[str, Any] | None:
        """What commands are to be made of, as :func:`footfall.session.carried_out.to_command` tells it."""
        finished = carried_out(self.state, self._rows_of)
        return to_command(self.state, self.events(), finished, self._found)

    def _found(self, digest: str) -> bool:
        return getattr(self._shelf.get(digest), "status", None) is Status.FOUND

    @property
    def commands_carried_out(self) -> bool:
        """Whether the rover has carried out the present commands, and does not stand where they start again."""
        state, frame = self.state, self.frame
        if state.sequence is None or state.sequence not in carried_out(state, self._rows_of):
            return False
        if frame is None:
            return True
        sequence = self._shelf.typed(Sequence, state.sequence)
        names = self.description.joint_names
        return difference(sequence.start, sequence.T_site_base, frame.state, names).beyond(*SENT) != ""

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
