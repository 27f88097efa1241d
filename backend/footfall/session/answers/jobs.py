"""What is told of long work."""

from typing import Annotated, Any, Literal, TypedDict

from annotated_types import Ge, Le

from footfall.session.answers.notes import DigestText, Says

JobState = Literal["queued", "running", "done", "failed", "cancelled"]
Share = Annotated[float, Ge(0), Le(1)]


class JobFault(TypedDict):
    """Why a job has no result; as a problem document would say it."""

    kind: str
    message: str
    details: dict[str, Any]


class JobInSummary(TypedDict):
    """Long work: how far it is, and how it ended; `GET jobs/{id}` has its addresses."""

    id: str
    session: str
    kind: str
    state: JobState
    fraction: Share
    text: Annotated[str, Says("what is being done, or why it ended")]
    result: DigestText | None
    error: JobFault | None
    ended: Annotated[float | None, Says("when it ended [s since 1970]; null before")]
