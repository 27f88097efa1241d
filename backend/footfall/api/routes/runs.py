"""The run: what is being sent to the rover, row by row, and steering it. All of it is for the holder of the conn."""

from typing import Annotated, Any, Literal, TypedDict, cast

from fastapi import Path

from footfall.api.access import OneSession
from footfall.api.acting import Actor
from footfall.api.bodies.answers import DigestText
from footfall.api.bodies.sequence_answers import WheelAnswer
from footfall.api.routing import Routes
from footfall.core.errors import NotFound
from footfall.session.live import LiveSession

router = Routes(tags=["run"])

Act = Annotated[
    Literal["hold", "resume", "next", "abort"],
    Path(
        description="`hold`: nothing goes after the present row; `resume`: the rows that are left go one after "
        "another; `next`: one row goes; `abort`: nothing more goes, the present row is carried out"
    ),
]


class RowAnswer(TypedDict):
    """One row of a run. state: queued, sent (released), received (acknowledged), started, done, refused (failed),
    unknown, or unsent; times: when each of them came [s since 1970].
    """

    row: int
    id: str
    state: str
    reason: str
    times: dict[str, float]


class DifferenceAnswer(TypedDict):
    """One quantity of a run: `touch-down` of a wheel, `load` on it, `drift` or `sink` of the chassis (leg −1).

    difference: of measured and predicted; uncertainty: of the prediction, in 95 of 100 cases; null: not known. verdict:
    `differs` where the difference is larger; `advice` then says what to do.
    """

    quantity: str
    leg: int
    predicted: float | None
    measured: float | None
    difference: float | None
    uncertainty: float | None
    unit: str
    verdict: Literal["as_predicted", "differs", "not_told"]
    text: str
    advice: str


class ComparedAnswer(TypedDict):
    """What came of a run, compared with its prediction. state: `waiting` until the rover is at rest after it, `none`
    where there is nothing to compare, for the `reason` given. verdict: only `as_predicted` is good; rigid: the commands
    predicted no sag.
    """

    state: Literal["none", "waiting", "compared"]
    reason: str
    verdict: Literal["as_predicted", "differs", "not_told"]
    rigid: bool | None
    differences: list[DifferenceAnswer]


class LeastClearancesAnswer(TypedDict):
    """Each wheel that swung in a run where it was measured lowest, by telemetry that came while the run went.

    every_s: telemetry nearer than this to what was looked at before is left out [s, rover clock]. looks: at so many
    frames, with the wheel in the air or not; missed: so many more that there was no time for, or that could not be
    measured. It is kept until the session is closed or the next run begins.
    """

    every_s: float
    looks: int
    missed: int
    wheels: list[WheelAnswer]


class RunAnswer(TypedDict):
    """The latest run. state: going, held, aborting or ended; mode: whole, or steps where it waits after every row."""

    number: int
    sequence: DigestText
    rows: list[RowAnswer]
    mode: str
    by: str
    state: str
    reason: str
    outcome: str
    queued: float
    ended: float | None
    compared: ComparedAnswer
    least_clearances: LeastClearancesAnswer


@router.get("/sessions/{session}/run", name="read")
def read_run(live: OneSession) -> RunAnswer:
    """The latest run, also when it has ended: how far each row came, and when."""
    return _told(live)


@router.post("/sessions/{session}/run/{act}", name="act")
def act_on_run(live: OneSession, act: Act, who: Actor) -> RunAnswer:
    """Steer what is being sent. Before rows go on, the rover is checked as before sending."""
    acts: dict[str, Any] = {
        "hold": live.commands.hold,
        "resume": live.commands.resume,
        "next": live.commands.next_row,
        "abort": live.commands.abort,
    }
    acts[act](who)
    return _told(live)


def _told(live: LiveSession) -> RunAnswer:
    run = live.commands.run
    if run is None:
        raise NotFound("nothing has been sent to the rover yet")
    return cast(RunAnswer, run)
