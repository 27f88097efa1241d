"""What each route needs, in two tables, and the refusal of who has less: what makes products is in footfall.api.kinds.

Reading (GET) is for viewers unless a table says otherwise; everything else has to stand in one. A route that does not
is an admin's, and a test names it.
"""

from collections.abc import Mapping
from enum import Enum

from fastapi import WebSocketException
from starlette.requests import HTTPConnection

from footfall.api.access import BASE
from footfall.api.auth.who import IDENTITY, PAGE_HEADER, ROVER, paged
from footfall.api.door.problems import Problem
from footfall.api.kinds import SERVED, role_for
from footfall.session.access.acting import set_actor
from footfall.session.access.identity import LOCAL, Identity, Role


class Needs(Enum):
    """What else than a role may be needed."""

    NOTHING = "nothing"
    ROVER_TOKEN = "a rover's token"


_TABLE: Mapping[Role | Needs, tuple[str, ...]] = {
    # whoever watches the server's health has no account
    Needs.NOTHING: (
        *("POST /login", "GET /login/ways", "GET /login/oidc", "GET /login/oidc/back"),
        *("GET /health/live", "GET /health/ready"),
    ),
    Needs.ROVER_TOKEN: ("WS /rover", "POST /rover/telemetry", "POST /rover/images"),
    Role.VIEWER: (
        "POST /logout",
        # whoever sees that the rover has to stop may stop it
        "POST /stop",
        "WS /stop/line",
        "WS /sessions/{session}/events/line",
        "WS /scene",
        "WS /scene/",
        "PUT /scene/size",
        "PUT /scene/theme",
        "PUT /scene/moment",
        # questions, which change nothing
        "POST /sessions/{session}/pick",
        "POST /sessions/{session}/suggestions",
    ),
    Role.PLANNER: (
        "PUT /sessions/{session}/view",
        "PATCH /sessions/{session}",
        "POST /sessions/{session}/notes",
        "POST /sessions/{session}/telemetry",
        "POST /sessions/{session}/state",
        "POST /sessions/{session}/images",
        "POST /sessions/{session}/images/upload",
        "POST /sessions/{session}/terrains/scans",
        "POST /sessions/{session}/terrains/undo",
        "POST /sessions/{session}/footfalls",
        "PUT /sessions/{session}/points",
        "POST /sessions/{session}/undo",
        "POST /sessions/{session}/redo",
        "PUT /sessions/{session}/hand",
        "POST /sessions/{session}/hand/commit",
        "DELETE /sessions/{session}/hand",
        "PUT /sessions/{session}/plans/current",
        "PUT /sessions/{session}/queues/current",
        "POST /sessions/{session}/plans/{digest}/alternatives",
        "DELETE /sessions/{session}/what-if",
        "POST /sessions/{session}/sag/take-over",
        "POST /sessions/{session}/walks/{digest}/again",
        "POST /sequences/{sequence}/undo",
        "POST /sequences/{sequence}/redo",
        "GET /sequences/{sequence}/export",
        "POST /recordings/{session}/check",
        "DELETE /jobs/{job}",
    ),
    Role.COMMANDER: (
        # the session that is opened takes the rover with it
        "POST /sessions",
        "POST /sequences/{sequence}/arm",
        "POST /sequences/{sequence}/send",
        "POST /sessions/{session}/conn/{act}",
        "POST /sessions/{session}/run/{act}",
        "POST /sessions/{session}/walk-loop",
        "POST /sessions/{session}/walk-loop/{act}",
        "POST /stop/clear",
        "PATCH /rover/light-time",
    ),
    Role.ADMIN: (
        "POST /recordings",
        "GET /accounts",
        "GET /audit",
    ),
}
_NEEDS = {route: needs for needs, routes in _TABLE.items() for route in routes}


def declared() -> frozenset[str]:
    """Every route of both tables, as ``METHOD /path`` below the root of the interface."""
    return frozenset(_NEEDS) | {one.route for one in SERVED.values()}


def needed(method: str, path: str) -> Role | Needs | None:
    """What a route needs; None where nobody has declared it. method: ``WS`` for WebSockets."""
    reading = Role.VIEWER if method in ("GET", "HEAD") else None
    route = f"{'GET' if method == 'HEAD' else method} {path}"
    return _NEEDS.get(route) or role_for(route) or reading


def allows(needs: Role | Needs, identity: Identity | None, rover: str | None) -> bool:
    """Whether somebody may do what needs this."""
    if needs is Needs.NOTHING:
        return True
    if identity is None:
        return needs is Needs.ROVER_TOKEN and rover is not None
    if isinstance(needs, Role):
        return identity.role >= needs
    return identity.name == LOCAL.name  # no account can have this name


async def authorise(connection: HTTPConnection) -> None:
    """Dependency of every router. Raises Problem (403), or closes a WebSocket, where the role does not suffice.

    A coroutine, because a function would wait for a thread of the pool that all requests share: stop must not.
    """
    scope = connection.scope
    method = scope["method"] if scope["type"] == "http" else "WS"
    needs = needed(method, scope["route"].path.removeprefix(BASE)) or Role.ADMIN
    identity: Identity | None = scope[IDENTITY]
    if allows(needs, identity, scope[ROVER]):
        if scope["type"] == "http" and isinstance(needs, Role) and identity is not None:
            set_actor(paged(identity, connection.headers.get(PAGE_HEADER, "")))
        return
    text = f"this needs {needs.value if isinstance(needs, Needs) else f'the role {needs.value}'}; " + (
        "a rover's token opens the rover link alone"
        if identity is None
        else f"{identity.name} is {identity.role.value}"
    )
    if scope["type"] == "websocket":
        raise WebSocketException(1008, text)
    raise Problem("forbidden", 403, text, needs=needs.value)
