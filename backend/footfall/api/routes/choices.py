"""Points for the wheel, and taking back what was chosen, or making it again, in the order in which it was chosen."""

from typing import TypedDict

from footfall.api.access import OneSession
from footfall.api.bodies.choice_schemas import PointsOrder, UndoOrder
from footfall.api.routing import Routes
from footfall.session.answers.choices import ChoiceAnswer, PointsAnswer
from footfall.session.live import LiveSession
from footfall.session.log.fold_choices import Choice

router = Routes(tags=["choices"])


class Turned(TypedDict):
    """What was taken back or made again, and what would be next."""

    choice: ChoiceAnswer
    undo: ChoiceAnswer | None
    redo: ChoiceAnswer | None


@router.put("/sessions/{session}/points")
def set_points(live: OneSession, order: PointsOrder) -> PointsAnswer:
    """Points that the wheel's centre is to pass when the leg's step is planned; what was set before can be undone."""
    points = [(x, y, z) for x, y, z in order.points]
    live.choices.set_points(live.robot.require_leg(order.leg), points)
    return {"leg": order.leg, "points": [list(point) for point in points]}


@router.post("/sessions/{session}/undo")
def undo(live: OneSession, order: UndoOrder) -> Turned:
    """Take back the latest choice of a footfall, plan or point, or the latest edit of the sequence, whoever made it.

    409 where `choice` names another than the latest.
    """
    return _turned(live, live.choices.undo(order.choice))


@router.post("/sessions/{session}/redo")
def redo(live: OneSession, order: UndoOrder) -> Turned:
    """Make the choice again that was taken back last, unless another came since."""
    return _turned(live, live.choices.redo(order.choice))


def _turned(live: LiveSession, choice: Choice) -> Turned:
    summary = live.choices.undoable
    return {
        "choice": choice.as_dict(),
        "undo": summary["undo"],
        "redo": summary["redo"],
    }
