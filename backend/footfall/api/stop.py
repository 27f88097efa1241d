"""Stop: its own path to the rover, never behind a job, a queue of requests or an Idempotency-Key."""

from typing import Any

from anyio import CapacityLimiter, to_thread

from footfall.api.access import AllSessions, current_session
from footfall.api.routing import Routes
from footfall.api.schemas import StopOrder

router = Routes(tags=["stop"])

# Threads of its own: the shared pool may be full of slow requests.
_threads = CapacityLimiter(4)


@router.post("/stop")
async def stop(sessions: AllSessions, order: StopOrder | None = None) -> Any:
    """Stop the rover of the current session now. Latched until cleared; repeating it does no harm."""
    live = current_session(sessions)
    await to_thread.run_sync(live.stop, order.reason if order is not None else "", limiter=_threads)
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
