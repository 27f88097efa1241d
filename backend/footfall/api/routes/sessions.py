"""Sessions: list, open a sample or a new one, read what the log folds to, listen."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from typing import Annotated, TypedDict, cast

from fastapi import Depends, Query, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import ValidationError

from footfall.api.access import AllSessions, OneSession, session_path
from footfall.api.acting import Actor
from footfall.api.auth.who import identity_of, paged
from footfall.api.bodies.answers import Url
from footfall.api.bodies.paging import Cursor, Limit, next_page, page
from footfall.api.bodies.schemas import NewNote, NewSession, SessionRenamed, ViewChange
from footfall.api.bodies.settings_models import Strictly
from footfall.api.door.limits import MAX_LINE_MESSAGE, PAGE_ITEMS, TOO_BIG
from footfall.api.mailbox import Mailbox
from footfall.api.routing import Routes
from footfall.api.streams import (
    RATE,
    Ahead,
    Rate,
    mailbox_of,
    require_open,
    resume_after,
    room_to_listen,
    session_stream,
)
from footfall.core.errors import Busy, FootFallError, InvalidInput
from footfall.session.answers.sessions import EventAnswer, NoteAnswer, SessionAnswer, SessionListed
from footfall.session.live import LiveSession
from footfall.session.view import ViewState

router = Routes(tags=["sessions"])


class SessionList(TypedDict):
    """Newest first. next: path of the next page; null where this is the last."""

    next: Url | None
    sessions: list[SessionListed]
    samples: list[str]
    current: str | None


class EventList(TypedDict):
    """In order. next: path of the next page; null where this is the last."""

    next: Url | None
    events: list[EventAnswer]


class Heard(Strictly):
    """What a listener says on its line: the number of the telemetry that it has now."""

    heard: int


class NoteList(TypedDict):
    """In the order that they were written."""

    notes: list[NoteAnswer]


@router.get("/sessions")
def list_sessions(
    sessions: AllSessions, request: Request, limit: Limit = PAGE_ITEMS, cursor: Cursor = None
) -> SessionList:
    """Sessions of the working folder, and the samples that can be opened."""
    current = sessions.current
    listed, following = page(sessions.list(), lambda one: one["id"], limit, cursor, request)
    return {
        "sessions": listed,
        "next": following,
        "samples": sessions.samples(),
        "current": None if current is None else current.id,
    }


@router.post("/sessions", status_code=201)
def open_session(order: NewSession, sessions: AllSessions, response: Response) -> SessionAnswer:
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
def read_session(live: OneSession) -> SessionAnswer:
    """What the session's events fold to, the rover link, the jobs, the command gate."""
    return live.summary()


@router.patch("/sessions/{session}")
def rename_session(live: OneSession, change: SessionRenamed) -> SessionAnswer:
    """Give a session another name. Its log tells who did; what it recorded stays as it is."""
    live.rename(change.name)
    return live.summary()


@router.get("/sessions/{session}/events", response_class=EventSourceResponse, dependencies=[Depends(room_to_listen)])
async def listen(
    live: OneSession,
    request: Request,
    after: Annotated[int | None, Depends(resume_after)],
    who: Actor,
    rate: Rate = RATE,
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events named event, telemetry, view, job, link and session; `id` is the number of an event.

    `session` says that another session holds the rover from now on.
    """
    async for message in session_stream(live, request.app.state.streams, after, mailbox_of(live, who, rate)):
        yield message


@router.websocket("/sessions/{session}/events/line")
async def listen_on_line(
    socket: WebSocket,
    session: str,
    since: int | None = None,
    rate: Rate = RATE,
    ahead: Ahead = None,
    page: str = "",
) -> None:
    """The same events over a WebSocket, each as ``{"type", "id", "data"}``; since, rate: as for the event stream.
    page: which page or program listens, where a header can't say it.

    With ``ahead`` the listener says ``{"heard": number}`` of each telemetry message, so that what it hears is never
    old: lines hold seconds of telemetry when they are slow. A browser keeps six connections to one server: as many
    pages with event streams would leave none for requests.
    """
    try:
        live = await asyncio.to_thread(socket.app.state.sessions.look, session)
        require_open(live)
    except FootFallError as err:
        await socket.close(1008, err.kind)
        return
    # taken first: a browser tells its page nothing of a line that was refused
    await socket.accept()
    mailbox = mailbox_of(live, paged(identity_of(socket), page), rate, ahead)
    telling = asyncio.create_task(_tell(socket, live, since, mailbox))
    hearing = asyncio.create_task(_hear(socket, mailbox))
    try:
        await asyncio.wait((telling, hearing), return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in (telling, hearing):
            task.cancel()
        ends = await asyncio.gather(telling, hearing, return_exceptions=True)
    full = isinstance(ends[0], Busy)
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):
        await socket.close(1013 if full else 1001, str(ends[0]) if full else "read on from the last event")


async def _tell(socket: WebSocket, live: LiveSession, after: int | None, mailbox: Mailbox) -> None:
    stream = session_stream(live, socket.app.state.streams, after, mailbox)
    async with contextlib.aclosing(stream):
        async for message in stream:
            number = "null" if message.id is None else message.id
            await socket.send_text(f'{{"type":{json.dumps(message.event)},"id":{number},"data":{message.raw_data}}}')


async def _hear(socket: WebSocket, mailbox: Mailbox) -> None:
    """Until the listener has gone, or says what is not for this line."""
    while (message := await socket.receive())["type"] != "websocket.disconnect":
        text = message.get("text")
        if len(text or message.get("bytes") or "") > MAX_LINE_MESSAGE:
            await socket.close(TOO_BIG, f"a message on this line has at most {MAX_LINE_MESSAGE} bytes")
            return
        try:
            mailbox.heard(Heard.model_validate_json(text if isinstance(text, str) else "").heard)
        except ValidationError:
            await socket.close(1008, 'only {"heard": number} is said on this line')
            return


@router.get("/sessions/{session}/log")
def read_log(
    live: OneSession,
    request: Request,
    since: Annotated[int, Query(ge=-1, le=2**53, description="number of the event to go on after")] = -1,
    limit: Limit = PAGE_ITEMS,
) -> EventList:
    """The recorded events with a number higher than ``since``."""
    found = live.events(since + 1)
    events = [cast(EventAnswer, event.as_dict()) for event in found[:limit]]
    more = len(found) > limit
    return {"events": events, "next": next_page(request, limit=limit, since=events[-1]["seq"]) if more else None}


@router.get("/sessions/{session}/view")
def read_view(live: OneSession) -> ViewState:
    """What is looked at on the page that asks: leg, layer, scrubber, ghost; without its name, what was last on any."""
    return live.choices.view


@router.put("/sessions/{session}/view")
def change_view(live: OneSession, change: ViewChange) -> ViewState:
    """Change some of it for the page that asks, and no other; for every page, where none is named."""
    live.choices.set_view(**change.model_dump(exclude_unset=True))
    return live.choices.view


@router.get("/sessions/{session}/notes")
def read_notes(live: OneSession) -> NoteList:
    """Remarks in the order they were written."""
    return _notes(live)


@router.post("/sessions/{session}/notes", status_code=201)
def write_note(live: OneSession, note: NewNote) -> NoteList:
    """Add a remark to the log."""
    live.add_note(note.text)
    return _notes(live)


def _notes(live: LiveSession) -> NoteList:
    return {"notes": [{"time": one.time, "text": one.text} for one in live.state.notes]}
