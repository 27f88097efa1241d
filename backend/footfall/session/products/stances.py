"""How the rover stands for planning, and where its chassis could: what-ifs, shifts for a footfall, moves."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from footfall.core.errors import Conflict, InvalidInput
from footfall.core.frames import pose_difference
from footfall.core.value import Value
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.move import BodyMoveSettings
from footfall.sequence.commands import Sequence
from footfall.session.choosing.choices import PageChoices
from footfall.session.core import SessionCore, present
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import BodyMoveRequest, ShiftRequest
from footfall.session.products.compared import UpToDate
from footfall.session.products.kinds import BODY_MOVE, GROUND, SHIFT, WHAT_IF, Kind
from footfall.session.products.terrains import SHORT_JOB
from footfall.session.products.up_to_date import MEASURED, SENT, StandingDifference
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.state import RobotState

STILL_TOLERANCE = 1e-4
"""A rover whose joints [rad] and chassis [m] differ by less has not moved."""


class Stances:
    """How the rover stands, and where its chassis could; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    def __init__(self, core: SessionCore, choices: PageChoices, rover: LinkedRover, fits: UpToDate) -> None:
        self._core, self._choices, self._rover, self._fits = core, choices, rover, fits

    def ask(
        self,
        kind: Kind,
        request: Value | None,
        *,
        urgent: bool = False,
        also: Mapping[str, str] | None = None,
        **about: Any,
    ) -> Job:
        """Have any kind made whose parents are robot, terrain and stance: ``kind`` says from which stance it counts.

        urgent: before what waits. also: further parents. about: further members of its event. Raises Conflict without
        terrain and state, InvalidInput for a kind with other parents, or the request of another.
        """
        if kind.needs != GROUND:
            raise InvalidInput(f"{kind.name} is made of {', '.join(kind.needs)}, which it has to be given")
        parents = self.standing_now() if kind.from_the_rover else self.ground()
        return self._core.product_jobs.submit(kind, {**parents, **(also or {})}, request, urgent=urgent, **about)

    def what_if(self, shift: BodyShift) -> str:
        """Plan from where the rover would stand after a shift of its chassis over its feet; returns the state's digest.

        The shift counts from how the rover stands, not from an earlier what-if. Nothing is sent: the command gate
        refuses plans that start where the rover is not. Raises Conflict without terrain and state, InvalidInput, with
        the leg and its joint, where the feet can't stay where they are.
        """
        return self.ask(WHAT_IF, shift, urgent=True).finish(SHORT_JOB)

    def end_what_if(self) -> str:
        """Plan from how the rover stands again; returns the digest of that state. Raises Conflict outside a what-if."""
        with self._core.folded_log.lock:
            digest = self._core.state.what_if
            if digest is None:
                raise Conflict("there is no what-if to end: what is shown is how the rover stands")
            self._core.folded_log.record("what_if_ended", {"digest": digest})
        return self.standing_now()["state"]

    def find_shift(
        self, leg: int, target: tuple[float, float] | None = None, settings: FindShiftSettings | None = None
    ) -> Job:
        """Look for the smallest shift of the chassis that makes a footfall possible; without a target, the chosen one.

        The shift counts from how the rover stands, as :meth:`what_if` and :meth:`plan_body_move` take it. Raises
        Conflict, InvalidInput.
        """
        self._core.require_leg(leg)
        chosen = self._choices.footfall_for(leg, target)
        request = ShiftRequest(chosen, settings or FindShiftSettings())
        return self.ask(SHIFT, request, leg=leg)

    def plan_body_move(
        self, shift: BodyShift, settings: BodyMoveSettings | None = None, *, as_planned_from: bool = False
    ) -> Job:
        """Plan a move of the chassis over its standing feet, from how the rover stands. Raises Conflict.

        as_planned_from: from the state that is planned from instead, as where a queue is predicted to end.
        """
        request = BodyMoveRequest(shift, settings or BodyMoveSettings())
        if not as_planned_from:
            return self.ask(BODY_MOVE, request)
        return self._core.product_jobs.submit(BODY_MOVE, self.ground(), request)

    def standing(self) -> dict[str, str]:
        """As :meth:`ground`, with the rover as it stands also in a what-if."""
        parents = self.ground()
        return parents if self._core.state.what_if is None else {**parents, "state": self._core.state.what_if}

    def standing_now(self, oldest: float = STALE_AFTER) -> dict[str, str]:
        """As :meth:`standing`, of a rover that may have moved since it was frozen; by telemetry so old at most [s]."""
        if self._rover.link.connected and (self._rover.link.age or 0.0) <= oldest and self.moved_since_frozen():
            self.freeze()
        return self.standing()

    def ground(self) -> dict[str, str]:
        """Parents of everything that is computed for a rover on a terrain. Raises Conflict where one is missing."""
        if self._core.state.state is None and self._core.state.dem is not None:
            self.freeze()
        state = self._core.state
        dem = present(state.dem, "there is no terrain yet; load one, or build one from images")
        stance = present(state.state, "there is no state to plan from yet; freeze the rover's")
        return {"robot": self._core.robot_digest, "dem": dem, "state": stance}

    def freeze(self) -> str:
        """Freeze the rover's present state for planning; the frozen one is kept while the rover still stands so.

        Raises Conflict where there is no telemetry.
        """
        frame = self._rover.frame
        if frame is None:
            raise Conflict("the rover has sent no telemetry yet, so there is no state to plan from")
        frozen, now = self._core.state.state, self._fits.place_on_map(frame.state).state
        if frozen is not None and stands_alike(self._core.typed(RobotState, frozen), now):
            return frozen
        return self.set(now)

    def set(self, state: RobotState) -> str:
        """Plan from ``state`` from now on. Returns its digest."""
        self._core.require_robot(state)
        with self._core.folded_log.lock:
            digest = self._core.put(state)
            if digest != self._core.state.state:
                self._core.folded_log.record("state_frozen", {"digest": digest})
        return digest

    def moved_since_frozen(self) -> bool:
        """Whether the rover stands otherwise than the state says that is, or counts as, how it stands."""
        measured, frozen = self._fits.measured(), self._core.state.what_if or self._core.state.state
        if measured is None or frozen is None:
            return False
        return bool(self._between(self._fits.stance(frozen), measured.state).beyond(*MEASURED))

    def stands_in_what_if(self) -> RobotState | None:
        """How a rover at rest stands that has gone to where the what-if has it; None where that is not so.

        It stands there now, or its latest run was to end there: where a rover that sags ends is somewhat else.
        """
        state, frame = self._core.state, self._rover.frame
        if state.what_if is None or state.state is None or frame is None or frame.state.mode != "idle":
            return None
        if self._rover.commanding.gate.run is not None or not self.moved_since_frozen():
            return None
        now, there = self._fits.place_on_map(frame.state).state, self._fits.stance(state.state)
        left, came = self._between(self._fits.stance(state.what_if), now), self._between(there, now)
        arrived = not came.beyond(*SENT) and came.moved <= left.moved and abs(came.turned) <= abs(left.turned)
        return now if arrived or self._ran_to(there) else None

    def _ran_to(self, there: RobotState) -> bool:
        """Whether the latest run was carried out since the what-if was asked, and was to end ``there``."""
        state = self._core.state
        if state.run is None or state.run.outcome != "done":
            return False
        for event in reversed(self._core.events()):
            if event.type == "run_ended":
                break
            if event.payload.get("digest") == state.state and event.type == "product":
                return False  # asked after it
        sequence = self._core.typed(Sequence, state.run.sequence)
        end = replace(there, posture=sequence.predicted[-1], T_site_base=sequence.poses[-1])
        return not self._between(there, end).beyond(*SENT)

    def _between(self, then: RobotState, now: RobotState) -> StandingDifference:
        return self._core.difference(then.posture, then.T_site_base, now)


def stands_alike(one: RobotState, other: RobotState) -> bool:
    """Whether two states differ by no more than encoder noise; clock, forces and torques don't count."""
    if one.robot != other.robot or one.mode != other.mode or one.posture.shape != other.posture.shape:
        return False
    turned = float(np.abs(one.posture - other.posture).max())
    return max(turned, pose_difference(one.T_site_base, other.T_site_base)) <= STILL_TOLERANCE
