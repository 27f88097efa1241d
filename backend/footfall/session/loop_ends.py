"""What ends a walk in a closed loop, whatever it waits for."""

from footfall.core.errors import Conflict
from footfall.session.gate.lease import CONN_FOR
from footfall.session.parts import SessionParts

NOT_RENEWED = f"the conn ran out, as its holder was not heard for {CONN_FOR:g} s"


def require_there(live: SessionParts) -> None:
    """Raises Conflict where the rover was stopped, reports a fault, or is not connected."""
    if live.state.stop.latched:
        raise Conflict("the rover was stopped")
    if live.rover.frame is not None and live.rover.frame.state.mode == "fault":
        raise Conflict("the rover reports a fault")
    if not live.rover.link.connected:
        raise Conflict("the rover is not connected")


def how_the_conn_went(live: SessionParts) -> str:
    """What became of the conn that a walk had, for a person."""
    if (holder := live.commands.conn["holder"]) is not None:
        return f"the conn changed hands, {holder['name']} holds it"
    changes = (event.payload["act"] for event in reversed(live.events()) if event.type == "conn_changed")
    # where the log does not have it given up its time is over, of which the log is told in a moment
    return "the conn was given up" if next(changes, "") == "released" else NOT_RENEWED
