"""What requests for steps and walks of robots that others described may contain."""

from typing import Annotated

from annotated_types import Len
from pydantic import Field

from footfall.api.bodies.schemas import Name, Number, _examples
from footfall.api.bodies.settings_models import FromNumber, Strictly, settings_model
from footfall.api.bodies.walk_schemas import WalkGoalModel
from footfall.planning.legged.problem import LeggedSettings

LeggedSettingsModel = settings_model(LeggedSettings)


class DescribedStepOrder(Strictly):
    """Let one leg of a robot that others described step to a target, x and y [m] in site; null: the chosen footfall."""

    model_config = _examples({"leg": 1, "target": [0.35, 0.2]})
    leg: Annotated[int, Field(ge=0, le=63), FromNumber]
    target: Annotated[list[Number], Len(2, 2)] | None = None
    settings: LeggedSettingsModel | None = None  # type: ignore[valid-type]


class DescribedWalkOrder(Strictly):
    """Walk a robot that others described to a goal, from the state that is planned from.

    route: digest of one to that goal, along which it goes; without, it goes straight.
    """

    model_config = _examples({"goal": {"x": 0.5, "y": 0.0}})
    goal: WalkGoalModel
    settings: LeggedSettingsModel | None = None  # type: ignore[valid-type]
    route: Name | None = None
