"""Telemetry and state: what the rover last said, and the state that planning starts from."""

from typing import Any

import numpy as np

from footfall.api.access import OneSession, product
from footfall.api.routing import Routes
from footfall.api.schemas import FreezeState, StateReport
from footfall.api.streams import telemetry_body
from footfall.core.errors import InvalidTelemetry, NotFound
from footfall.planning.stance.stand import stand
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

router = Routes(tags=["telemetry"])


@router.get("/sessions/{session}/telemetry")
def latest(live: OneSession) -> dict[str, Any]:
    """The newest telemetry frame and its age."""
    frame = live.frame
    if frame is None:
        raise NotFound("the rover has sent no telemetry to this session yet")
    return telemetry_body(frame, live.telemetry_age)


@router.post("/sessions/{session}/telemetry", status_code=201)
def take_report(live: OneSession, report: StateReport) -> dict[str, Any]:
    """Give the state yourself, where no rover is linked; planning starts from it."""
    legs = live.robot.leg_count
    if len(report.posture) != 6 * legs:
        raise InvalidTelemetry(f"{live.robot.name} has {6 * legs} joints, not {len(report.posture)}")
    state = RobotState(
        robot=live.robot.name,
        time=report.time,
        posture=np.array(report.posture, float),
        T_site_base=np.array(report.T_site_base, float),
        wheel_forces=np.array(report.wheel_forces, float).reshape(-1, 3),
        joint_torques=np.array(report.joint_torques, float),
        mode=report.mode,
    )
    return {"digest": live.set_state(state)}


@router.get("/sessions/{session}/state")
def read_state(live: OneSession) -> Any:
    """The state that planning starts from."""
    return product(live, "current", RobotState, live.state.state)


@router.post("/sessions/{session}/state", status_code=201)
def freeze(live: OneSession, order: FreezeState) -> dict[str, Any]:
    """Freeze the rover's state for planning; with ``stand``, compute a stance on the current terrain."""
    if order.stand is None:
        return {"digest": live.snapshot_state()}
    dem = product(live, "current", Dem, live.state.dem)
    where = order.stand
    return {"digest": live.set_state(stand(live.robot, dem, where.x, where.y, where.yaw, where.posture))}
