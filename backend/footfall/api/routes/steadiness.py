"""How steadily the rover stands: margins of its centre of mass, now and along what is planned."""

from typing import Annotated, TypedDict

import numpy as np
from pydantic import Field

from footfall.api.access import Digest, OneSession
from footfall.api.routing import Routes
from footfall.core.arrays import AnyArray, Array
from footfall.session.answers.notes import DigestText
from footfall.session.core import present
from footfall.session.steadiness import along, judged

router = Routes(tags=["steadiness"])

Margins = Annotated[
    dict[str, float | None],
    Field(description="outline (`plain`, `conservative`, `friction`) → [m], positive inside; null: nothing is held"),
]
Known = Annotated[dict[str, bool], Field(description="outline → whether its margin is known at all")]
Why = Annotated[dict[str, str], Field(description="outline → why there is no margin, or what it rests on")]


class SteadinessAnswer(TypedDict):
    """The rover as it stands. measured: as telemetry has it; else it is the state that is planned from.

    legs: those that bear load; corners: outline → (m, 2), com: (3,), site [m]; friction: coefficient.
    """

    measured: bool
    time: float
    legs: list[int]
    com: Array
    corners: dict[str, Array]
    margins: Margins
    known: Known
    why: Why
    friction: float


class WorstMoment(TypedDict):
    """Where the margin is least; row: of a sequence, or of a plan or walk the waypoint that is gone to, from 0."""

    moment: float
    row: int
    margin: float | None


class CourseAnswer(TypedDict):
    """Margins along a plan, walk or sequence. moments: (n,) 0…1, as the ghost is scrubbed; rows: (n,), as in `worst`.

    least: the margin that the motion was planned to keep [m], to the outline that `conservative` says.
    """

    digest: DigestText
    moments: Array
    rows: AnyArray
    margins: dict[str, Array]
    known: Known
    worst: dict[str, WorstMoment | None]
    why: Why
    friction: float
    least: float
    conservative: bool


@router.get("/sessions/{session}/steadiness")
def stands(live: OneSession) -> SteadinessAnswer:
    """By how much the rover stands: its wheels' polygons, the equilibrium region, and the margins to them."""
    found = judged(live)
    return {
        "measured": found.measured,
        "time": found.time,
        "legs": list(found.support.legs),
        "com": found.com,
        "corners": dict(found.support.corners),
        "margins": {name: number if np.isfinite(number) else None for name, number in found.margins.items()},
        "known": {name: not np.isnan(number) for name, number in found.margins.items()},
        "why": found.support.why,
        "friction": found.friction,
    }


@router.get("/sessions/{session}/steadiness/{digest}")
def moves(live: OneSession, digest: Digest) -> CourseAnswer:
    """Margins all along a plan, walk or sequence, and where each is least; `current` names what the ghost plays."""
    played = present(live.review.played, "there is no plan yet") if digest == "current" else digest
    found = along(live, played)
    course = found.course
    worst: dict[str, WorstMoment | None] = {}
    for name in course.margins:
        at = course.worst(name)
        worst[name] = None
        if at is not None:
            least = float(course.margins[name][at])
            worst[name] = {
                "moment": float(course.moments[at]),
                "row": int(course.rows[at]),
                "margin": least if np.isfinite(least) else None,
            }
    return {
        "digest": played,
        "moments": course.moments,
        "rows": course.rows,
        "margins": dict(course.margins),
        "known": {name: found is not None for name, found in worst.items()},
        "worst": worst,
        "why": dict(course.why),
        "friction": found.friction,
        "least": found.least,
        "conservative": found.conservative,
    }
