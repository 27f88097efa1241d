"""The whole REST interface as one FastAPI app; the composition root adds the page and the scene."""

from collections.abc import Callable
from typing import Any

from fastapi import Depends, FastAPI

from footfall.api.access import BASE
from footfall.api.auth.identify import Identify
from footfall.api.auth.oidc import SignOn
from footfall.api.auth.roles import authorise
from footfall.api.door.front import LOOPBACK, Front
from footfall.api.door.guard import Guard
from footfall.api.door.holding import Holding
from footfall.api.door.idempotency import Idempotency
from footfall.api.door.limits import LIMITS, Limits
from footfall.api.door.observe import Observe
from footfall.api.door.pace import Pace
from footfall.api.door.problems import add_problem_responses
from footfall.api.door.unchanged import Unchanged
from footfall.api.openapi import describe, operation_id
from footfall.api.routes import (
    accounts,
    choices,
    conn,
    executions,
    footfalls,
    hand,
    health,
    image_overlays,
    image_views,
    images,
    info,
    ingest,
    jobs,
    maps,
    metrics,
    photographs,
    plans,
    products,
    queues,
    recordings,
    review,
    robot,
    rover,
    runs,
    scans,
    sequences,
    sessions,
    sign_on,
    stances,
    steadiness,
    stop,
    telemetry,
    terrains,
    walk_loops,
    walks,
)
from footfall.api.streams import Streams
from footfall.core.value import SOFTWARE_VERSION
from footfall.session.access.accounts import Accounts
from footfall.session.products.image_views import ImageViews
from footfall.session.registry import Sessions
from footfall.session.replay.checks import ReplayChecks

_DESCRIPTION = """A ground tool for walking rovers.

SI units and radians; frames `site` (x east, y north, z up) and `base` (x forward, y left, z up); legs count
from 0; unknown is `null`. Errors are problem documents (RFC 9457) with a stable `type`. A POST with an
`Idempotency-Key` runs once, however often it is sent. `GET info` lists the limits.
"""


def assemble(
    sessions_: Sessions,
    parts: Callable[[], dict[str, Any]] = dict,
    accounts_: Accounts | None = None,
    front: Front = LOOPBACK,
    limits: Limits = LIMITS,
    sign_on_: SignOn | None = None,
) -> FastAPI:
    """App with every route under ``/api/v1``.

    parts: further members of ``GET info``, for what the caller adds to the app.
    accounts_: who may come in; None: everybody who reaches the server may do everything. front: how it is reached.
    limits: how much one request may hold, and how often one client may ask.
    sign_on_: the provider of an organisation's accounts; None: local accounts only.
    """
    app = FastAPI(
        title="FootFall",
        version=SOFTWARE_VERSION,
        description=_DESCRIPTION,
        openapi_url=f"{BASE}/openapi.json",
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=operation_id,
    )
    app.state.sessions = sessions_
    app.state.accounts = accounts_
    app.state.front = front
    app.state.sign_on = sign_on_
    app.state.limits = limits
    app.state.streams = Streams()
    app.state.checks = ReplayChecks(sessions_)
    app.state.image_views = ImageViews(sessions_)
    app.state.rover_door = rover.RoverDoor()
    app.state.parts = lambda: {**parts(), "rover_link": app.state.rover_door.as_dict()}
    app.state.metrics = metrics.Metrics(sessions_, app.state.streams, app.state.rover_door)
    # the one added last runs first
    app.add_middleware(Unchanged)
    app.add_middleware(Idempotency)
    app.add_middleware(Identify, accounts=accounts_, front=front)
    app.add_middleware(Pace, limits=limits)
    app.add_middleware(Holding, max_body=limits.request_bytes)
    app.add_middleware(Guard, max_body=limits.request_bytes, front=front)
    app.add_middleware(Observe, metrics=app.state.metrics)
    add_problem_responses(app)
    for module in (
        info,
        accounts,
        sign_on,
        robot,
        sessions,
        telemetry,
        ingest,
        # before the images: a picture's name would pass for that of a side
        image_views,
        image_overlays,
        images,
        terrains,
        photographs,
        scans,
        maps,
        footfalls,
        stances,
        products,
        steadiness,
        plans,
        queues,
        choices,
        hand,
        executions,
        sequences,
        walks,
        walk_loops,
        conn,
        runs,
        stop,
        jobs,
        recordings,
        review,
    ):
        app.include_router(module.router, prefix=BASE, dependencies=[Depends(authorise)])
    app.include_router(rover.router, prefix=BASE, dependencies=[Depends(authorise)])
    for module in (health, metrics):
        app.include_router(module.router, dependencies=[Depends(authorise)])
    describe(app)
    return app
