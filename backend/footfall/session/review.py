"""The rover against its plan: where what is planned starts, whether the rover stands there, and what a ghost plays."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.value import Value
from footfall.planning.answers import Status
from footfall.planning.legged.problem import LeggedResult
from footfall.planning.step.problem import PlanResult
from footfall.planning.walk.problem import WalkResult
from footfall.sequence.commands import Sequence
from footfall.session.answers.plans import MatchAnswer, PlannedFor, ToCommand
from footfall.session.carried_out import carried_out, planned_behind, to_command
from footfall.session.choosing.choices import PageChoices
from footfall.session.core import SessionCore
from footfall.session.gate.checks import STALE_AFTER, UNHEARD_SINCE
from footfall.session.jobs.requests import DescribedStepRequest, DescribedWalkRequest, StepRequest, WalkRequest
from footfall.session.log.fold import SessionState
from footfall.session.products.compared import UpToDate
from footfall.session.products.kinds import KINDS, QUEUE, SEQUENCE
from footfall.session.products.sequences import Sequences
from footfall.session.products.up_to_date import SENT, near_enough_in_words
from footfall.session.rover.linked import LinkedRover


class Review:
    """Plan and rover held together; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(
        self, core: SessionCore, choices: PageChoices, rover: LinkedRover, fits: UpToDate, sequences: Sequences
    ) -> None:
        self._core, self._choices, self._rover, self._fits, self._sequences = core, choices, rover, fits, sequences

    def plan_matches_rover(self) -> MatchAnswer:
        """Whether the rover stands where what was planned last starts; ok is None where that can't be told.

        older_ground: whether it was planned on other ground than is there now, where the gate refuses it.
        """
        state, frame = self._core.state, self._rover.frame
        start, age = self._start_of(state), self._rover.link.age
        older = start is not None and self._ground_of(state) != state.dem
        unknown = ""
        if start is None:
            unknown = "there is no plan yet"
        elif frame is None or age is None:
            unknown = "the rover has sent no telemetry yet"
        elif not self._rover.link.connected:
            unknown = "the rover is not connected"
        elif self._rover.link.age_since_connected is None:
            unknown = UNHEARD_SINCE
        elif age > STALE_AFTER:
            unknown = f"the latest telemetry is {age:z.1f} s old"
        if unknown or start is None or frame is None:
            return {"ok": None, "joint": None, "difference": None, "reason": unknown, "older_ground": older}
        posture, T_site_base = start
        place = self._fits.place_on_map(frame.state)
        apart = (self._core.difference(posture, T_site_base, one) for one in place.possible)
        found = max(apart, key=lambda one: one.moved)
        what, unit = found.beyond(*SENT), "m" if found.slides else "rad"
        doubt = f": {place.doubt}" if place.doubt else ""
        reason = {
            "": near_enough_in_words(found),
            "chassis": f"the chassis has moved by {found.moved:z.3f} m since the plan was made{doubt}",
            "joint": f"{found.joint} is {found.turned:+z.4f} {unit} from where the plan starts",
        }[what]
        ok, joint, turned = not what, found.joint, found.turned
        return {"ok": ok, "joint": joint, "difference": turned, "reason": reason, "older_ground": older}

    @property
    def played(self) -> str | None:
        """Digest of what a ghost plays: the walk or the planned step, whichever is newer or the view asks for since."""
        walk, step = self._walk_played, self.step_played
        if walk is None or step is None:
            return walk or step
        view = self._choices.view
        for event in reversed(self._core.events()):
            if view.plays != "newest" and event.seq <= view.plays_since:
                return walk if view.plays == "walk" else step
            kind = KINDS[event.payload["kind"]] if event.type == "product" else None
            if kind is not None and kind.plays == "walk":
                return walk
            if event.type == "plan_chosen" or (kind is not None and (kind.plays == "step" or kind.is_commands)):
                return step
        return step

    def _newest(self, plays: str) -> str | None:
        """Digest of the latest answer that a ghost plays so; a session's robot has one kind of each."""
        found = (self._core.state.newest(kind) for kind in KINDS.values() if kind.plays == plays)
        return next((digest for digest in found if digest is not None), None)

    @property
    def planned_for(self) -> PlannedFor:
        """The footfall and the goal that were asked for, of the latest step and walk that were planned."""
        step, walk = self._asked("step"), self._asked("walk")
        footfall = step.footfall if isinstance(step, (StepRequest, DescribedStepRequest)) else None
        goal = walk.goal if isinstance(walk, (WalkRequest, DescribedWalkRequest)) else None
        return {
            "footfall": None if footfall is None else {"leg": footfall.leg, "x": footfall.x, "y": footfall.y},
            "goal": None if goal is None else {"x": goal.x, "y": goal.y, "yaw": goal.yaw},
        }

    def _asked(self, plays: str) -> Value | None:
        """The request of the latest answer that a ghost plays so."""
        digest = self._newest(plays)
        settings = None if digest is None else self._core.state.products[digest].settings
        return None if settings is None else self._core.get(settings)

    @property
    def _walk_played(self) -> str | None:
        """Digest of the latest walk, where it was found or comes part of its way."""
        digest = self._newest("walk")
        found = None if digest is None else self._core.get(digest)
        goes = isinstance(found, (WalkResult, LeggedResult)) and (found.plan or found.partial) is not None
        return digest if goes else None

    @property
    def step_played(self) -> str | None:
        """Digest of what a ghost plays of a step: the plan, or the sequence where that is newer and moves otherwise.

        It does where it was edited, or moves the chassis: what is looked at is what would be sent.
        """
        state, step = self._core.state, self._newest("step")
        for event in reversed(self._core.events()):
            kind = KINDS[event.payload["kind"]] if event.type == "product" else None
            if event.type == "plan_chosen" or (kind is not None and kind.plays == "step"):
                break
            if kind is not None and kind.is_commands and state.sequence is not None:
                edited = state.kind_of(state.sequence) is not SEQUENCE
                moves = self._core.typed(Sequence, state.sequence).Ts_site_base is not None
                return state.sequence if edited or moves or self._of_queue else step
        return step

    @property
    def _of_queue(self) -> bool:
        """Whether the present commands go back to a queue."""
        state = self._core.state
        return state.sequence is not None and state.kind_of(planned_behind(state, state.sequence)) is QUEUE

    @property
    def commands_of_another_plan(self) -> bool:
        """Whether the present commands go back to another plan, or move, than what was planned last."""
        state = self._core.state
        if state.sequence is None or state.before_edits(state.sequence) not in state.products:
            return False
        behind = planned_behind(state, state.sequence)
        if self._of_queue and behind != state.queue:
            return True
        source, step = state.kind_of(behind), self._newest("step")
        if source is not None and source.plays and source.offered:
            return behind != self._planned
        return step is not None and self.step_played == step

    @property
    def to_command(self) -> ToCommand | None:
        """What commands are to be made of, as :func:`footfall.session.carried_out.to_command` tells it."""
        finished = carried_out(self._core.state, self._sequences.rows_of)
        return to_command(self._core.state, self._core.events(), finished, self._found)

    def _found(self, digest: str) -> bool:
        return getattr(self._core.get(digest), "status", None) is Status.FOUND

    @property
    def commands_carried_out(self) -> bool:
        """Whether the rover has carried out the present commands, and does not stand where they start again."""
        state, frame = self._core.state, self._rover.frame
        if state.sequence is None or state.sequence not in carried_out(state, self._sequences.rows_of):
            return False
        if frame is None:
            return True
        sequence = self._core.typed(Sequence, state.sequence)
        return self._core.difference(sequence.start, sequence.T_site_base, frame.state).beyond(*SENT) != ""

    def _ground_of(self, state: SessionState) -> str | None:
        """Digest of the terrain that what was planned last was planned on."""
        if state.sequence is not None and not self.commands_of_another_plan:
            return self._sequences.planned_on(state.sequence)
        planned = self._planned
        return None if planned is None else state.products[planned].parents["dem"]

    def _start_of(self, state: SessionState) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Posture and T_site_base where what was planned last starts: by its commands, or the plan without them."""
        if state.sequence is not None and not self.commands_of_another_plan:
            sequence = self._core.typed(Sequence, state.sequence)
            return sequence.start, sequence.T_site_base
        found = None if self._planned is None else self._core.get(self._planned)
        if isinstance(found, LeggedResult) and found.plan is not None:
            return found.plan.waypoints[0], found.plan.Ts_site_base[0]
        plan = found.plan if isinstance(found, PlanResult) else None
        return None if plan is None else (plan.waypoints[0], plan.T_site_base)

    @property
    def _planned(self) -> str | None:
        """Digest of what was planned last of the steps, and walks, that commands are made of as they are."""
        state = self._core.state
        able = {state.newest(kind) for kind in KINDS.values() if kind.plays and kind.offered} - {None}
        if len(able) < 2:
            return next(iter(able), None)
        products = (one.payload["digest"] for one in reversed(self._core.events()) if one.type == "product")
        return next(digest for digest in products if digest in able)
