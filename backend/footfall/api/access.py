"""How routes reach what they serve: the sessions, one session, a product of it, its addresses."""

from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Request

from footfall.core.errors import Conflict, NotFound
from footfall.core.value import Value
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions

BASE = "/api/v1"
MAX_BODY = 64 * 2**20
"""Largest request [bytes]: a terrain file, a pair of photographs, a recording."""

_V = TypeVar("_V", bound=Value)

PROBLEM: dict[int | str, dict[str, Any]] = {
    "4XX": {
        "description": "A problem document (RFC 9457); `type` names the kind of problem.",
        "content": {
            "application/problem+json": {
                "schema": {
                    "type": "object",
                    "required": ["type", "title", "status", "detail"],
                    "properties": {
                        "type": {"type": "string"},
                        "title": {"type": "string"},
                        "status": {"type": "integer"},
                        "detail": {"type": "string"},
                    },
                },
                "example": {
                    "type": "/problems/invalid-input",
                    "title": "The request can't be used",
                    "status": 422,
                    "detail": "planner is one of auto, line, fast, astar, sbl, rrtconnect",
                    "planner": "rrt",
                },
            }
        },
    }
}


def all_sessions(request: Request) -> Sessions:
    """The registry that the composition root put into the app."""
    return request.app.state.sessions


def one_session(request: Request, session: Annotated[str, Path(description="session id, or `current`")]) -> LiveSession:
    """The session that the path names; opened when it was not."""
    return all_sessions(request).get(session)


AllSessions = Annotated[Sessions, Depends(all_sessions)]
OneSession = Annotated[LiveSession, Depends(one_session)]


def current_session(sessions: Sessions) -> LiveSession:
    """The session that holds the rover."""
    live = sessions.current
    if live is None:
        raise Conflict("no session is open; open one with POST /api/v1/sessions")
    return live


def product(live: LiveSession, digest: str, kind: type[_V], current: str | None = None) -> _V:
    """The value called ``digest`` (or ``current``) of a session, refused when it is of another kind."""
    if digest == "current":
        if current is None:
            raise NotFound(f"the session has no {kind.__name__} yet")
        digest = current
    found = live.get(digest)
    if not isinstance(found, kind):
        raise NotFound(f"{digest} is a {type(found).__name__}, not a {kind.__name__}")
    return found


def session_path(live: LiveSession, *rest: str) -> str:
    """Address of something in a session."""
    return "/".join([f"{BASE}/sessions/{live.id}", *rest])
