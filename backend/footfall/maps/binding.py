"""Which feet a stability margin rests on, as codes of map layers: the layers "binding" and "binding_lost"."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.balance.foot_pairs import NONE, feet_of

NOTHING = 0
"""No margin, or nothing that binds it."""
LEGS = 15
"""Base of the codes: more legs than a stance has feet."""


def binding_feet(pairs: NDArray[np.uint8], legs: Sequence[int]) -> NDArray[np.uint8]:
    """Codes 1 + LEGS · a + b of the binding edge's legs a < b, for pairs of rows (balance.foot_pairs) of ``legs``."""
    start, end = feet_of(pairs)
    numbers = np.append(np.asarray(legs, np.int64), np.zeros(16 - len(legs), np.int64))
    low, high = np.minimum(numbers[start], numbers[end]), np.maximum(numbers[start], numbers[end])
    return np.where(np.asarray(pairs) == NONE, NOTHING, 1 + LEGS * low + high).astype(np.uint8)


def binding_loss(lost: NDArray[np.uint8], legs: Sequence[int]) -> NDArray[np.uint8]:
    """Codes 1 + leg of the leg whose loss binds, for rows of ``legs``."""
    numbers = np.append(np.asarray(legs, np.int64), np.zeros(256 - len(legs), np.int64))
    return np.where(np.asarray(lost) == NONE, NOTHING, 1 + numbers[lost]).astype(np.uint8)


def binding_text(layer: str, code: int) -> str:
    """What a code of "binding" or "binding_lost" means."""
    if code == NOTHING:
        return "nothing"
    if layer == "binding_lost":
        return f"the loss of leg {code - 1}"
    low, high = divmod(code - 1, LEGS)
    return f"the edge between legs {low} and {high}"
