"""Friction cones as eight-sided pyramids inside them: what satisfies the pyramid satisfies the cone."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput

Array = NDArray[np.float64]

SIDES = 8
"""Eight sides lose about 10 % of the cone's cross-section; the result stays on the safe side."""


def generators(normals: ArrayLike, friction: float) -> Array:
    """Edges of the pyramids, (k, SIDES, 3): every force inside is a non-negative sum of them."""
    normal, tangents = _frames(normals, friction)
    angle = 2 * np.pi / SIDES * np.arange(SIDES)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return normal[:, None] + friction * np.einsum("sa,kac->ksc", around, tangents)


def facets(normals: ArrayLike, friction: float) -> Array:
    """Inward normals of the pyramids' faces, (k, SIDES, 3): a force is inside where facet · f ≥ 0."""
    normal, tangents = _frames(normals, friction)
    angle = 2 * np.pi / SIDES * (np.arange(SIDES) + 0.5)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return friction * np.cos(np.pi / SIDES) * normal[:, None] - np.einsum("sa,kac->ksc", around, tangents)


def _frames(normals: ArrayLike, friction: float) -> tuple[Array, Array]:
    """Unit normals (k, 3) and two unit tangents each (k, 2, 3)."""
    normal = np.asarray(normals, float)
    if normal.ndim != 2 or normal.shape[1] != 3 or not np.isfinite(normal).all():
        raise InvalidInput("normals need k × 3 finite numbers", shape=list(normal.shape))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    if not (length > 1e-9).all():
        raise InvalidInput("a contact normal can't be zero")
    if not 0 < friction < np.inf:
        raise InvalidInput("friction must be above zero", friction=friction)
    normal = normal / length
    # the axis least aligned with the normal gives a well-defined tangent
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return normal, np.stack([first, np.cross(normal, first)], axis=1)
