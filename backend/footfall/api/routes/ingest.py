"""Telemetry and images by plain requests, for a rover or gateway that can't keep a WebSocket: the same messages.

Nothing goes down this way. What comes is checked, stamped and counted as on the link (docs/rover-link.md).
"""

import time
from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, TypedDict

from anyio import CapacityLimiter, to_thread
from fastapi import Query, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, ConfigDict, Field

from footfall.api.access import AllSessions, client_of, current_session
from footfall.api.acting import Actor
from footfall.api.door.body_limits import TELEMETRY_PARTS
from footfall.api.door.in_turn import in_turn
from footfall.api.routes.rover import RoverDoor, fault_of, require_same_rover
from footfall.api.routing import Routes
from footfall.core.errors import Busy, Conflict, FootFallError, InvalidTelemetry
from footfall.io.link_images import decode_images
from footfall.session.answers.commands import LightTimeAnswer, LinkAnswer
from footfall.session.live import LiveSession
from footfall.session.rover.light_time import LONGEST, LightTime
from footfall.telemetry.fields import Fields, parse_object
from footfall.telemetry.link import PROTOCOL, HelloMessage, message_from
from footfall.telemetry.state import MODES, TelemetryFrame

router = Routes(tags=["rover"])

MOST_FRAMES = 1000
"""Frames of one request: a hundred seconds."""
MAX_REQUEST = 4 << 20
"""Longest request with telemetry [bytes]."""

# one after the other: what is read takes twenty times as much memory as the request
_reading = CapacityLimiter(1)


def _numbers(count: int | None = None) -> dict[str, object]:
    size = {} if count is None else {"minItems": count, "maxItems": count}
    return {"type": "array", "items": {"type": "number"}, **size}


def _texts() -> dict[str, object]:
    return {"type": "array", "items": {"type": "string"}}


def _object(fields: Mapping[str, object], optional: tuple[str, ...] = ()) -> dict[str, object]:
    required = [name for name in fields if name not in optional]
    return {"type": "object", "required": required, "properties": fields, "additionalProperties": False}


_JOINTS = {
    **_object(
        {
            "legs": _texts(),
            "of_leg": {"type": "object", "additionalProperties": _texts()},
            "sliding": _texts(),
        }
    ),
    "description": "names of legs and joints, of a robot that others described alone",
}


_FRAME = _object(
    {
        "type": {"const": "telemetry"},
        "number": {"type": "integer", "minimum": 0},
        "robot": {"type": "string"},
        "time": {"type": "number"},
        "posture": _numbers(),
        "T_site_base": {"type": "array", "items": _numbers(4), "minItems": 4, "maxItems": 4},
        "wheel_forces": {"type": "array", "items": _numbers(3)},
        "joint_torques": _numbers(),
        "mode": {"enum": list(MODES)},
        "commanded": _numbers(),
    }
)
_BODY = _object(
    {
        "protocol": {"const": PROTOCOL},
        "robot": {"type": "string", "minLength": 1, "maxLength": 64},
        "legs": {"type": "integer", "minimum": 1},
        "software": {"type": "string", "minLength": 1, "maxLength": 64},
        "joints": _JOINTS,
        "frames": {"type": "array", "items": _FRAME, "minItems": 1, "maxItems": MOST_FRAMES},
    },
    optional=("joints",),
)


class Taken(TypedDict):
    """taken: how many frames; refused: the others, by their place in the request, and why; link: its counts."""

    taken: int
    refused: list[dict[str, Any]]
    link: LinkAnswer


class ImagesTaken(TypedDict):
    """digest: of the snapshot; left_out: pairs that can't be used, and why."""

    digest: str
    pairs: list[str]
    left_out: dict[str, str]
    link: LinkAnswer


@router.post(
    "/rover/telemetry",
    openapi_extra={"requestBody": {"required": True, "content": {"application/json": {"schema": _BODY}}}},
)
async def take_telemetry(request: Request, sessions: AllSessions) -> Taken:
    """Frames of the rover, in order: the fields of `hello` and `frames`, each a `telemetry` message of the rover link.

    A frame that can't be used is named in `refused`, the others are taken. Where none can be used, the answer is a
    problem. Refused while a rover is linked by WebSocket, also one that is silent: what came beside the link would
    make the rover there look heard.
    """
    came, content = time.monotonic(), await request.body()
    door: RoverDoor = request.app.state.rover_door
    live = await run_in_threadpool(current_session, sessions)
    try:
        return await to_thread.run_sync(partial(_take, door, live, content, came), limiter=_reading)
    except InvalidTelemetry as error:
        _count(door, live, error)
        raise


def _take(door: RoverDoor, live: LiveSession, content: bytes, came: float) -> Taken:
    _require_free(door)
    if len(content) > MAX_REQUEST:
        raise InvalidTelemetry(
            f"a request holds at most {MAX_REQUEST} bytes of telemetry; send fewer frames", fault="too-large"
        )
    body = parse_object(content, most=TELEMETRY_PARTS)
    frames = Fields({"frames": body.pop("frames", None)}, "request").objects("frames")
    if needless := sorted({"id", "epoch"} & body.keys()):
        raise InvalidTelemetry(f"request: unknown fields {', '.join(needless)}", fields=needless)
    hello = message_from({**body, "type": "hello", "id": "request", "epoch": None})
    if not isinstance(hello, HelloMessage):  # its type says so
        raise InvalidTelemetry("the request lacks the fields of hello")
    require_same_rover(hello, live)
    if not 0 < len(frames) <= MOST_FRAMES:
        raise InvalidTelemetry(f"a request holds 1 to {MOST_FRAMES} frames, not {len(frames)}")
    errors = [error for index, frame in enumerate(frames) if (error := _take_one(live, hello, index, frame, came))]
    if len(errors) == len(frames):
        raise errors[0]
    for error in errors:
        _count(door, live, error)
    return {
        "taken": len(frames) - len(errors),
        "refused": [{"detail": error.message, **error.details} for error in errors],
        "link": live.rover.link.as_dict(),
    }


def _take_one(
    live: LiveSession, hello: HelloMessage, index: int, frame: dict[str, object], came: float
) -> InvalidTelemetry | None:
    try:
        message = message_from(frame, hello.legs, hello.described)
        if not isinstance(message, TelemetryFrame):
            raise InvalidTelemetry("frames holds telemetry messages alone", fault="unknown-message")
        live.rover.take_telemetry(message, came, by_request=True)
    except InvalidTelemetry as error:
        error.details["frame"] = index
        return error
    return None


@router.post(
    "/rover/images",
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def take_images(
    request: Request,
    sessions: AllSessions,
    protocol: Annotated[int, Query(description=f"version of the rover link, {PROTOCOL}")],
) -> ImagesTaken:
    """One binary frame of images, as on the rover link. Pairs that can't be used stand in `left_out`."""
    content, client = await request.body(), client_of(request)
    door: RoverDoor = request.app.state.rover_door
    live = await run_in_threadpool(current_session, sessions)

    def take() -> ImagesTaken:
        _require_free(door)
        if protocol != PROTOCOL:
            raise InvalidTelemetry(
                f"the images are of protocol {protocol}, this end speaks {PROTOCOL}",
                expected=PROTOCOL,
                fault="wrong-version",
            )
        with sessions.pixels.of(client) as held:
            _, snapshot = decode_images(content, len(live.layout.legs), held.take, live.named_layout)
            digest = live.rover.take_images(snapshot, held)
        for reason in snapshot.left_out.values():
            door.count("images", reason)
            live.rover.take_complaint(reason, about_rover="images")
        return {
            "digest": digest,
            "pairs": [pair.name for pair in snapshot.pairs],
            "left_out": dict(snapshot.left_out),
            "link": live.rover.link.as_dict(),
        }

    try:
        return await in_turn(take)
    except FootFallError as error:
        if isinstance(error, Busy) or not isinstance(error, Conflict):
            _count(door, live, error)
        raise


def _require_free(door: RoverDoor) -> None:
    if door.inside is not None:
        silent = ", and has been silent lately" if door.inside.silent else ""
        raise Conflict(f"a rover is linked by WebSocket{silent}; its telemetry and images come over that link alone")


def _count(door: RoverDoor, live: LiveSession, error: FootFallError) -> None:
    kind = error.details.setdefault("fault", fault_of(error))
    door.count(kind, error.message)
    live.rover.take_complaint(error.message, about_rover=kind)


class Delays(BaseModel):
    """One-way light times [s]; what is left out stays as it is."""

    model_config = ConfigDict(extra="forbid", strict=True)

    telemetry_s: float | None = Field(None, ge=0, le=LONGEST, description="what the rover says", examples=[1.28])
    commands_s: float | None = Field(None, ge=0, le=LONGEST, description="what it is told, stops included")


@router.get("/rover/light-time")
def read_light_time(sessions: AllSessions) -> LightTimeAnswer:
    """How long messages to and from the rover are on their way."""
    return sessions.light_time.as_dict()


@router.patch("/rover/light-time")
def set_light_time(delays: Delays, sessions: AllSessions, who: Actor) -> LightTimeAnswer:
    """Work with the rover as if it were as far as this (the Moon: 1.28 s). The delay is made by this server.

    For the holder of the conn, whose commands and stops it delays; where nobody holds it, for any commander. Messages
    that are on their way keep their time. The change is an event of every open session.
    """
    if (live := sessions.current) is not None:
        live.commands.require_may_leave(who)
    before = sessions.light_time
    sessions.set_light_time(
        LightTime(
            telemetry=before.telemetry if delays.telemetry_s is None else delays.telemetry_s,
            commands=before.commands if delays.commands_s is None else delays.commands_s,
        )
    )
    return sessions.light_time.as_dict()
