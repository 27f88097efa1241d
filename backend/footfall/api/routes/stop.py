"""Stop: its own path to the rover, never behind a job, a queue of requests or an Idempotency-Key."""

import asyncio
import contextlib

from anyio import CapacityLimiter, to_thread
from fastapi import Request, WebSocket, WebSocketDisconnect
from pydantic import ValidationError

from footfall.api.access import AllSessions, current_session
from footfall.api.acting import Actor
from footfall.api.auth.who import PAGE_HEADER, identity_of, paged
from footfall.api.bodies.jsonable import jsonable
from footfall.api.bodies.schemas import StopOrder
from footfall.api.door.limits import MAX_LINE_MESSAGE, TOO_BIG
from footfall.api.routing import Routes
from footfall.core.errors import FootFallError
from footfall.session.access.identity import Identity
from footfall.session.answers.commands import GateAnswer
from footfall.session.registry import Sessions

router = Routes(tags=["stop"])

# Threads of its own: the shared pool may be full of slow requests.
_threads = CapacityLimiter(4)

PATIENCE = 0.2
"""A stop waits so long for the rest of the body that tells its reason, then it goes without [s]."""


# any body stops: the schema says what is understood, and refuses nothing
_UNDERSTOOD = {"anyOf": [StopOrder.model_json_schema(), {}], "description": "what is not understood is passed over"}
_BODY = {"requestBody": {"content": {"application/json": {"schema": _UNDERSTOOD}}}}


@router.post("/stop", openapi_extra=_BODY)
async def stop(sessions: AllSessions, request: Request) -> GateAnswer:
    """Stop the rover of the current session now. Latched until cleared; repeating it does no harm.

    A body that makes no sense, is too large, or does not come is passed over: no mistake in the reason keeps a rover
    going.
    """
    who = paged(identity_of(request), request.headers.get(PAGE_HEADER, ""))
    return await _stopped(sessions, await _at_hand(request), who)


async def _at_hand(request: Request) -> bytes:
    body = b""
    try:
        async with asyncio.timeout(PATIENCE):
            async for part in request.stream():
                body += part
                if len(body) > MAX_LINE_MESSAGE:
                    return b""
    except Exception:  # whatever it is, the stop does not wait for it
        return b""
    return body


@router.websocket("/stop/line")
async def stop_line(socket: WebSocket) -> None:
    """Every message, text or binary, is a stop order, and is answered with the gate, or with a ``fault`` of a ``kind``.

    One that is too large stops as well, and ends the line. A browser opens few requests to one server at a time; a stop
    must not wait behind those that hang.
    """
    await socket.accept()
    sessions, who = socket.app.state.sessions, identity_of(socket)
    with contextlib.suppress(WebSocketDisconnect):
        while (message := await socket.receive())["type"] != "websocket.disconnect":
            order = message.get("text") or message.get("bytes") or ""
            try:
                answer = await _stopped(sessions, order, who)
            except FootFallError as err:
                answer = {"fault": err.message, "kind": err.kind}
            await socket.send_json(jsonable(answer))
            if len(order) > MAX_LINE_MESSAGE:
                await socket.close(TOO_BIG, f"a stop order has at most {MAX_LINE_MESSAGE} bytes")
                return
        if message.get("code") == TOO_BIG:
            # the server did not read it to its end
            with contextlib.suppress(FootFallError):
                await _stopped(sessions, "", who)


async def _stopped(sessions: Sessions, order: str | bytes, who: Identity) -> GateAnswer:
    try:
        asked = StopOrder.model_validate_json(order if 0 < len(order) <= MAX_LINE_MESSAGE else "{}")
    except ValidationError:
        asked = StopOrder()
    # a browser's WebSocket takes no headers: its page says in the order which it is
    who = paged(who, asked.page) if asked.page else who
    return await to_thread.run_sync(sessions.stop, asked.reason, who, limiter=_threads)


@router.post("/stop/clear")
def clear(sessions: AllSessions, who: Actor) -> GateAnswer:
    """Allow commands again. For the holder of the conn; where nobody holds it, for any commander."""
    live = current_session(sessions)
    live.commands.clear_stop(who)
    return live.commands.gate


@router.get("/stop")
def read_stop(sessions: AllSessions) -> GateAnswer:
    """Whether stop is latched and acknowledged, and what the command gate is doing."""
    return current_session(sessions).commands.gate
