"""Executions of a session: what is commanded so that the rover, which sags, makes the planned step."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import Conflict, NotFound
from footfall.planning.execution.settings import ExecutionSettings
from footfall.sequence.commands import Sequence
from footfall.session.choosing.hand import HandSession
from footfall.session.gate.checks import POSE_TOLERANCE, START_TOLERANCE, pose_difference
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import ExecutionRequest
from footfall.session.products.sag import Sag, sag_of
from footfall.session.recorded import present
from footfall.session.rover.link import RoverLink
from footfall.telemetry.state import RobotState, TelemetryFrame


class ExecutionSession(HandSession):
    """The part of a session that turns plans into set points; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    link: RoverLink

    def plan_execution(self, plan: str | None = None, settings: ExecutionSettings | None = None) -> Job:
        """What to command for a planned step (None: the present one), from the state that it was planned from.

        Set points are the rover's present ones where it still stands so, else those that its torques tell. Raises
        Conflict where there is no plan, NotFound.
        """
        digest, made = self._made_plan(plan)
        self._found_plan(digest)
        state = self._shelf.typed(RobotState, made.parents["state"])
        request = ExecutionRequest(settings or ExecutionSettings(), set_points_at(self.link.frame, state))
        return self._workshop.submit("execution", {**made.parents, "plan": digest}, request)

    def found_execution(self, digest: str | None = None) -> str:
        """Digest of an execution (None: the present one). Raises Conflict where there is none, NotFound."""
        digest = digest or present(self.state.execution, "there is no execution of the present plan yet")
        made = self.state.products.get(digest)
        if made is None or made.kind != "execution":
            raise NotFound(f"the session holds no execution {digest}", digest=digest)
        return digest

    def sag(self) -> Sag:
        """How far the rover gave way in the latest run, compared with what its sequence predicted.

        Raises Conflict where no sequence that knows sag was sent, InvalidInput where too little was to give way.
        """
        sent = [one for one in self.state.commands if one.run == self.state.runs]
        if not sent:
            raise Conflict("nothing was sent to the rover yet, so there is no sag to compare")
        postures = {one.payload["id"]: one.payload["posture"] for one in self.events() if "posture" in one.payload}
        seen = {one.row: np.array(postures[one.id]) for one in sent if one.id in postures}
        return sag_of(self._shelf.typed(Sequence, sent[0].sequence), seen)


def set_points_at(frame: TelemetryFrame | None, state: RobotState) -> NDArray[np.float64] | None:
    """Set points (legs × 6,) [rad] of a rover that stands as ``state`` says within what the gate accepts, else None."""
    if frame is None or frame.state.posture.shape != state.posture.shape:
        return None
    turned = float(np.abs(frame.state.posture - state.posture).max())
    moved = pose_difference(state.T_site_base, frame.state.T_site_base)
    if turned > START_TOLERANCE or moved > POSE_TOLERANCE:
        return None
    return frame.commanded
