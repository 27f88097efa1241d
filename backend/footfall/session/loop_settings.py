"""How a walk in a closed loop looks, plans and decides."""

from dataclasses import dataclass, field

from footfall.planning.choice.onward import PLANNER
from footfall.planning.choice.policy import GaitPolicy
from footfall.planning.route.problem import RouteSettings
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk_execution.decision import WayOnSettings
from footfall.terrain.terrain_settings import TerrainSettings


@dataclass(frozen=True)
class LoopSettings:
    """way_on: what is decided by. walk: how walks are planned; one planned anew has the next seed, and where ground is
    lacking that of three which leads farthest.

    terrain: how maps are made of images. pairs: cameras that are asked for images; None: all. farthest: how far ahead a
    walk is planned at once [m]; after each one that was not found it is half as far, or where that came in its time.
    route: how the route is planned that it follows, anew before each walk; None: it goes straight on. choose_by: one of
    CHOOSERS, by which each piece is gone; policy: the table that it is chosen by, for TABLE alone.
    """

    way_on: WayOnSettings = field(default_factory=WayOnSettings)
    walk: WalkSettings = field(default_factory=WalkSettings)
    terrain: TerrainSettings = field(default_factory=lambda: TerrainSettings(keep=True))
    pairs: tuple[str, ...] | None = None
    farthest: float = 3.0
    route: RouteSettings | None = None
    choose_by: str = PLANNER
    policy: GaitPolicy | None = None
