"""Telemetry and state: what the rover last said, and the state that planning starts from."""

from typing import Annotated, TypedDict, cast

import numpy as np
from fastapi import Query, Request
from pydantic import Field

from footfall.api.access import AllSessions, OneSession, product
from footfall.api.bodies.answers import Digested, Listener, TelemetryAnswer
from footfall.api.bodies.schemas import FreezeState, Stand, StateReport
from footfall.api.bodies.settings_models import settings_value
from footfall.api.door.in_turn import in_turn
from footfall.api.routing import Routes
from footfall.api.streams import telemetry_body
from footfall.balance.tether import Tether
from footfall.core.errors import InvalidInput, InvalidTelemetry, NotFound
from footfall.planning.body.body_shift import PredictedState
from footfall.session.rover.past import KEPT_FOR, MOST_PARTS, PastTelemetry
from footfall.session.rover.recorded import RecordedTelemetry, recorded
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

router = Routes(tags=["telemetry"])

QuantityName = Annotated[
    str, Query(description="torque, position, error, force, share, place, lean or tilt", max_length=20)
]
Age = Annotated[float, Query(description="how long ago [s]", allow_inf_nan=False, ge=0, le=KEPT_FOR)]
Channel = Annotated[int, Query(description="the first channel, from 0", ge=0, le=1000)]
Channels = Annotated[int, Query(description="how many channels", ge=1, le=64)]
Recorded = Annotated[
    list[Annotated[str, Field(pattern=r"^[a-z]{1,20}\.[0-9]{1,3}$")]],
    Query(description="quantity and number from 0, as torque.12", min_length=1, max_length=64),
]
Moment = Annotated[float | None, Query(description="seconds since 1970-01-01 UTC", allow_inf_nan=False, ge=0, le=1e11)]
Parts = Annotated[int, Query(description="parts that the time is cut into", ge=1, le=MOST_PARTS)]


class LatestTelemetry(TelemetryAnswer):
    """arrival: its number among all that came; received_at: when it came, seconds since 1970-01-01 UTC.

    measured_age_s: since it was measured: its light time counts as well.
    """

    measured_age_s: float
    arrival: int
    received_at: float


class Listeners(TypedDict):
    """slow: how many of them are slow."""

    listeners: list[Listener]
    slow: int


@router.get("/sessions/{session}/telemetry")
def latest(live: OneSession) -> LatestTelemetry:
    """The newest telemetry frame, when it came and how old it is."""
    link, frame = live.rover.link, live.rover.frame
    if frame is None:
        raise NotFound("the rover has sent no telemetry to this session yet")
    body = telemetry_body(frame, link.age or 0.0, link.light)
    return cast(LatestTelemetry, {**body, "arrival": link.frames, "received_at": link.received_at})


@router.get("/sessions/{session}/telemetry/past")
def past(
    live: OneSession,
    quantity: QuantityName,
    since: Age = KEPT_FOR,
    until: Age = 0.0,
    first: Channel = 0,
    count: Channels = 1,
    parts: Parts = 300,
) -> PastTelemetry:
    """What the rover said in the last ten minutes, as far as this server heard it: channels of a quantity, for a plot.

    Quantities: torque [N·m], position and error (commanded less measured) [rad] of each joint, force (up) [N] of each
    wheel, place (x, y, z) [m], lean (roll, pitch, yaw) [rad]. The time is cut into parts; of each come one or two
    moments with the least and the greatest number in it, so that no peak is lost. Ages count from this answer.
    """
    return live.rover.past.looked_at(quantity, first, count, since, until, parts)


@router.get("/sessions/{session}/telemetry/recorded")
async def past_recorded(
    live: OneSession,
    sessions: AllSessions,
    channel: Recorded,
    begin: Moment = None,
    end: Moment = None,
    parts: Parts = 300,
) -> RecordedTelemetry:
    """What the rover said in the whole session, as its recordings hold it: any channels together, for a plot.

    Quantities are those of the last ten minutes, and share (of the weight on each wheel), tilt (of the chassis from the
    vertical) [rad] and interval (since the frame before) [s]. Without begin or end it goes from the first or to the
    last frame. The time is cut into parts; of each come one or two moments with the least and the greatest number in
    it, so that no peak is lost. Each answer reads a little more of the recordings: ask again while ``unread`` is
    above 0.
    """
    channels = [(quantity, int(number)) for quantity, number in (one.split(".") for one in channel)]

    def look() -> RecordedTelemetry:
        return sessions.read_recordings(recorded, live.rover.recorder.paths(), channels, begin, end, parts)

    return await in_turn(look)


@router.get("/sessions/{session}/listeners")
def listeners(live: OneSession, request: Request) -> Listeners:
    """Who listens to the events of this session, what they took and what was dropped because they were slow."""
    found = request.app.state.streams.listeners(live.id)
    return {"listeners": found, "slow": sum(one["slow"] for one in found)}


@router.post("/sessions/{session}/telemetry", status_code=201)
def take_report(live: OneSession, report: StateReport) -> Digested:
    """Give the state yourself, where no rover is linked; planning starts from it."""
    joints, name = len(live.layout.joint_names), live.state.robot_name
    if len(report.posture) != joints:
        raise InvalidTelemetry(f"{name} has {joints} joints, not {len(report.posture)}")
    state = RobotState(
        robot=name,
        time=report.time,
        posture=np.array(report.posture, float),
        T_site_base=np.array(report.T_site_base, float),
        wheel_forces=np.array(report.wheel_forces, float).reshape(-1, 3),
        joint_torques=np.array(report.joint_torques, float),
        mode=report.mode,
        described=None if live.described is None else live.layout,
    )
    return {"digest": live.stances.set(state)}


@router.get("/sessions/{session}/state")
def read_state(live: OneSession) -> RobotState | PredictedState:
    """The state that planning starts from; in a what-if it is predicted."""
    return product(live, "current", RobotState, live.state.state)


@router.post("/sessions/{session}/state", status_code=201)
def freeze(live: OneSession, order: FreezeState) -> Digested:
    """Freeze the rover's state for planning; with ``stand``, compute a stance on the current terrain."""
    if order.stand is None:
        return {"digest": live.stances.freeze()}
    from footfall.planning.body.stand import stand
    from footfall.planning.legged.measured import measured_at_rest
    from footfall.planning.walk.stand_to_walk import hanging
    from footfall.robot.legged.legged_robot import LeggedRobot

    dem = product(live, "current", Dem, live.state.dem)
    where, tether = order.stand, settings_value(Tether, order.stand.tether)
    robot = live.any_robot
    if isinstance(robot, LeggedRobot):
        if tether is not None or where.posture != Stand().posture:
            raise InvalidInput(f"{robot.name} stands at ease, without tether: leave out tether and posture")
        return {"digest": live.stances.set(measured_at_rest(robot, dem, where.x, where.y, where.yaw))}
    if tether is not None:
        return {"digest": live.stances.set(hanging(live.robot, dem, where.x, where.y, where.yaw, tether))}
    return {"digest": live.stances.set(stand(live.robot, dem, where.x, where.y, where.yaw, where.posture))}
