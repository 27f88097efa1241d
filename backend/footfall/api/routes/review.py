"""Looking back at sessions: checked by replay, compared, taken away as a page that plays alone."""

from typing import Annotated, Any, TypedDict

from fastapi import Depends, Request, Response

from footfall.api.access import AllSessions, OneSession, SessionId
from footfall.api.bodies.answers import JobAnswer
from footfall.api.bodies.jsonable import jsonable
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes, files
from footfall.io.session_page import encode
from footfall.session.replay.checks import ReplayChecks
from footfall.session.replay.side_by_side import SideBySide, side_by_side

router = Routes(tags=["recordings"])


class CheckedProduct(TypedDict):
    """One product of a checked session, recomputed."""

    seq: int
    kind: str
    recorded: str
    recomputed: str | None
    verdict: str
    difference: str | None
    magnitude: float | None
    text: str


class CheckAnswer(TypedDict):
    """ok: every product came out as recorded, and nothing is damaged."""

    name: str
    ok: bool
    events: int
    products: list[CheckedProduct]
    problems: list[str]


def _checks(request: Request) -> ReplayChecks:
    return request.app.state.checks


AllChecks = Annotated[ReplayChecks, Depends(_checks)]


@router.post("/recordings/{session}/check", status_code=202)
def check(session: SessionId, checks: AllChecks, response: Response) -> JobAnswer:
    """Recompute everything that a session has recorded until now, as a job."""
    return accepted(checks.start(session), response)


@router.get("/recordings/{session}/check")
def read_check(session: SessionId, checks: AllChecks) -> CheckAnswer:
    """What the latest check that ended has found."""
    report: Any = checks.report(session)
    return report


@router.get("/recordings/{session}.html", response_class=Response, responses=files("text/html"))
def download_page(session: SessionId, sessions: AllSessions) -> Response:
    """One session as a page that plays without a server."""
    # the numeric libraries load when a page is first asked for
    from footfall.session.replay.page_story import page_story

    live = sessions.look(session)
    content = encode(jsonable(page_story(live.events(), live.typed, live.robot)))
    headers = {"Content-Disposition": f'attachment; filename="{live.id}.html"'}
    return Response(content, media_type="text/html", headers=headers)


@router.get("/sessions/{session}/comparison/{other}")
def compare(live: OneSession, other: SessionId, sessions: AllSessions) -> SideBySide:
    """What two sessions have in common and where they differ, in the order of the work."""
    return side_by_side(live, sessions.look(other))
