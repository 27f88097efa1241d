"""Stop: its own path to the rover, never behind a job, a queue of requests or an Idempotency-Key."""

from typing import Any

from anyio import CapacityLimiter, to_thread
from fastapi import Request
from pydantic import ValidationError

from footfall.api.access import AllSessions, current_session
from footfall.api.routing import Routes
from footfall.api.schemas import StopOrder

router = Routes(tags=["stop"])

# Threads of its own: the shared pool may be full of slow requests.
_threads = CapacityLimiter(4)


_BODY = {"requestBody": {"content": {"application/json": {"schema": StopOrder.model_json_schema()}}}}


@router.post("/stop", openapi_extra=_BODY)
async def stop(sessions: AllSessions, request: Request) -> Any:
    """Stop the rover of the current session now. Latched until cleared; repeating it does no harm.

    A body that makes no sense is passed over: no mistake in the reason keeps a rover going.
    """
    live = current_session(sessions)
    try:
        reason = StopOrder.model_validate_json(await request.body() or b"{}").reason
    except ValidationError:
        reason = ""
    await to_thread.run_sync(live.stop, reason, limiter=_threads)
    return live.gate


@router.post("/stop/clear")
def clear(sessions: AllSessions) -> Any:
    """Allow commands again."""
    live = current_session(sessions)
    live.clear_stop()
    return live.gate


@router.get("/stop")
def read_stop(sessions: AllSessions) -> Any:
    """Whether stop is latched and acknowledged, and what the command gate is doing."""
    return current_session(sessions).gate
