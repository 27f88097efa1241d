"""Corners of a grid of cells: what is known of each, and what it costs over the edges around it.

Source: D. Ferguson & A. Stentz, "Field D*: an interpolation-based path planner and replanner" (ISRR 2005).

A cell costs so much for each length of an edge. Lengths are counted in edges, rows go north, columns east. Corner
(r, c) is the south-west one of cell (r, c), so one record tells of both; the records of a grid are flat. They have a
border, cells that are blocked and corners that are never reached, so that nothing asks where the grid ends.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Ints

Records = Any
"""An array of CORNER or of WAITING, whose fields numpy's types do not know."""

NONE = -1
CORNER = np.dtype(
    [
        ("cell", np.float64),
        ("g", np.float64),
        ("rhs", np.float64),
        ("way", np.int32),
        ("place", np.int32),
        ("after", np.int32),
        ("before", np.int32),
    ]
)
"""cell: cost of the cell. g: what the corner costs, rhs: what it would by its neighbours; way: the pair of neighbours
that rhs comes from. place: where it waits in the queue; after, before: corners of its list (see spread_kernel)."""

LEAST_RISE = math.sqrt(0.5)
"""Of the least cost: a corner that is reached over an edge costs at least so much more than either end of it
(√(c² − f²) with f = c / √2 at the most, see edge_cost, c a cell's cost)."""

BESIDE, INSIDE, ACROSS, STRAIGHT, DIAGONAL, NORTH, EAST = 0, 1, 2, 3, 4, 5, 6
"""Rows of the steps."""


def steps_of(cols: int) -> Ints:
    """(7, 8) steps in flat records of ``cols`` columns, for neighbours k counter-clockwise from the east.

    BESIDE: to neighbour k. Of pair k, neighbours k and k + 1: INSIDE: to the cell between them; ACROSS: to the cell on
    the other side of the edge to the one that is straight ahead; STRAIGHT, DIAGONAL: to the two. NORTH, EAST: rows and
    columns to neighbour k.
    """
    row = np.array([[0, 1, 1, 1, 0, -1, -1, -1], [0, 0, 0, 0, -1, -1, -1, -1], [-1, 0, 0, -1, 0, -1, -1, 0]])
    col = np.array([[1, 1, 0, -1, -1, -1, 0, 1], [0, 0, -1, -1, -1, -1, 0, 0], [0, -1, 0, -1, -1, 0, -1, 0]])
    beside, inside, across = row * cols + col
    straight, diagonal = beside[[0, 2, 2, 4, 4, 6, 6, 0]], beside[[1, 1, 3, 3, 5, 5, 7, 7]]
    return np.ascontiguousarray([beside, inside, across, straight, diagonal, row[0], col[0]], np.int64)


def unknown_corners(cells: NDArray[np.float64]) -> Records:
    """Records of corners of which nothing is known yet; cells: costs with their border."""
    corners = np.zeros(cells.size, CORNER)
    corners["cell"] = cells.ravel()
    corners["g"] = corners["rhs"] = math.inf
    corners["way"] = corners["place"] = NONE
    return corners


@njit()
def edge_cost(inside: float, beside: float, straight: float, diagonal: float) -> float:
    """Least cost from a corner over the edge between two neighbours: ComputeCost of the paper (its Figure 6).

    inside: cost of the cell between; beside: of that on the other side of the edge to the neighbour straight ahead.
    straight, diagonal: what the neighbours cost; between them it changes evenly.
    """
    along = min(inside, beside)
    if along == math.inf or (straight == math.inf and diagonal == math.inf):
        return math.inf
    if straight <= diagonal or inside == math.inf:
        return along + straight
    gain = straight - diagonal
    bound = min(gain, beside)
    if inside <= bound:
        return inside * math.sqrt(2.0) + diagonal
    share = min(bound / math.sqrt(inside * inside - bound * bound), 1.0)
    return inside * math.sqrt(1.0 + share * share) + bound * (1.0 - share) + diagonal


@njit()
def over(corners: Records, steps: Ints, corner: int, pair: int) -> float:
    """What a corner costs when it is left over the edge of a pair of neighbours."""
    return edge_cost(
        corners[corner + steps[INSIDE, pair]].cell,
        corners[corner + steps[ACROSS, pair]].cell,
        corners[corner + steps[STRAIGHT, pair]].g,
        corners[corner + steps[DIAGONAL, pair]].g,
    )
