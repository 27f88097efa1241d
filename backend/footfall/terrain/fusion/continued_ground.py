"""Ground that goes on: doubtful heights that stay between those of the sure ground around them.

What is left of a leg stands out from the ground that it is seen before, and so does what was matched wrongly. A height
that is neither above nor below all sure ones near by starts nothing new, whatever it is of: it may be taken. A rock
that doubtful pixels alone show stays unknown.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.terrain.fusion.count_known import count_known_around

REACH = 0.1
"""So far along rows and columns sure ground counts [m]."""

SHARE = 0.08
"""Of the square of that reach so much must be known."""

ROUNDS = 2
"""What was taken counts as sure once more: it widened no span of heights."""


def continued_ground(
    heights: NDArray[np.float32], doubtful: NDArray[np.float32], resolution: float
) -> NDArray[np.bool_]:
    """Cells without a height where a doubtful one goes on with the heights around.

    Args:
        heights: (rows, cols) [m], NaN where unknown.
        doubtful: (rows, cols) [m], NaN where unknown.
        resolution: side of the cells [m].

    Returns:
        (rows, cols).
    """
    side = 2 * max(1, round(REACH / resolution)) + 1
    taken = np.zeros(heights.shape, bool)
    for _ in range(ROUNDS):
        around = np.where(taken, doubtful, heights)
        known = np.isfinite(around)
        highest, lowest = _highest(around, side), -_highest(-around, side)
        with np.errstate(invalid="ignore"):
            taken |= (
                ~known
                & (count_known_around(known, side) >= SHARE * side**2)
                & (doubtful >= lowest)
                & (doubtful <= highest)
            )
    return taken


def _highest(heights: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Of the known heights in the square around each cell; -inf where there is none."""
    known = np.where(np.isnan(heights), np.float32(-np.inf), heights)
    # replicated: a border of OpenCV's default is the lowest finite number, which would count as known
    return np.asarray(cv2.dilate(known, np.ones((side, side), np.uint8), borderType=cv2.BORDER_REPLICATE), np.float32)
