"""How routes reach what they serve: the sessions, one session, a product of it, its addresses."""

from typing import Annotated, TypeVar

from fastapi import Depends, Path, Request
from starlette.requests import HTTPConnection

from footfall.core.errors import Conflict, NotFound
from footfall.core.value import Value
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions

BASE = "/api/v1"
STOP = f"{BASE}/stop"
"""Where a stop is asked for: nothing holds it up."""

_READING = ("GET", "HEAD")
_QUESTIONS = ("/pick", "/suggestions")
"""Ends of addresses that are asked with a body, and change nothing."""
_V = TypeVar("_V", bound=Value)


def all_sessions(request: Request) -> Sessions:
    """The registry that the composition root put into the app."""
    return request.app.state.sessions


WORD = r"^[A-Za-z0-9][A-Za-z0-9_-]*$"
_DOTTED = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"

SessionId = Annotated[
    str, Path(description="session id, or `current`", max_length=64, pattern=WORD, examples=["current"])
]
Digest = Annotated[str, Path(description="digest, or `current`", max_length=64, pattern=WORD, examples=["current"])]
FileName = Annotated[str, Path(description="name, as the list has it", max_length=200, pattern=_DOTTED)]
SequenceId = Annotated[
    str,
    Path(
        description="id of a sequence (its newest version), digest of one version, or `current`",
        max_length=100,
        pattern=_DOTTED,
        examples=["current"],
    ),
]


def one_session(request: Request, session: SessionId) -> LiveSession:
    """The session that the path names; opened where the request may change it and it was not."""
    sessions = all_sessions(request)
    asks = request.method in _READING or request.url.path.endswith(_QUESTIONS)
    return sessions.look(session) if asks else sessions.get(session)


async def _all_sessions(request: Request) -> Sessions:
    # a function would wait for a thread of the pool that all requests share: stop must not
    return all_sessions(request)


AllSessions = Annotated[Sessions, Depends(_all_sessions)]
OneSession = Annotated[LiveSession, Depends(one_session)]


def client_of(connection: HTTPConnection) -> str:
    """Address of who asks; behind a proxy that says so, the server has put it here."""
    return connection.client.host if connection.client else ""


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
