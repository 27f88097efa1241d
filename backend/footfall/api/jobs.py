"""Jobs: progress of long work, and the wish to stop it."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import Depends, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from footfall.api.access import BASE, AllSessions
from footfall.api.jsonable import dumps
from footfall.api.routing import Routes
from footfall.session.fold import TERRAIN_KINDS
from footfall.session.job import Job

router = Routes(tags=["jobs"])

LOOK_PERIOD = 0.1
"""How often a job's progress is looked at for a listener [s]."""

_FOLDERS = {
    **dict.fromkeys(TERRAIN_KINDS, "terrains"),
    "maps": "maps",
    "plan": "plans",
    "shift": "shifts",
    "body_move": "body-moves",
}


def job_body(job: Job) -> dict[str, Any]:
    """A job as JSON, with the address of its result when there is one."""
    body = dict(job.as_dict())
    folder = _FOLDERS.get(body["kind"])
    done = body["result"] is not None and folder is not None and body.get("session")
    body["url"] = f"{BASE}/jobs/{body['id']}"
    body["result_url"] = f"{BASE}/sessions/{body['session']}/{folder}/{body['result']}" if done else None
    return body


def accepted(job: Job, response: Response) -> dict[str, Any]:
    """202 with the job's address."""
    response.status_code = 202
    response.headers["Location"] = f"{BASE}/jobs/{job.id}"
    return job_body(job)


def _one_job(job: str, sessions: AllSessions) -> Job:
    return sessions.jobs.get(job)


OneJob = Annotated[Job, Depends(_one_job)]


@router.get("/jobs/{job}")
def read_job(job: OneJob) -> dict[str, Any]:
    """State, progress 0…1, what is being done, and in the end the result's digest or the error."""
    return job_body(job)


@router.get("/jobs/{job}/events", response_class=EventSourceResponse)
async def watch_job(job: OneJob, request: Request) -> AsyncIterator[ServerSentEvent]:
    """Progress as server-sent events named ``job``; the stream ends with the job."""
    last = None
    while not request.app.state.streams.closed:
        body = job_body(job)
        if body != last:
            yield ServerSentEvent(raw_data=dumps(body), event="job")
            last = body
        if body["state"] not in ("queued", "running"):
            return
        await asyncio.sleep(LOOK_PERIOD)


@router.delete("/jobs/{job}", status_code=202)
def cancel_job(job: OneJob) -> dict[str, Any]:
    """Ask the job to stop; it is ended by force after a second."""
    job.cancel()
    return job_body(job)
