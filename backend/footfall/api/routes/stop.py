"""Stop: its own path to the rover, never behind a job, a queue of requests or an Idempotency-Key."""

import contextlib
from typing import Any, cast

from anyio import CapacityLimiter, to_thread
from fastapi import Request, WebSocket, WebSocketDisconnect
from pydantic import ValidationError

from footfall.api.access import AllSessions, current_session
from footfall.api.acting import Actor
from footfall.api.auth.who import identity_of
from footfall.api.bodies.answers import GateAnswer
from footfall.api.bodies.jsonable import jsonable
from footfall.api.bodies.schemas import StopOrder
from footfall.api.routing import Routes
from footfall.core.errors import FootFallError
from footfall.session.access.identity import Identity
from footfall.session.registry import Sessions

router = Routes(tags=["stop"])

# Threads of its own: the shared pool may be full of slow requests.
_threads = CapacityLimiter(4)


# any body stops: the schema says what is understood, and refuses nothing
_UNDERSTOOD = {"anyOf": [StopOrder.model_json_schema(), {}], "description": "what is not understood is passed over"}
_BODY = {"requestBody": {"content": {"application/json": {"schema": _UNDERSTOOD}}}}


@router.post("/stop", openapi_extra=_BODY)
async def stop(sessions: AllSessions, request: Request) -> GateAnswer:
    """Stop the rover of the current session now. Latched until cleared; repeating it does no harm.

    A body that makes no sense is passed over: no mistake in the reason keeps a rover going.
    """
    return cast(GateAnswer, await _stopped(sessions, await request.body(), identity_of(request)))


@router.websocket("/stop/line")
async def stop_line(socket: WebSocket) -> None:
    """Every message is a stop order, and is answered with the gate, or with a ``fault``.

    A browser opens few requests to one server at a time; a stop must not wait behind those that hang.
    """
    await socket.accept()
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            order = await socket.receive_text()
            try:
                answer = await _stopped(socket.app.state.sessions, order, identity_of(socket))
            except FootFallError as err:
                answer = {"fault": err.message}
            await socket.send_json(jsonable(answer))


async def _stopped(sessions: Sessions, order: str | bytes, who: Identity) -> dict[str, Any]:
    live = current_session(sessions)
    try:
        reason = StopOrder.model_validate_json(order or "{}").reason
    except ValidationError:
        reason = ""
    return await to_thread.run_sync(live.stop, reason, who, limiter=_threads)


@router.post("/stop/clear")
def clear(sessions: AllSessions, who: Actor) -> GateAnswer:
    """Allow commands again. For the holder of the conn; where nobody holds it, for any commander."""
    live = current_session(sessions)
    live.clear_stop(who)
    return cast(GateAnswer, live.gate)


@router.get("/stop")
def read_stop(sessions: AllSessions) -> GateAnswer:
    """Whether stop is latched and acknowledged, and what the command gate is doing."""
    return cast(GateAnswer, current_session(sessions).gate)
