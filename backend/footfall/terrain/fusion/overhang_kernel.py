"""Compiled: of what one view sees in a cell, what lies under another surface that it sees there too."""

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit

LEAST_SUPPORT = 4
"""So many of the eight cells around must be as high, or the upper surface is taken for a mistake."""


@njit(nogil=True)
def lies_under(
    cell: NDArray[np.int64], height: NDArray[np.float64], rows: int, cols: int, gate: float
) -> NDArray[np.bool_]:
    """Which samples (n,) of one view lie under its highest one in their cell by more than ``gate`` [m].

    Seen from above a surface covers each cell once; twice where it folds: an overhang, and the ground below it. A leg
    comes from above. Only a surface that goes on in the cells around, within twice the gate, counts as one.
    """
    top = np.full(rows * cols, -np.inf)
    for i in range(len(cell)):
        top[cell[i]] = max(top[cell[i]], height[i])
    under = np.zeros(len(cell), np.bool_)
    for i in range(len(cell)):
        highest = top[cell[i]]
        if highest - height[i] <= gate:
            continue
        row, col = cell[i] // cols, cell[i] % cols
        support = 0
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(col - 1, 0), min(col + 2, cols)):
                if abs(top[r * cols + c] - highest) <= 2 * gate:
                    support += 1
        under[i] = support > LEAST_SUPPORT
    return under
