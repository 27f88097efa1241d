"""How much is known around each cell."""

import cv2
import numpy as np
from numpy.typing import NDArray


def count_known_around(known: NDArray[np.bool_], side: int) -> NDArray[np.float32]:
    """How many of the side × side cells about each, (rows, cols), are known; beyond the edge none is."""
    counted = cv2.boxFilter(known.astype(np.float32), -1, (side, side), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(counted, np.float32)
