"""Which forces the ground puts on the wheels of a rover that stands still.

Static equilibrium of k contacts leaves 3k − 6 numbers open. The forces of least squared sum are
chosen, or those that differ least from given ones, within unilateral contact and friction: a least
distance problem, solved exactly as a non-negative least squares problem.

References:
----------
C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23 (LDP).
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.cones import facets
from footfall.balance.friction import FRICTION
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput

RESIDUAL = 1e-6
"""Largest force and moment left over, as a share of weight and of weight × size of the stance."""


def equilibrium_matrix(contacts: ArrayLike, com: ArrayLike) -> Array:
    """(6, 3k) map from contact forces, one after the other, to force [N] and moment about com [N·m]."""
    arm = np.asarray(contacts, float) - np.asarray(com, float)
    k = len(arm)
    matrix = np.zeros((6, k, 3))
    matrix[:3] = np.eye(3)[:, None, :]
    x, y, z = arm.T
    zero = np.zeros(k)
    matrix[3:] = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(0, 2, 1)
    return matrix.reshape(6, 3 * k)


def distribute(
    contacts: ArrayLike,
    normals: ArrayLike,
    com: ArrayLike,
    mass: float,
    gravity: float = GRAVITY,
    friction: float = FRICTION,
    near: ArrayLike | None = None,
) -> Array | None:
    """Contact forces of least norm that hold the rover.

    Each force lies in the friction pyramid of its contact.

    Args:
        contacts: (k, 3) [m], as all else in a frame with z up.
        normals: (k, 3), out of the ground.
        com: centre of mass (3,) [m].
        mass: of the rover [kg].
        gravity: [m/s²].
        friction: coefficient between feet and ground.
        near: (k, 3) [N]; with it those forces are taken that differ least from them; None: those of least norm.

    Returns:
        Forces of the ground on the feet, (k, 3) [N], or None where no forces hold it.

    Raises:
        InvalidInput: shapes don't fit, or numbers are not finite or not positive.
    """
    points, center = require_masses(contacts, com, mass, gravity)
    faces = facets(normals, friction)
    if len(faces) != len(points):
        raise InvalidInput("each contact needs one normal", contacts=len(points), normals=len(faces))
    if len(points) == 0:
        return None
    # unit weight and unit size, so that force and moment compare
    size = max(float(np.abs(points - center).max()), 1e-6)
    balance = equilibrium_matrix((points - center) / size, np.zeros(3))
    wanted = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    base = np.zeros(balance.shape[1]) if near is None else _given(near, len(points)).ravel() / (mass * gravity)
    left, strength, right = np.linalg.svd(balance)
    rank = int((strength > 1e-10 * strength[0]).sum())
    lacking = wanted - balance @ base
    least = base + right[:rank].T @ ((left.T[:rank] @ lacking) / strength[:rank])
    inside = np.zeros((faces.size // 3, balance.shape[1]))
    for foot, rows in enumerate(faces):
        inside[len(rows) * foot : len(rows) * (foot + 1), 3 * foot : 3 * foot + 3] = rows
    free = right[rank:].T
    shift = _least_distance(inside @ free, -inside @ least)
    if shift is None:
        return None
    force = least + free @ shift
    if np.abs(balance @ force - wanted).max() > RESIDUAL or (inside @ force).min() < -RESIDUAL:
        return None
    return mass * gravity * force.reshape(-1, 3)


def _given(forces: ArrayLike, contacts: int) -> Array:
    given = np.asarray(forces, float)
    if given.shape != (contacts, 3) or not np.isfinite(given).all():
        raise InvalidInput(
            "the forces to stay near to need three finite numbers a contact [N]", shape=list(given.shape)
        )
    return given


def _least_distance(rows: Array, bounds: Array) -> Array | None:
    """Shortest x with rows · x ≥ bounds, or None where there is none (Lawson & Hanson, problem LDP)."""
    if (bounds <= 0).all():
        return np.zeros(rows.shape[1])
    stacked = np.vstack([rows.T, bounds])
    target = np.zeros(len(stacked))
    target[-1] = 1.0
    dual, _ = nnls(stacked, target, maxiter=100 * stacked.shape[1])
    residual = stacked @ dual - target
    if np.linalg.norm(residual) < 1e-9:
        return None
    return -residual[:-1] / residual[-1]


def require_masses(contacts: ArrayLike, com: ArrayLike, mass: float, gravity: float) -> tuple[Array, Array]:
    """Refuse contacts, centre of mass, mass or gravity that can't be.

    Args:
        contacts: (k, 3) [m].
        com: centre of mass (3,) [m].
        mass: of the rover [kg].
        gravity: [m/s²].

    Returns:
        Contacts (k, 3) and centre of mass (3,) as arrays.

    Raises:
        InvalidInput: they have other shapes or are not finite, or mass or gravity is not above zero.
    """
    points, center = np.asarray(contacts, float), np.asarray(com, float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InvalidInput("contacts need k × 3 finite numbers [m]", shape=list(points.shape))
    if center.shape != (3,) or not np.isfinite(center).all():
        raise InvalidInput("the centre of mass needs three finite numbers [m]")
    if not (0 < mass < np.inf and 0 < gravity < np.inf):
        raise InvalidInput("mass [kg] and gravity [m/s²] must be above zero", mass=mass, gravity=gravity)
    return points, center
