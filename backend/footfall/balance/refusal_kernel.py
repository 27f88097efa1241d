"""The proof that no contact forces inside friction balance a weight; compiled, for held_kernel.py.

Forces of the ground make a cone of forces and moments on the rover. What balances the weight, b = (0, 0, 1; 0, 0, 0)
about the centre of mass, is approached from inside that cone by non-negative least squares over rays of the friction
cones, of which the one that most lessens what is left is found in closed form. What is left at the end, if anything, is
a motion of the rover along which no force of any cone does work but b does: Farkas' lemma.

The proof is for friction cones, which hold the pyramids. Along the rays of a nearest point the work is zero, not below
it, and rounding would decide: so the point is sought in wider cones, and the motion is tried with some sinking, too,
which helps where a foot stays in place while the rover tips over it.

References:
----------
C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23.
"""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array

_WIDER = 1.03
"""Friction that a proof is sought with over that which it is for."""

_MOST_ROUNDS = 30

_NEAR = 1e-4
"""What may be left of b where it counts as reached."""

_CLEARLY = 1e-9
"""Work of b along a motion, in weights and weights × size of the stance, above which rounding does not make it."""

_SMALLEST_PIVOT = 1e-10
"""Of the rays' products, below which they are as good as dependent; nothing is proven then."""


@njit()
def refused(arms: Array, unit: Array, friction: float) -> bool:
    """Whether it is proven that no forces inside friction cones balance the weight; False is no answer.

    arms (k, 3): contacts from the centre of mass [m]; unit (k, 3): normals; both level, z against gravity.
    """
    feet, size = arms.shape[0], 1e-6
    for foot in range(feet):
        size = max(size, abs(arms[foot, 0]), abs(arms[foot, 1]), abs(arms[foot, 2]))
    rays, shares, trial, products = np.empty((6, 6)), np.zeros(6), np.empty(6), np.empty((6, 6))
    left = np.zeros(6)
    left[2] = 1.0
    count = 0
    for _ in range(_MOST_ROUNDS):
        proven = proven_sinking = left[2] > _CLEARLY
        most, best = 0.0, -1
        for foot in range(feet):
            along, across = _work(arms, unit, foot, size, left, 0.0)[:2]
            proven = proven and along + friction * across <= 0.0
            if along + _WIDER * friction * across > most:
                most, best = along + _WIDER * friction * across, foot
            along, across = _work(arms, unit, foot, size, left, 0.5 * left[2])[:2]
            proven_sinking = proven_sinking and along + friction * across <= 0.0
        if proven or proven_sinking:
            return True
        if best < 0 or count == 6:
            return False
        _add_ray(arms, unit, best, size, _WIDER * friction, left, rays[count])
        shares[count] = 0.0
        count = _nearest(rays, shares, count + 1, trial, products)
        if count == 0:
            return False
        rest = 0.0
        for row in range(6):
            left[row] = 1.0 if row == 2 else 0.0
            for i in range(count):
                left[row] -= shares[i] * rays[i, row]
            rest += left[row] ** 2
        if not rest > _NEAR**2:
            return False
    return False


@njit()
def _work(arms, unit, foot, size, left, sinking):
    """Of a foot's force along a motion (6,) with some sinking: per unit along the normal and across, and where to."""
    x, y, z = arms[foot, 0] / size, arms[foot, 1] / size, arms[foot, 2] / size
    dx = left[0] + left[4] * z - left[5] * y
    dy = left[1] + left[5] * x - left[3] * z
    dz = left[2] - sinking + left[3] * y - left[4] * x
    nx, ny, nz = unit[foot, 0], unit[foot, 1], unit[foot, 2]
    along = dx * nx + dy * ny + dz * nz
    dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
    return along, math.sqrt(dx * dx + dy * dy + dz * dz), dx, dy, dz


@njit()
def _add_ray(arms, unit, foot, size, friction, left, ray):
    """Force and moment, (6,), of the foot's force that does most work along a motion (6,)."""
    _, across, dx, dy, dz = _work(arms, unit, foot, size, left, 0.0)
    share = friction / across if across > 0.0 else 0.0
    fx, fy, fz = unit[foot, 0] + share * dx, unit[foot, 1] + share * dy, unit[foot, 2] + share * dz
    x, y, z = arms[foot, 0] / size, arms[foot, 1] / size, arms[foot, 2] / size
    ray[0], ray[1], ray[2] = fx, fy, fz
    ray[3], ray[4], ray[5] = y * fz - z * fy, z * fx - x * fz, x * fy - y * fx


@njit()
def _nearest(rays, shares, count, trial, products):
    """Shares of the first rays that come nearest to b, those of the rays before being given; 0 where they depend.

    Returns how many are left, moved to the front: those with a share above zero.
    """
    while count > 0:
        if not _solve(rays, count, trial, products):
            return 0
        step = 1.0
        for i in range(count):
            if trial[i] <= 0.0:
                step = min(step, shares[i] / (shares[i] - trial[i]) if shares[i] > 0.0 else 0.0)
        if step == 1.0:
            shares[:count] = trial[:count]
            return count
        kept = 0
        for i in range(count):
            share = shares[i] + step * (trial[i] - shares[i])
            if trial[i] > 0.0 or share > 1e-12:
                shares[kept] = share
                rays[kept] = rays[i]
                kept += 1
        if kept == count:
            return 0
        count = kept
    return 0


@njit()
def _solve(rays, count, trial, products):
    """Least squares of the first rays to b into trial, by Cholesky's method; False where they depend on each other."""
    for i in range(count):
        for j in range(i + 1):
            total = 0.0
            for row in range(6):
                total += rays[i, row] * rays[j, row]
            for k in range(j):
                total -= products[i, k] * products[j, k]
            if i > j:
                products[i, j] = total / products[j, j]
            elif total > _SMALLEST_PIVOT:
                products[i, i] = math.sqrt(total)
            else:
                return False
        total = rays[i, 2]
        for k in range(i):
            total -= products[i, k] * trial[k]
        trial[i] = total / products[i, i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            trial[i] -= products[k, i] * trial[k]
        trial[i] /= products[i, i]
    return True
