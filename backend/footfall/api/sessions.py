"""Sessions: list, open a sample or a new one, read what the log folds to, listen."""

from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import Depends, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from footfall.api.access import AllSessions, OneSession, session_path
from footfall.api.routing import Routes
from footfall.api.schemas import NewNote, NewSession, ViewChange
from footfall.api.streams import resume_after, session_stream
from footfall.core.errors import InvalidInput

router = Routes(tags=["sessions"])


@router.get("/sessions")
def list_sessions(sessions: AllSessions) -> dict[str, Any]:
    """Sessions of the working folder, and the samples that can be opened."""
    current = sessions.current
    return {
        "sessions": sessions.list(),
        "samples": sessions.samples(),
        "current": None if current is None else current.id,
    }


@router.post("/sessions", status_code=201)
def open_session(order: NewSession, sessions: AllSessions, response: Response) -> dict[str, Any]:
    """Open a copy of a sample, an older session, or start an empty one. It becomes the current one: it gets the rover.

    Refused while the current session sends commands.
    """
    match order.sample, order.name, order.session:
        case str(sample), None, None:
            live = sessions.open_sample(sample)
        case None, str(name), None:
            live = sessions.create(name)
        case None, None, str(session):
            live = sessions.open(session)
        case _:
            raise InvalidInput("give one of: a sample, the name of a new session, the id of an old session")
    response.headers["Location"] = session_path(live)
    return live.summary()


@router.get("/sessions/{session}")
def read_session(live: OneSession) -> dict[str, Any]:
    """What the session's events fold to, the rover link, the jobs, the command gate."""
    return live.summary()


@router.get("/sessions/{session}/events", response_class=EventSourceResponse)
async def listen(
    live: OneSession,
    request: Request,
    after: Annotated[int | None, Depends(resume_after)],
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events named event, telemetry, view, job, link and session; `id` is the number of an event.

    `session` says that another session holds the rover from now on.
    """
    async for message in session_stream(live, request.app.state.streams, after):
        yield message


@router.get("/sessions/{session}/log")
def read_log(live: OneSession, since: Annotated[int, Query(ge=-1)] = -1) -> dict[str, Any]:
    """The recorded events with a number higher than ``since``."""
    return {"events": [event.as_dict() for event in live.events(since + 1)]}


@router.get("/sessions/{session}/view")
def read_view(live: OneSession) -> Any:
    """What the operator looks at: leg, layer, scrubber, ghost."""
    return live.view


@router.put("/sessions/{session}/view")
def change_view(live: OneSession, change: ViewChange) -> Any:
    """Change some of it; every page of this session follows."""
    live.set_view(**change.model_dump(exclude_unset=True))
    return live.view


@router.get("/sessions/{session}/notes")
def read_notes(live: OneSession) -> dict[str, Any]:
    """Remarks in the order they were written."""
    return {"notes": live.state.notes}


@router.post("/sessions/{session}/notes", status_code=201)
def write_note(live: OneSession, note: NewNote) -> dict[str, Any]:
    """Add a remark to the log."""
    live.add_note(note.text)
    return {"notes": live.state.notes}
