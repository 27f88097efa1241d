"""Where the chassis could stand: what-if shifts, shifts for a footfall, and moves of the chassis."""

from fastapi import Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.bodies.answers import JobAnswer, StateNamed, WhatIfAnswer
from footfall.api.bodies.schemas import BodyMoveOrder, ShiftOrder, WhatIfOrder, settings_value
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes
from footfall.planning.stance.body_shift import BodyShift, PredictedState
from footfall.planning.stance.find_problem import FindShiftSettings, ShiftResult
from footfall.planning.stance.move import BodyMoveResult, BodyMoveSettings
from footfall.session.live import LiveSession

router = Routes(tags=["stances"])


@router.put("/sessions/{session}/what-if")
def what_if(live: OneSession, shift: WhatIfOrder) -> WhatIfAnswer:
    """Plan from where the rover would stand after this shift; its feet stay. 422 says which leg can't follow."""
    asked = settings_value(BodyShift, shift)
    return _about(live, live.what_if(asked or BodyShift()))


def _about(live: LiveSession, digest: str) -> WhatIfAnswer:
    state = product(live, digest, PredictedState)
    return {
        "state": digest,
        "shift": state.provenance.settings,
        "posture": state.posture,
        "T_site_base": state.T_site_base,
        "predicted": list(state.predicted),
        "wheel_forces": state.wheel_forces,
        "joint_torques": state.joint_torques,
    }


@router.delete("/sessions/{session}/what-if")
def end_what_if(live: OneSession) -> StateNamed:
    """Plan from how the rover stands again."""
    return {"state": live.end_what_if()}


@router.post("/sessions/{session}/shifts", status_code=202)
def find_shift(live: OneSession, order: ShiftOrder, response: Response) -> JobAnswer:
    """The smallest shift of the chassis that makes a footfall reachable and stable, as a job."""
    leg = live.robot.require_leg(order.leg)
    target = None if order.target is None else (order.target[0], order.target[1])
    return accepted(live.find_shift(leg, target, settings_value(FindShiftSettings, order.settings)), response)


@router.get("/sessions/{session}/shifts/{digest}")
def read_shift(live: OneSession, digest: Digest) -> ShiftResult:
    """One answer; ``current`` names the session's latest."""
    return product(live, digest, ShiftResult, live.state.shift)


@router.post("/sessions/{session}/body-moves", status_code=202)
def plan_body_move(live: OneSession, order: BodyMoveOrder, response: Response) -> JobAnswer:
    """A checked move of the chassis over its standing feet, as a job."""
    shift = settings_value(BodyShift, order.shift) or BodyShift()
    return accepted(live.plan_body_move(shift, settings_value(BodyMoveSettings, order.settings)), response)


@router.get("/sessions/{session}/body-moves/{digest}")
def read_body_move(live: OneSession, digest: Digest) -> BodyMoveResult:
    """One answer; ``current`` names the session's latest."""
    return product(live, digest, BodyMoveResult, live.state.body_move)
