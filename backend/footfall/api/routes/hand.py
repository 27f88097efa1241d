"""What is in hand: moved about with a live read-out, and chosen when it is let go. Moves are not logged."""

from typing import TypedDict

from footfall.api.access import OneSession
from footfall.api.bodies.choice_schemas import HandOrder
from footfall.api.routing import Routes
from footfall.session.answers.choices import HeldAnswer

router = Routes(tags=["hand"])


class HandAnswer(TypedDict):
    """null: nothing is in hand."""

    hand: HeldAnswer | None


@router.get("/sessions/{session}/hand")
def read_hand(live: OneSession) -> HandAnswer:
    """What is in hand, by whom, and what is told of the place where it is."""
    return {"hand": live.hand.as_dict()}


@router.put("/sessions/{session}/hand")
def hold(live: OneSession, order: HandOrder) -> HandAnswer:
    """Take something in hand and move it. The answer tells the place; every listener hears it as `hand`."""
    place = None if order.place is None else tuple(order.place)
    return {"hand": live.hand.hold(order.what, place, order.index)}


@router.post("/sessions/{session}/hand/commit")
def commit(live: OneSession) -> HandAnswer:
    """Choose what is in hand where it is now: one event, which can be undone; a shifted chassis becomes a what-if.

    422 says which leg can't follow the chassis; it is then back where it was.
    """
    return {"hand": live.hand.commit()}


@router.delete("/sessions/{session}/hand")
def put_down(live: OneSession) -> HandAnswer:
    """Put it down: what was moved and not committed is where it was."""
    live.hand.put_down()
    return {"hand": None}
