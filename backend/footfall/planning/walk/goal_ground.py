"""Whether the ground at a goal is known: else no walk and no gait can end there, whatever is between."""

import numpy as np

from footfall.core.beside import roughly
from footfall.planning.answers import No, Status
from footfall.planning.walk.problem import WalkGoal
from footfall.terrain.dem import Dem
from footfall.terrain.extent import outside, spans
from footfall.terrain.ground.surface import height_at


def goal_ground_refused(dem: Dem, goal: WalkGoal) -> No | None:
    """Why nothing can end at a goal: it is off the map, or the ground there is unknown.

    Args:
        dem: the ground, in site.
        goal: where the chassis is to be.

    Returns:
        The refusal; None where the ground is known.
    """
    x, y = goal.x, goal.y
    off = outside(dem.geometry, x, y)
    if not off <= 0:
        reason = f"the goal ({x:g}, {y:g}) lies {roughly(off)} m off the map"
        return No(Status.OFF_MAP, f"{reason}; {spans(dem.geometry)}; choose one inside")
    if not np.isfinite(height_at(dem, x, y)):
        return No(
            Status.UNKNOWN_GROUND,
            f"the ground at the goal ({x:g}, {y:g}) is unknown; take images that show it, or choose another goal",
        )
    return None
