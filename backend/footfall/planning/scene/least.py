"""The least of many exact values that take long to find, of which lower bounds are known.

Of n rows and k columns the lowest bound is replaced by the exact value, and since values of one column differ by no
more than something moved between their rows, that value also bounds the others of its column (Mirtich, "Timewarp rigid
body simulation", 2000, uses the same bound in time). The search ends when the lowest bound is exact.

What is proven to be farther than one exact value can't be the least. It is left out, which changes nothing else.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from footfall.core.arrays import Array

EQUAL = 1e-6
"""Proven bounds and measured distances agree to this [m]."""


def least(
    bounds: Array,
    finer: Array,
    exact: Callable[[int, int], float],
    moved: Callable[[int, int], Array],
    far: float,
) -> tuple[float, int, int]:
    """Least exact value of a table, of which bounds are known; see the module.

    Args:
        bounds: lower bounds, (n, k).
        finer: lower bounds, (n, k), that say more where they do.
        exact: the value of a row and a column.
        moved: of a row and a column, (n,): how far the value may differ in each row.
        far: what is as large as this does not count.

    Returns:
        The value, its row and column; (far, 0, −1) where all are at least far.
    """
    if not finer.size or finer.min() >= far:
        return far, 0, -1
    exact = lru_cache(maxsize=None)(exact)
    first = np.unravel_index(int(np.argmin(finer)), finer.shape)
    left = finer <= min(exact(int(first[0]), int(first[1])), far) + EQUAL
    columns = np.flatnonzero(left.any(axis=0))
    bounds = np.where(left, bounds, np.inf)[:, columns]
    known = np.zeros(bounds.shape, bool)
    while True:
        at, column = (int(i) for i in np.unravel_index(int(np.argmin(bounds)), bounds.shape))
        if bounds[at, column] >= far:
            return far, 0, -1
        which = int(columns[column])
        if known[at, column]:
            return float(bounds[at, column]), at, which
        value = exact(at, which)
        if left[:, which].sum() > 1:
            raised = np.maximum(bounds[:, column], value - moved(at, which))
            bounds[:, column] = np.where(known[:, column], bounds[:, column], raised)
        bounds[at, column] = value
        known[at, column] = True
