"""The whole REST interface as one FastAPI app; the composition root adds the page and the scene."""

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI

from footfall.api import (
    footfalls,
    images,
    info,
    jobs,
    maps,
    photographs,
    plans,
    recordings,
    robot,
    rover,
    sequences,
    sessions,
    stances,
    stop,
    telemetry,
    terrains,
)
from footfall.api.access import BASE, MAX_BODY, PROBLEM
from footfall.api.guard import Guard
from footfall.api.idempotency import Idempotency
from footfall.api.problems import add_problem_responses
from footfall.api.streams import Streams
from footfall.core.value import SOFTWARE_VERSION
from footfall.session.registry import Sessions

_DESCRIPTION = f"""A ground tool for walking rovers.

SI units and radians; frames `site` (x east, y north, z up) and `base` (x forward, y left, z up); legs count
from 0; unknown is `null`. Errors are problem documents (RFC 9457) with a stable `type`. A POST with an
`Idempotency-Key` runs once, however often it is sent. Requests hold at most {MAX_BODY // 2**20} MiB.
"""


def assemble(sessions_: Sessions, parts: Callable[[], dict[str, Any]] = dict) -> FastAPI:
    """App with every route under ``/api/v1``.

    parts: further members of ``GET info``, for what the caller adds to the app.
    """
    app = FastAPI(
        title="FootFall",
        version=SOFTWARE_VERSION,
        description=_DESCRIPTION,
        openapi_url=f"{BASE}/openapi.json",
        docs_url=None,
        redoc_url=None,
    )
    app.state.sessions = sessions_
    app.state.streams = Streams()
    app.state.rover_door = rover.RoverDoor()
    app.state.parts = lambda: {**parts(), "rover_link": app.state.rover_door.as_dict()}
    # the one added last runs first
    app.add_middleware(Idempotency)
    app.add_middleware(Guard, max_body=MAX_BODY)
    add_problem_responses(app)
    for module in (
        info,
        robot,
        sessions,
        telemetry,
        images,
        terrains,
        photographs,
        maps,
        footfalls,
        stances,
        plans,
        sequences,
        stop,
        jobs,
        recordings,
    ):
        app.include_router(module.router, prefix=BASE, responses=PROBLEM)
    app.include_router(rover.router, prefix=BASE)
    return app
