"""Recordings: whole sessions as zip files, out and in."""

from typing import Any

from fastapi import Request, Response
from fastapi.concurrency import run_in_threadpool

from footfall.api.access import BASE, AllSessions, session_path
from footfall.api.multipart import file_of, is_multipart
from footfall.api.routing import Routes
from footfall.core.errors import InvalidInput

router = Routes(tags=["recordings"])


@router.get("/recordings")
def list_recordings(sessions: AllSessions) -> dict[str, Any]:
    """Every session of the working folder with the address of its zip."""
    return {"recordings": [{**one, "url": f"{BASE}/recordings/{one['id']}.zip"} for one in sessions.list()]}


@router.get("/recordings/{session}.zip", response_class=Response)
def download(session: str, sessions: AllSessions) -> Response:
    """One session as a zip; `footfall replay` recomputes it."""
    live = sessions.get(session)
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
                "application/zip": {"schema": {"type": "string", "format": "binary"}},
                "multipart/form-data": {
                    "schema": {
                        "type": "object",
                        "required": ["file"],
                        "properties": {"file": {"type": "string", "format": "binary"}},
                    }
                },
            },
        }
    },
)
async def upload(request: Request, response: Response, sessions: AllSessions) -> dict[str, Any]:
    """Take a session's zip into the working folder and open it. It becomes the current session."""
    if is_multipart(request):
        async with request.form(max_files=1, max_fields=0) as form:
            _, content = await file_of(form, "file")
    else:
        content = await request.body()
    if not content:
        raise InvalidInput("the request is empty; send the zip of a session")
    live = await run_in_threadpool(sessions.import_bundle, content)
    response.headers["Location"] = session_path(live)
    return await run_in_threadpool(live.summary)
