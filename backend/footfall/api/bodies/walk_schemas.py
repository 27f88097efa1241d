"""What requests for walks may contain; as strict as those of ``schemas``."""

from footfall.api.bodies.schemas import Number, _examples
from footfall.api.bodies.settings_models import Strictly, settings_model
from footfall.planning.walk.problem import WalkGoal, WalkSettings

WalkSettingsModel = settings_model(WalkSettings)


class WalkGoalModel(settings_model(WalkGoal)):  # type: ignore[misc]
    """Where the chassis is to be: x, y [m] and yaw [rad] in site; yaw null: whichever way it faces.

    within: how far its origin may be from there, seen from above [m]. turned: how far its heading may be off [rad].
    """

    x: Number
    y: Number
    yaw: Number | None = None


class WalkOrder(Strictly):
    """Walk to a goal from the state that is planned from."""

    model_config = _examples(
        {"goal": {"x": 2.5, "y": 1.0}},
        {
            "goal": {"x": 2.5, "y": 1.0, "yaw": 0.3},
            "settings": {"seed": 1, "forbidden": [{"x": 1.2, "y": 0.4, "radius": 0.3}]},
        },
    )
    goal: WalkGoalModel
    settings: WalkSettingsModel | None = None  # type: ignore[valid-type]
