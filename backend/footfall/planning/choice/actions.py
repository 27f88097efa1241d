"""What may be chosen: one iteration of a gait, or of the walk planner, straight to the goal or aside.

To choose another gait than the current one is to change: the foot moves with which its feet settle belong to its first
iteration, with the time that they take.
"""

import math
from collections.abc import Mapping

from footfall.planning.gait.problem import GAITS, RIPPLE, TRIPOD, WAVE

WALK = "walk"
WAYS = (WAVE, RIPPLE, TRIPOD, WALK)
"""How an iteration is gone, wherever to."""
TRIPOD_ASIDE, WALK_ASIDE = "tripod aside", "walk aside"
ASIDE: Mapping[str, str] = {TRIPOD_ASIDE: TRIPOD, WALK_ASIDE: WALK}
"""Actions that go to the side whose ground is better, and in which of WAYS."""
OFFSET = math.radians(30.0)
"""By how much those turn away from the goal [rad]."""
ACTIONS = (*WAYS, *ASIDE)
"""In the order in which tables have them. Where two are worth the same, the earlier is chosen."""
ACTION_TEXTS: Mapping[str, str] = {
    **GAITS,
    WALK: "footfalls and chassis poses are searched",
    **{action: f"{way}, 30° from the goal to the side whose ground is better" for action, way in ASIDE.items()},
}
"""In words."""


def way_of_going(action: str) -> str:
    """One of WAYS: how an action is gone."""
    return ASIDE.get(action, action)
