"""The browser keeps seven digits of a point: drawings far from the origin are sent about a middle of their own."""

import numpy as np

from footfall.core.arrays import Array

HERE = (0.0, 0.0, 0.0)
"""Position of points that are in the frame of what carries them, as a rover's are in that of its base."""


def near(points: Array) -> tuple[Array, tuple[float, float, float]]:
    """Points (…, 3) about their middle, and that middle: the position of what is drawn, kept in sixteen digits."""
    flat = points.reshape(-1, 3)
    known = flat[np.isfinite(flat).all(axis=1)]
    if not len(known):
        return points, (0.0, 0.0, 0.0)
    middle = 0.5 * (known.min(axis=0) + known.max(axis=0))
    return points - middle, (float(middle[0]), float(middle[1]), float(middle[2]))
