"""Recordings: whole sessions as zip files, out and in; and what the rover said in a session, as MCAP files."""

from contextlib import suppress
from io import BytesIO
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import Any, BinaryIO, NotRequired, TypedDict, cast

from fastapi import Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse

from footfall.api.access import BASE, AllSessions, FileName, OneSession, SessionId, session_path
from footfall.api.bodies.answers import Url
from footfall.api.bodies.paging import Cursor, Limit, page
from footfall.api.door.in_turn import in_turn
from footfall.api.door.limits import PAGE_ITEMS
from footfall.api.door.multipart import form_of, is_multipart, upload_of
from footfall.api.routing import BINARY, Routes, files
from footfall.core.errors import InvalidInput
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.recovery import recover
from footfall.io.ros2_messages import NS
from footfall.session.answers.sessions import SessionAnswer, SessionListed
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.session.rover.recorder import recording_name

router = Routes(tags=["recordings"])
MCAP = "application/octet-stream"
SPOOLED = 1 << 20
"""Of a larger bundle only what is being received is in memory, the rest on the disk, until it is its turn [bytes]."""


class RecordedListed(SessionListed):
    """A session, and where its zip is."""

    url: Url


class RecordedList(TypedDict):
    """Newest first. next: path of the next page; null where this is the last."""

    next: Url | None
    recordings: list[RecordedListed]


class TelemetryFile(TypedDict):
    """One MCAP file; what it holds is told once it is finished.

    frames: of telemetry; gaps: missing between them, by their numbers; restarts: how often counting began anew;
    dropped: what could not be written in time.
    """

    name: str
    finished: bool
    url: Url
    bytes: NotRequired[int]
    problem: NotRequired[str]
    start: NotRequired[float]
    duration_s: NotRequired[float]
    messages: NotRequired[int]
    frames: NotRequired[int]
    gaps: NotRequired[int]
    restarts: NotRequired[int]
    dropped: NotRequired[int]


class TelemetryFiles(TypedDict):
    """Oldest first; dropped: messages that could not be written in time. next: path of the next page, or null."""

    next: Url | None
    recordings: list[TelemetryFile]
    dropped: int


@router.get("/recordings")
def list_recordings(
    sessions: AllSessions, request: Request, limit: Limit = PAGE_ITEMS, cursor: Cursor = None
) -> RecordedList:
    """Every session of the working folder with the address of its zip."""
    found, following = page(sessions.list(), lambda one: one["id"], limit, cursor, request)
    recordings: list[RecordedListed] = [{**one, "url": f"{BASE}/recordings/{one['id']}.zip"} for one in found]
    return {"recordings": recordings, "next": following}


@router.get("/recordings/{session}.zip", response_class=Response, responses=files("application/zip"))
def download(session: SessionId, sessions: AllSessions) -> Response:
    """One session as a zip; `footfall replay` recomputes it."""
    live = sessions.look(session)
    content = sessions.export_bundle(live.id)
    headers = {"Content-Disposition": f'attachment; filename="{live.id}.zip"'}
    return Response(content, media_type="application/zip", headers=headers)


@router.post(
    "/recordings",
    status_code=201,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/zip": {"schema": BINARY},
                "multipart/form-data": {
                    "schema": {
                        "type": "object",
                        "required": ["file"],
                        "properties": {"file": BINARY},
                        "additionalProperties": False,
                    }
                },
            },
        }
    },
)
async def upload(request: Request, response: Response, sessions: AllSessions) -> SessionAnswer:
    """Take a session's zip into the working folder and open it. It becomes the current session."""
    if is_multipart(request):
        async with form_of(request, ("file",)) as form:
            live = await in_turn(_take_in, sessions, upload_of(form, "file").file)
    else:
        with SpooledTemporaryFile(SPOOLED) as file:
            async for part in request.stream():
                await run_in_threadpool(file.write, part)
            file.seek(0)
            live = await in_turn(_take_in, sessions, cast(BinaryIO, file))
    response.headers["Location"] = session_path(live)
    return await run_in_threadpool(live.summary)


def _take_in(sessions: Sessions, file: BinaryIO) -> LiveSession:
    content = file.read()
    if not content:
        raise InvalidInput("the request is empty; send the zip of a session")
    return sessions.import_bundle(content)


@router.get("/sessions/{session}/recordings")
def list_telemetry(
    live: OneSession, request: Request, limit: Limit = PAGE_ITEMS, cursor: Cursor = None
) -> TelemetryFiles:
    """What the rover said in this session, as MCAP files, oldest first; one that is being written is not finished."""
    found: list[dict[str, Any]] = []
    paths, following = page(live.rover.recorder.paths(), recording_name, limit, cursor, request)
    for path in paths:
        name = recording_name(path)
        about: dict[str, Any] = {"name": name, "finished": path.name == name}
        with suppress(FileNotFoundError):  # it may be finished, or removed as the oldest, at this moment
            about["bytes"] = path.stat().st_size
        if about["finished"]:
            about |= _figures(path)
        found.append({**about, "url": session_path(live, "recordings", name)})
    return {"recordings": cast(list[TelemetryFile], found), "next": following, "dropped": live.rover.recorder.dropped}


def _figures(path: Path) -> dict[str, Any]:
    try:
        read = Recording(path)
    except InvalidInput as error:
        return {"problem": error.message}
    return {"start": read.start / NS, "duration_s": read.duration, "messages": read.messages, **read.counts}


@router.get("/sessions/{session}/recordings/{name}", response_class=Response, responses=files(MCAP))
def download_telemetry(live: OneSession, name: FileName) -> Response:
    """One of them, for Foxglove, ROS 2 tools and `footfall play`; of one that is being written what is whole."""
    path = live.rover.recorder.path(name)
    if path.name != name:
        out = BytesIO()
        with suppress(FileNotFoundError):
            with path.open("rb") as file:
                recover(file, out)
            headers = {"Content-Disposition": f'attachment; filename="{name}"'}
            return Response(out.getvalue(), media_type=MCAP, headers=headers)
        path = live.rover.recorder.path(name)  # it was finished at this moment
    return FileResponse(path, media_type=MCAP, filename=name)
