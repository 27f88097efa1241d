"""The simplest planner: the straight line in joint space."""

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.step.search.edges import Space


def line(space: Space, start: Array, goal: Array) -> Array | None:
    """Waypoints of the straight joint-space edge.

    Args:
        space: what is free.
        start: (d,), free.
        goal: (d,), free.

    Returns:
        (2, d) where the edge is free, else None.
    """
    return np.array([start, goal]) if space.edge_is_free(start, goal) else None
