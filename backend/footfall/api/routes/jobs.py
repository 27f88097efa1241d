"""Jobs: progress of long work, and the wish to stop it."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, TypedDict

from fastapi import Depends, Path, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from footfall.api.access import BASE, WORD, AllSessions, OneSession
from footfall.api.bodies.answers import JobAnswer, Url
from footfall.api.bodies.jsonable import dumps
from footfall.api.bodies.paging import Cursor, Limit, page
from footfall.api.door.limits import PAGE_ITEMS
from footfall.api.kinds import folder_of
from footfall.api.routing import Routes
from footfall.session.jobs.job import Job

router = Routes(tags=["jobs"])

LOOK_PERIOD = 0.1
"""How often a job's progress is looked at for a listener [s]."""


class JobList(TypedDict):
    """Newest first. next: path of the next page; null where this is the last."""

    next: Url | None
    jobs: list[JobAnswer]


def job_body(job: Job) -> JobAnswer:
    """A job as JSON, with the address of its result when there is one."""
    body = job.as_dict()
    folder, session, result = folder_of(body["kind"]), body["session"], body["result"]
    at_hand = result is not None and folder and session
    result_url = f"{BASE}/sessions/{session}/{folder}/{result}" if at_hand else None
    return {**body, "url": f"{BASE}/jobs/{body['id']}", "result_url": result_url}


def accepted(job: Job, response: Response) -> JobAnswer:
    """202 with the job's address."""
    response.status_code = 202
    response.headers["Location"] = f"{BASE}/jobs/{job.id}"
    return job_body(job)


JobId = Annotated[str, Path(description="id of a job", max_length=64, pattern=WORD)]


def _one_job(job: JobId, sessions: AllSessions) -> Job:
    return sessions.jobs.get(job)


OneJob = Annotated[Job, Depends(_one_job)]


@router.get("/sessions/{session}/jobs")
def list_jobs(live: OneSession, request: Request, limit: Limit = PAGE_ITEMS, cursor: Cursor = None) -> JobList:
    """The session's latest jobs, newest first."""
    found, following = page(live.jobs[::-1], lambda job: job.id, limit, cursor, request)
    return {"jobs": [job_body(job) for job in found], "next": following}


@router.get("/jobs/{job}")
def read_job(job: OneJob) -> JobAnswer:
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
def cancel_job(job: OneJob) -> JobAnswer:
    """Ask the job to stop; it is ended by force after a second."""
    job.cancel()
    return job_body(job)
