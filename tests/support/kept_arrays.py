"""Arrays as the product passes them to compiled code, which is compiled once more for any other kind of array."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def read_only(array: ArrayLike) -> NDArray[Any]:
    """A copy in one piece that nobody may write, as values have theirs."""
    kept = np.array(array, order="C")
    kept.setflags(write=False)
    return kept
