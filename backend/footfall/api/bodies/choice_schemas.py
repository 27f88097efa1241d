"""What requests about choices and about what is in hand may contain."""

from typing import Annotated, Literal

from annotated_types import Len
from pydantic import Field

from footfall.api.bodies.schemas import Leg, Number, Vector3, _examples
from footfall.api.bodies.settings_models import FromNumber, Strictly
from footfall.planning.step.problem import MOST_THROUGH


class PointsOrder(Strictly):
    """Points that the wheel's centre of a leg is to pass, in their order, site frame [m]; none takes them away."""

    model_config = _examples({"leg": 2, "points": [[1.5, 2.6, 0.9]]})
    leg: Leg
    points: Annotated[list[Vector3], Len(0, MOST_THROUGH)]


class UndoOrder(Strictly):
    """Which choice is meant, by the number of its event; null: the latest, whichever it is."""

    model_config = _examples({"choice": 17}, {})
    choice: Annotated[int, Field(ge=0, le=2**53), FromNumber] | None = None


class HandOrder(Strictly):
    """Take the footfall, a point or the chassis in hand, and move it.

    place: x, y of a footfall; x, y, z of a point; dx, dy, dz, droll, dpitch, dyaw of the chassis, counted from how the
    rover stands [m, rad]; null: where it is. index: of the point.
    """

    model_config = _examples({"what": "footfall", "place": [1.6, 2.9]}, {"what": "point", "index": 0})
    what: Literal["footfall", "point", "chassis"]
    index: Annotated[int, Field(ge=0, lt=MOST_THROUGH), FromNumber] = 0
    place: Annotated[list[Number], Len(2, 6)] | None = None
