"""The simplest planner: the straight line in joint space."""

import numpy as np

from footfall.planning.step.edges import Array, Space


def line(space: Space, start: Array, goal: Array) -> Array | None:
    """Waypoints (2, d) if the straight joint-space edge is free, else None. start and goal must be free."""
    return np.array([start, goal]) if space.edge_is_free(start, goal) else None
