"""The least energy that tips the rover over, for many places of one foot; see :mod:`footfall.balance.tip_over`."""

import math

import numpy as np
from numba import prange
from numpy.typing import ArrayLike

from footfall.balance.support import MOST_FEET
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput


def tip_energies_for_candidates(
    fixed_contacts: ArrayLike, candidates: ArrayLike, coms: ArrayLike, mass: float, gravity: float
) -> Array:
    """Energies that tip the rover with one foot at each candidate.

    Args:
        fixed_contacts: (k, 3), the feet that stay [m], z against gravity.
        candidates: (n, 3) [m].
        coms: centres of mass, (n, 3) [m].
        mass: of the rover [kg].
        gravity: [m/s²].

    Returns:
        (n,) [J], 0 where the rover tips by itself or has no polygon.

    Raises:
        InvalidInput: numbers are not finite, shapes don't fit, or the feet are too many.
    """
    fixed, moved, centers = (np.ascontiguousarray(one, float) for one in (fixed_contacts, candidates, coms))
    if (
        fixed.ndim != 2
        or fixed.shape[1] != 3
        or moved.ndim != 2
        or moved.shape[1:] != (3,)
        or centers.shape != moved.shape
    ):
        raise InvalidInput("feet, candidates and centres of mass need k × 3, n × 3 and n × 3 numbers [m]")
    if len(fixed) >= MOST_FEET:
        raise InvalidInput(f"a stance has at most {MOST_FEET} feet", feet=len(fixed) + 1)
    if not (np.isfinite(fixed).all() and np.isfinite(moved).all() and np.isfinite(centers).all()):
        raise InvalidInput("feet, candidates and centres of mass must be finite [m]")
    out = np.empty(len(moved))
    _energies(fixed, moved, centers, mass * gravity, out)
    return out


@njit(parallel=True)
def _energies(fixed, moved, centers, weight, out):
    for i in prange(len(moved)):
        row = np.int64(i)
        feet = np.empty((len(fixed) + 1, 3))
        feet[:-1] = fixed
        feet[-1] = moved[row]
        out[row] = weight * _least_rise(feet, centers[row])


@njit()
def _least_rise(feet, com):
    """Least rise of the centre of mass on its way over an edge of the feet's hull [m], 0 outside."""
    least = np.inf
    for a in range(len(feet)):
        for b in range(len(feet)):
            x, y = feet[b, 0] - feet[a, 0], feet[b, 1] - feet[a, 1]
            flat = math.hypot(x, y)
            if a == b or flat < 1e-9:
                continue
            edge, area = True, False
            for c in range(len(feet)):
                inside = (x * (feet[c, 1] - feet[a, 1]) - y * (feet[c, 0] - feet[a, 0])) / flat
                edge &= inside > -1e-9
                area |= inside > 1e-9
            if not edge or not area:
                continue
            if x * (com[1] - feet[a, 1]) - y * (com[0] - feet[a, 0]) <= 0.0:
                return 0.0
            z = feet[b, 2] - feet[a, 2]
            length = math.sqrt(flat * flat + z * z)
            arm = com - feet[a]
            along = (arm[0] * x + arm[1] * y + arm[2] * z) / length
            out_x, out_y, out_z = arm[0] - along * x / length, arm[1] - along * y / length, arm[2] - along * z / length
            radius = math.sqrt(out_x * out_x + out_y * out_y + out_z * out_z)
            # the highest point of the circle about a tilted axis lies radius · cos(tilt) above the axis
            least = min(least, max(radius * flat / length - out_z, 0.0))
    return least if least < np.inf else 0.0
