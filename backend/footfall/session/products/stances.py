"""Where the chassis could stand: what-if shifts, shifts that make a footfall possible, and moves of the chassis."""

from typing import Any

from footfall.core.errors import Conflict, InvalidInput
from footfall.core.value import Value
from footfall.planning.stance.body_shift import BodyShift
from footfall.planning.stance.find_problem import FindShiftSettings
from footfall.planning.stance.move import BodyMoveSettings
from footfall.planning.step.problem import Footfall
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import BodyMoveRequest, ShiftRequest
from footfall.session.products.compared import UpToDateSession
from footfall.session.products.kinds import BODY_MOVE, GROUND, SHIFT, WHAT_IF, Kind
from footfall.session.products.terrains import SHORT_JOB
from footfall.session.recorded import present


class StanceSession(UpToDateSession):
    """The part of a session that moves the chassis in thought; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    def ask(self, kind: Kind, request: Value | None, *, urgent: bool = False, **about: Any) -> Job:
        """Have any kind made whose parents are robot, terrain and stance: ``kind`` says from which stance it counts.

        urgent: before what waits. about: further members of its event. Raises Conflict without terrain and state,
        InvalidInput for a kind with other parents, or the request of another.
        """
        if kind.needs != GROUND:
            raise InvalidInput(f"{kind.name} is made of {', '.join(kind.needs)}, which it has to be given")
        parents = self._standing_now() if kind.from_the_rover else self._ground()
        return self._workshop.submit(kind, parents, request, urgent=urgent, **about)

    def what_if(self, shift: BodyShift) -> str:
        """Plan from where the rover would stand after a shift of its chassis over its feet; returns the state's digest.

        The shift counts from how the rover stands, not from an earlier what-if. Nothing is sent: the command gate
        refuses plans that start where the rover is not. Raises Conflict without terrain and state, InvalidInput, with
        the leg and its joint, where the feet can't stay where they are.
        """
        return self.ask(WHAT_IF, shift, urgent=True).finish(SHORT_JOB)

    def end_what_if(self) -> str:
        """Plan from how the rover stands again; returns the digest of that state. Raises Conflict outside a what-if."""
        with self._journal.lock:
            digest = self.state.what_if
            if digest is None:
                raise Conflict("there is no what-if to end: what is shown is how the rover stands")
            self._journal.record("what_if_ended", {"digest": digest})
        return self._standing_now()["state"]

    def find_shift(
        self, leg: int, target: tuple[float, float] | None = None, settings: FindShiftSettings | None = None
    ) -> Job:
        """Look for the smallest shift of the chassis that makes a footfall possible; without a target, the chosen one.

        The shift counts from how the rover stands, as :meth:`what_if` and :meth:`plan_body_move` take it. Raises
        Conflict, InvalidInput.
        """
        self._require_leg(leg)
        chosen = self.choices.footfall
        if target is not None:
            chosen = Footfall(leg, float(target[0]), float(target[1]))
        elif chosen is None or chosen.leg != leg:
            raise Conflict("no footfall is chosen for this leg; choose one, or give a target")
        request = ShiftRequest(chosen, settings or FindShiftSettings())
        return self.ask(SHIFT, request, leg=leg)

    def plan_body_move(self, shift: BodyShift, settings: BodyMoveSettings | None = None) -> Job:
        """Plan a move of the chassis over its standing feet, from how the rover stands. Raises Conflict."""
        return self.ask(BODY_MOVE, BodyMoveRequest(shift, settings or BodyMoveSettings()))

    def _standing(self) -> dict[str, str]:
        """As :meth:`_ground`, with the rover as it stands also in a what-if."""
        parents = self._ground()
        return parents if self.state.what_if is None else {**parents, "state": self.state.what_if}

    def _standing_now(self, oldest: float = STALE_AFTER) -> dict[str, str]:
        """As :meth:`_standing`, of a rover that may have moved since it was frozen; by telemetry so old at most [s]."""
        return self._standing()

    def _ground(self) -> dict[str, str]:
        """Parents of everything that is computed for a rover on a terrain."""
        state = self.state
        dem = present(state.dem, "there is no terrain yet; load one, or build one from images")
        stance = present(state.state, "there is no state to plan from yet; freeze the rover's")
        return {"robot": self.robot_digest, "dem": dem, "state": stance}
