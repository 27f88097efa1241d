"""What if the chassis stood elsewhere. Shifts for a footfall and moves of the chassis: see footfall.api.kinds."""

from footfall.api.access import OneSession, product
from footfall.api.bodies.answers import StateNamed, WhatIfAnswer
from footfall.api.bodies.schemas import WhatIfOrder
from footfall.api.bodies.settings_models import settings_value
from footfall.api.routing import Routes
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.session.live import LiveSession

router = Routes(tags=["stances"])


@router.put("/sessions/{session}/what-if")
def what_if(live: OneSession, shift: WhatIfOrder) -> WhatIfAnswer:
    """Plan from where the rover would stand after this shift; its feet stay. 422 says which leg can't follow."""
    asked = settings_value(BodyShift, shift)
    return _about(live, live.stances.what_if(asked or BodyShift()))


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
    return {"state": live.stances.end_what_if()}
