"""What requests for walks may contain, and what answers hold; as strict as those of ``schemas``."""

from typing import Annotated, Literal

from annotated_types import Len
from pydantic import Field

from footfall.api.bodies.execution_schemas import ExecutionSettingsModel
from footfall.api.bodies.route_schemas import RouteSettingsModel
from footfall.api.bodies.schemas import Name, Number, TerrainSettingsModel, TetherModel, _examples
from footfall.api.bodies.settings_models import FromNumber, Strictly, settings_model
from footfall.planning.gait.problem import GaitSettings
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk_execution.decision import WayOnSettings

GaitSettingsModel = settings_model(GaitSettings)
WalkSettingsModel = settings_model(WalkSettings)
WayOnSettingsModel = settings_model(WayOnSettings)


class WalkGoalModel(settings_model(WalkGoal)):  # type: ignore[misc]
    """Where the chassis is to be: x, y [m] and yaw [rad] in site; yaw null: whichever way it faces.

    within: how far its origin may be from there, seen from above [m]. turned: how far its heading may be off [rad].
    """

    x: Number
    y: Number
    yaw: Number | None = None


class WalkOrder(Strictly):
    """Walk to a goal from the state that is planned from; tether: that the rover hangs on."""

    model_config = _examples(
        {"goal": {"x": 2.5, "y": 1.0}},
        {
            "goal": {"x": 2.5, "y": 1.0, "yaw": 0.3},
            "settings": {"seed": 1, "forbidden": [{"x": 1.2, "y": 0.4, "radius": 0.3}]},
        },
        {"goal": {"x": 2.5, "y": 1.0}, "tether": {"anchor": [-3.2, 0.0, 4.1], "free_length": 12.0}},
    )
    goal: WalkGoalModel
    settings: WalkSettingsModel | None = None  # type: ignore[valid-type]
    tether: TetherModel | None = None


class GaitOrder(Strictly):
    """Go to a goal in a gait from the state that is planned from."""

    model_config = _examples({"goal": {"x": 1.5, "y": 0.0}, "settings": {"gait": "tripod", "stride": 0.3}})
    goal: WalkGoalModel
    settings: GaitSettingsModel | None = None  # type: ignore[valid-type]


FootMove = Annotated[int, Field(ge=0, le=10**5), FromNumber]


class FootMovesOrder(Strictly):
    """Commands of ``count`` foot moves of a walk, the first of them ``first``, counted from 0.

    The number after the last foot move is the chassis' way to the goal. More than there are: all that are left. They
    are commanded as a step is: with the pose held, or as ``settings`` say (``droop_aware``), where it is known how the
    rover sags; as_commanded: as planned all the same, touch-downs not predicted.
    """

    model_config = _examples({"first": 3}, {"first": 3, "count": 2}, {"first": 3, "settings": {"mode": "droop_aware"}})
    first: FootMove
    count: Annotated[int, Field(ge=1, le=10**5), FromNumber] = 1
    settings: ExecutionSettingsModel | None = None  # type: ignore[valid-type]
    as_commanded: bool = False


class WalkLoopOrder(Strictly):
    """Walk to a goal in a closed loop.

    limits: by which it is decided whether to go on; walk: how walks are planned; terrain: how maps are made of images,
    by default merged into the map there is. pairs: cameras that are asked for images, null: all. farthest: how far
    ahead a walk is planned at once [m]. route: how the route is planned that it follows, anew before each walk, {} for
    what is usual; null: it goes straight on. choose_by: how each piece is gone: `planner`, the walk planner always;
    `gaits`, a wave where all of its checks hold, else the walk planner; `table`, as a learned table has it: the one
    that the server was started with, else ATHLETE's own.
    """

    model_config = _examples(
        {"goal": {"x": 5.0, "y": 1.0}},
        {"goal": {"x": 5.0, "y": 1.0}, "limits": {"look_every": 3}, "choose_by": "gaits"},
    )
    goal: WalkGoalModel
    limits: WayOnSettingsModel | None = None  # type: ignore[valid-type]
    walk: WalkSettingsModel | None = None  # type: ignore[valid-type]
    terrain: TerrainSettingsModel | None = None  # type: ignore[valid-type]
    pairs: Annotated[list[Name], Len(1, 64)] | None = None
    farthest: Annotated[Number, Field(gt=0.0, le=50.0)] = 3.0
    route: RouteSettingsModel | None = None  # type: ignore[valid-type]
    choose_by: Literal["planner", "gaits", "table"] = "planner"
