"""The conn: who holds it, taking it, handing it on. One commander holds it; nobody else moves the rover."""

from typing import Annotated, Literal

from fastapi import Path

from footfall.api.access import OneSession
from footfall.api.acting import Actor
from footfall.api.routing import Routes
from footfall.session.answers.commands import ConnAnswer

router = Routes(tags=["conn"])

Act = Annotated[
    Literal["take", "release", "request", "grant", "deny", "heartbeat"],
    Path(
        description="`take`: where nobody holds it; `request`: ask its holder, who may `grant` or `deny`; "
        "unanswered, it is granted after a while; `heartbeat`: the holder keeps it; `release`: give it back"
    ),
]


@router.get("/sessions/{session}/conn", name="read")
def read_conn(live: OneSession) -> ConnAnswer:
    """Who holds the conn, for how long, and who asks for it. `number` counts its holders, also over restarts."""
    return live.commands.conn


@router.post("/sessions/{session}/conn/{act}", name="act")
def act_on_conn(live: OneSession, act: Act, who: Actor) -> ConnAnswer:
    """Take, keep or hand on the conn; who holds it then. Refused where it is another's."""
    return live.commands.conn_act(act, who)
