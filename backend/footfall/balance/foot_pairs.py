"""Which two feet a stability margin rests on, as codes of eight bits: 16 · start + end."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

NONE = 255
"""Code of no pair and of no lost leg."""

MOST_FEET = 15
"""More would not fit into a code."""


def feet_of(pairs: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The feet where an edge starts and where it ends, for codes of any shape; 15, which is no foot, for NONE."""
    codes = np.asarray(pairs, np.int64)
    return codes >> 4, codes & 15
