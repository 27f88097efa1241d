"""Joints of a cylindrical limb in closed form: one turns, the other two slide along its axis and across it.

So are the Ambler's legs built, and manipulators with cylindrical coordinates. What slides along the axis gives the
height; in the plane across it, what slides solves a quadratic equation, and the turn is the difference of two angles.
A place has two *branches*: 0, the foot is out on the side to which the limb slides; 1, it is slid back past the axis.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply, inverse
from footfall.robot.limb.limb import Limb
from footfall.robot.limb.limb_solver import LimbSolutions, LimbSolver

SQUARE = 1e-9
"""Axes are along or across each other where their cosine is off by less."""
ROUNDING = 1e-12
"""By how much a place may lie out of reach, as a share of the limb's reach, and joints past their limits [rad or m]."""


@dataclass(frozen=True)
class CylindricalSolutions(LimbSolutions):
    """By branch: q (n, 2, 3), left (n, 2); spare: (n, 2) from the nearest limit [rad or m], NaN where q is."""

    spare: Array


def is_cylindrical(limb: Limb) -> bool:
    """Whether the first joint turns, one of two others slides along its axis and one across it; for points alone."""
    if limb.place != "point" or limb.slides.tolist() != [False, True, True]:
        return False
    cosines = sorted(abs(float(limb.axes[0] @ way)) for way in _ways(limb))
    return cosines[0] < SQUARE and cosines[1] > 1 - SQUARE


class CylindricalLimb(LimbSolver):
    """Raises InvalidRobot for a limb of another structure."""

    def __init__(self, limb: Limb) -> None:
        super().__init__(limb)
        if not is_cylindrical(limb):
            raise InvalidRobot("a cylindrical limb turns, and slides along the axis of its turn and across it")
        axis = limb.axes[0]
        side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        side /= np.linalg.norm(side)
        turned = np.stack([side, np.cross(axis, side), axis])  # x and y across the axis, z along it
        self._T_plane_base = inverse(limb.placements[0])
        self._T_plane_base[:3] = turned @ self._T_plane_base[:3]
        ways = np.array(_ways(limb)) @ turned.T
        self._along = int(np.argmax(np.abs(ways[:, 2])))
        self._sign = float(np.sign(ways[self._along, 2]))
        self._way = ways[1 - self._along, :2]
        self._foot = turned @ _foot_at_zero(limb)
        self._ahead = float(self._foot[:2] @ self._way)
        self._aside = float(self._foot[:2] @ self._foot[:2]) - self._ahead**2

    @property
    def axis(self) -> Array:
        """Of the turn, in base, (3,)."""
        return self.limb.placements[0, :3, :3] @ self.limb.axes[0]

    @property
    def radii(self) -> tuple[float, float]:
        """Least and greatest distance of the foot from the axis [m]."""
        joint = 2 - self._along
        ends = np.array([self.limb.lower[joint], self.limb.upper[joint]]) + self._ahead
        least = 0.0 if ends[0] < 0 < ends[1] else float(np.abs(ends).min())
        return float(np.sqrt(least**2 + self._aside)), float(np.sqrt(np.abs(ends).max() ** 2 + self._aside))

    def solve(self, places: ArrayLike) -> CylindricalSolutions:
        """Every posture inside the limits there is, turns nearest to their middle.

        Of a foot on the axis the turn is free, and the middle one is answered.
        """
        limb, targets = self.limb, self._targets(places)
        q = self._both(targets[:, :3, 3], np.full(len(targets), (limb.lower[0] + limb.upper[0]) / 2))
        spare = np.minimum(q - limb.lower, limb.upper - q).min(axis=2)
        out = ~(spare >= -ROUNDING)
        q = np.clip(q, limb.lower, limb.upper)
        q[out], spare[out] = np.nan, np.nan
        left = np.full(out.shape, np.nan)
        branch, place = np.nonzero(~out.T)
        feet = self.feet(q[place, branch])[:, :3, 3]
        left[place, branch] = np.linalg.norm(feet - targets[place, :3, 3], axis=1)
        return CylindricalSolutions(q, left, spare)

    def solve_from(self, places: ArrayLike, q: ArrayLike) -> Array:
        """The branch that each posture is of, the turn nearest to its own: a turn without limits goes on and on."""
        limb, (targets, near) = self.limb, self._from(places, q)
        both = self._both(targets[:, :3, 3], near[:, 0])
        branch = (near[:, 2 - self._along] + self._ahead < 0).astype(int)
        found = both[np.arange(len(near)), branch]
        past = ~((found[:, 0] >= limb.lower[0]) & (found[:, 0] <= limb.upper[0]))
        if past.any():
            found[past, 0] = _nearest_turn(found[past, 0], (limb.lower[0] + limb.upper[0]) / 2)
        inside = ((found >= limb.lower - ROUNDING) & (found <= limb.upper + ROUNDING)).all(axis=1)
        found[~inside] = np.nan
        return np.clip(found, limb.lower, limb.upper)

    def _both(self, places: Array, near: Array) -> Array:
        """Both branches (n, 2, 3) of places (n, 3), turns nearest to near (n,), whatever the limits; NaN: none."""
        at = apply(self._T_plane_base, places)
        squared = (at[:, :2] ** 2).sum(axis=1) - self._aside
        least = ROUNDING * self.limb.reach
        root = np.sqrt(np.where(squared > -(least**2), np.maximum(squared, 0.0), np.nan))
        q = np.empty((len(at), 2, 3))
        q[:, :, 1 + self._along] = (self._sign * (at[:, 2] - self._foot[2]))[:, None]
        on_axis = np.hypot(at[:, 0], at[:, 1]) <= least
        for branch, sign in enumerate((1.0, -1.0)):
            out = sign * root - self._ahead
            slid = self._foot[:2] + out[:, None] * self._way
            turn = np.arctan2(at[:, 1], at[:, 0]) - np.arctan2(slid[:, 1], slid[:, 0])
            q[:, branch, 2 - self._along] = out
            q[:, branch, 0] = np.where(on_axis, near, _nearest_turn(turn, near))
        q[np.isnan(root)] = np.nan
        return q


def _nearest_turn(angles: Array, near: Array | float) -> Array:
    """The same angles, each by whole turns nearest to another."""
    return angles - 2 * np.pi * np.round((angles - near) / (2 * np.pi))


def _ways(limb: Limb) -> list[Array]:
    """Directions of the two joints that slide, in the frame of the one that turns."""
    R = limb.placements[1, :3, :3]
    return [R @ limb.axes[1], R @ limb.placements[2, :3, :3] @ limb.axes[2]]


def _foot_at_zero(limb: Limb) -> Array:
    """The foot in the frame of the joint that turns, all joints at zero."""
    return (limb.placements[1] @ limb.placements[2] @ limb.placements[3])[:3, 3]
