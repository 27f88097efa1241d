"""Which footfalls a foot comes to from which, one foot move after the other.

The chassis stays while a leg swings: a foot goes from one footfall to the next where its leg reaches both from one part
of the guide, so where their spans have a part in common.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from footfall.core.arrays import Array

APART = 0.1
"""Spans of two footfalls may miss each other by so much [m], and a foot still goes from one to the other: the chassis
need not be on the guide. Of eight walks that were found none needed more than 0."""


def joined(xy: Array, low: Array, high: Array, longest: float, apart: float) -> NDArray[np.bool_]:
    """Which places a foot comes to from the first of them, itself included.

    Args:
        xy: places (n, 2) in site [m].
        low: (n,) where along the way the span of each begins [m].
        high: (n,) where it ends [m].
        longest: a foot goes so far at most at a time [m].
        apart: spans of two places miss each other by so much at most [m].

    Returns:
        (n,).
    """
    _, part = connected_components(_moves(xy, low, high, longest, apart), directed=False)
    return part == part[0]


def moves_left(ends: NDArray[np.bool_], xy: Array, low: Array, high: Array, longest: float) -> Array:
    """How many foot moves lead from each place to an end, at least.

    Args:
        ends: (n,) the places where nothing is left to go.
        xy: places (n, 2) in site [m].
        low: (n,) where along the way the span of each begins [m].
        high: (n,) where it ends [m].
        longest: a foot goes so far at most at a time [m].

    Returns:
        (n,); inf where none do.
    """
    if not ends.any():
        return np.full(len(xy), np.inf)
    moves = _moves(xy, low, high, longest, APART)
    return dijkstra(moves, directed=False, indices=np.flatnonzero(ends), unweighted=True, min_only=True)


def _moves(xy: Array, low: Array, high: Array, longest: float, apart: float) -> csr_array:
    """Pairs of places between which a foot goes at once."""
    one, other = KDTree(xy).query_pairs(longest, output_type="ndarray").T
    near = np.maximum(low[one], low[other]) - np.minimum(high[one], high[other]) <= apart
    one, other = one[near], other[near]
    return csr_array((np.ones(len(one)), (one, other)), shape=(len(xy), len(xy)))
