"""What requests for routes may contain; as strict as those of ``schemas``."""

from footfall.api.bodies.schemas import Number, _examples
from footfall.api.bodies.settings_models import Strictly, settings_model
from footfall.planning.route.problem import RouteSettings

RouteSettingsModel = settings_model(RouteSettings)


class RouteGoalModel(Strictly):
    """Where the middle of the chassis is to be, x and y [m] in site."""

    x: Number
    y: Number


class RouteOrder(Strictly):
    """The cheapest way of the chassis to a goal from the state that is planned from."""

    model_config = _examples(
        {"goal": {"x": 2.5, "y": 1.0}},
        {"goal": {"x": 2.5, "y": 1.0}, "settings": {"worst": 0.3, "no_go": [{"x": 1.2, "y": 0.4, "radius": 0.3}]}},
    )
    goal: RouteGoalModel
    settings: RouteSettingsModel | None = None  # type: ignore[valid-type]
