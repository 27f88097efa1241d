"""Friction cones as pyramids inside them: what satisfies the pyramid satisfies the cone.

The edges of a pyramid with 4, 8 or 16 sides lie on the cone, each a subset of the next. The tangents that turn a
pyramid about its normal depend on the normal alone, so more friction never takes a force away.
"""

import numpy as np
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import SIDES, require_cone
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput


def generators(normals: ArrayLike, friction: float, sides: int = SIDES) -> Array:
    """Edges of friction pyramids: every force inside is a non-negative sum of them.

    The component of every edge along the unit normal is 1, so the sum of the weights is the normal force.

    Args:
        normals: (k, 3) out of the ground, of any length above zero.
        friction: coefficient between feet and ground.
        sides: of each pyramid.

    Returns:
        Edges (k, sides, 3).

    Raises:
        InvalidInput: a normal is zero or not finite, or friction is not above zero.
    """
    unit = _checked(normals, friction, sides)
    out = np.empty((len(unit), sides, 3))
    fill_generators(unit, friction, out)
    return out


def facets(normals: ArrayLike, friction: float, sides: int = SIDES) -> Array:
    """Inward normals of the friction pyramids' faces: a force is inside where facet · f ≥ 0.

    Args:
        normals: (k, 3) out of the ground, of any length above zero.
        friction: coefficient between feet and ground.
        sides: of each pyramid.

    Returns:
        Inward normals (k, sides, 3).

    Raises:
        InvalidInput: a normal is zero or not finite, or friction is not above zero.
    """
    unit = _checked(normals, friction, sides)
    out = np.empty((len(unit), sides, 3))
    fill_facets(unit, friction, out)
    return out


def unit_normals(normals: ArrayLike) -> Array:
    """The normals at length 1, (k, 3). Raises InvalidInput where one is zero or not finite."""
    normal = np.asarray(normals, float)
    if normal.ndim != 2 or normal.shape[1] != 3 or not np.isfinite(normal).all():
        raise InvalidInput("normals need k × 3 finite numbers", shape=list(normal.shape))
    length = np.sqrt((normal * normal).sum(axis=1, keepdims=True))
    if not (length > 1e-9).all():
        raise InvalidInput("a contact normal can't be zero")
    return normal / length


def _checked(normals: ArrayLike, friction: float, sides: int) -> Array:
    unit = unit_normals(normals)
    require_cone(friction, sides)
    return unit


@njit()
def tangents(x, y, z):
    """Two unit vectors across the unit vector (x, y, z) and each other, six numbers.

    The first is across the axis that the normal is least aligned with, so it is well defined. A quarter turn
    of the normal about an axis turns the pyramid along.
    """
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax <= ay and ax <= az:
        ux, uy, uz = 0.0, z, -y
    elif ay <= az:
        ux, uy, uz = -z, 0.0, x
    else:
        ux, uy, uz = y, -x, 0.0
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    return ux, uy, uz, y * uz - z * uy, z * ux - x * uz, x * uy - y * ux


@njit()
def fill_generators(unit, friction, out):
    """The edges of the pyramids about unit normals (k, 3) into out (k, sides, 3)."""
    sides = out.shape[1]
    for foot in range(unit.shape[0]):
        x, y, z = unit[foot, 0], unit[foot, 1], unit[foot, 2]
        ux, uy, uz, vx, vy, vz = tangents(x, y, z)
        for side in range(sides):
            angle = 2 * np.pi / sides * side
            u, v = friction * np.cos(angle), friction * np.sin(angle)
            out[foot, side, 0] = x + u * ux + v * vx
            out[foot, side, 1] = y + u * uy + v * vy
            out[foot, side, 2] = z + u * uz + v * vz


@njit()
def fill_facets(unit, friction, out):
    """The inward face normals of the pyramids about unit normals (k, 3) into out (k, sides, 3)."""
    sides = out.shape[1]
    up = friction * np.cos(np.pi / sides)
    for foot in range(unit.shape[0]):
        x, y, z = unit[foot, 0], unit[foot, 1], unit[foot, 2]
        ux, uy, uz, vx, vy, vz = tangents(x, y, z)
        for side in range(sides):
            angle = 2 * np.pi / sides * (side + 0.5)
            u, v = np.cos(angle), np.sin(angle)
            out[foot, side, 0] = up * x - u * ux - v * vx
            out[foot, side, 1] = up * y - u * uy - v * vy
            out[foot, side, 2] = up * z - u * uz - v * vz
