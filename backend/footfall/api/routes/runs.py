"""The run: what is being sent to the rover, row by row, and steering it. All of it is for the holder of the conn."""

from collections.abc import Callable
from typing import Annotated, Literal

from fastapi import Path

from footfall.api.access import OneSession
from footfall.api.acting import Actor
from footfall.api.routing import Routes
from footfall.core.errors import NotFound
from footfall.session.access.identity import Identity
from footfall.session.answers.commands import RunAnswer
from footfall.session.live import LiveSession

router = Routes(tags=["run"])

Act = Annotated[
    Literal["hold", "resume", "next", "abort"],
    Path(
        description="`hold`: nothing goes after the present row; `resume`: the rows that are left go one after "
        "another; `next`: one row goes; `abort`: nothing more goes, the present row is carried out"
    ),
]


@router.get("/sessions/{session}/run", name="read")
def read_run(live: OneSession) -> RunAnswer:
    """The latest run, also when it has ended: how far each row came, and when."""
    return _answer(live)


@router.post("/sessions/{session}/run/{act}", name="act")
def act_on_run(live: OneSession, act: Act, who: Actor) -> RunAnswer:
    """Steer what is being sent. Before rows go on, the rover is checked as before sending."""
    acts: dict[str, Callable[[Identity], None]] = {
        "hold": live.commands.hold,
        "resume": live.commands.resume,
        "next": live.commands.next_row,
        "abort": live.commands.abort,
    }
    acts[act](who)
    return _answer(live)


def _answer(live: LiveSession) -> RunAnswer:
    run = live.commands.run
    if run is None:
        raise NotFound("nothing has been sent to the rover yet")
    return run
