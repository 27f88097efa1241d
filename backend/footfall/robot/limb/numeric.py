"""Joint angles that bring a limb's foot to a place, for limbs without a closed form."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidInput
from footfall.robot.limb import limb_kernel
from footfall.robot.limb.limb import Limb

Array = NDArray[np.float64]

SEEDS, TRIED, TRIED_OF_FEW = 1000, 64, 32
"""Postures that are known beforehand, and how many of them, the nearest ones, are tried for each place; those of
limbs of up to three joints, of which a place has four postures at most."""
MOST = 16
"""Different postures of one place: a limb of six turning joints has no more (Primrose, 1986)."""
TOLERANCE = 1e-12
"""Of the foot's place, as a share of the limb's reach."""
APART = 1e-4
"""Two postures that differ by less in every joint are one [rad or m]."""


@dataclass(frozen=True)
class LimbSolutions:
    """q: (n, 16, joints) postures of each place, those found first, then NaN; left: (n, 16) errors [m], NaN alike."""

    q: Array
    left: Array

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many postures each place has, (n,)."""
        return (~np.isnan(self.left)).sum(axis=1)


class NumericLimb:
    """Solves one limb by descent from many known postures; the same limb gives the same answers.

    All postures of a place are looked for, none is promised: what is found is right, what is not found may exist. A
    limb with more joints than its place has numbers has no end of postures; some of them are answered.
    """

    def __init__(self, limb: Limb) -> None:
        self.limb = limb
        self._chain = limb.placements, limb.axes, limb.slides, limb.lower, limb.upper
        self._length = 0.5 * limb.reach
        self._tried = TRIED if len(limb.names) > 3 else TRIED_OF_FEW
        self._tolerance = TOLERANCE * limb.reach
        rng = np.random.default_rng(0)
        self._seeds = rng.uniform(limb.lower, limb.upper, (SEEDS, len(limb.names)))
        feet = self.feet(self._seeds)
        self._seed_places = np.hstack([feet[:, :3, 3], feet[:, :3, :3].reshape(SEEDS, 9)])

    def feet(self, q: ArrayLike) -> Array:
        """Poses T_base_foot (n, 4, 4) at postures (n, joints)."""
        postures, joints = self._postures(q), len(self.limb.names)
        Ts = np.tile(np.eye(4), (len(postures), 1, 1))
        points, turns = np.empty((joints, 3)), np.empty((joints, 3))
        for posture, T in zip(postures, Ts, strict=True):
            limb_kernel.foot_and_jacobian(*self._chain[:3], posture, T, points, turns)
        return Ts

    def solve(self, places: ArrayLike) -> LimbSolutions:
        """Postures inside the limits for places of the foot on the body.

        places: (n, 3) points or (n, 4, 4) poses, as the limb asks for. Raises InvalidInput for other shapes, and for
        numbers that are not finite.
        """
        targets = self._targets(places)
        q = np.full((len(targets), MOST, len(self.limb.names)), np.nan)
        left = np.full((len(targets), MOST), np.nan)
        asked = targets, self._length, self.limb.equations, self._tolerance
        limb_kernel.solve_places(*self._chain, *asked, APART, self._seeds, self._seed_places, self._tried, q, left)
        return LimbSolutions(q, left)

    def solve_from(self, places: ArrayLike, q: ArrayLike) -> Array:
        """The posture of each place that the way from a posture (n, joints) leads to, NaN where it leads to none.

        Raises InvalidInput as :meth:`solve`.
        """
        targets, postures = self._targets(places), self._postures(q).copy()
        if len(postures) != len(targets):
            raise InvalidInput(f"{len(targets)} places need as many postures to begin from, not {len(postures)}")
        asked = targets, self._length, self.limb.equations, self._tolerance
        limb_kernel.solve_from(*self._chain, *asked, postures)
        return postures

    def _postures(self, q: ArrayLike) -> Array:
        postures = np.ascontiguousarray(q, float)
        if postures.ndim != 2 or postures.shape[1] != len(self.limb.names) or not np.isfinite(postures).all():
            raise InvalidInput(
                f"postures of this limb need {len(self.limb.names)} finite numbers each", shape=list(postures.shape)
            )
        return postures

    def _targets(self, places: ArrayLike) -> Array:
        """Poses (n, 4, 4); of points the turn does not count."""
        given = np.asarray(places, float)
        shape = (3,) if self.limb.place == "point" else (4, 4)
        if given.ndim != 1 + len(shape) or given.shape[1:] != shape or not np.isfinite(given).all():
            kind = "points (n, 3)" if self.limb.place == "point" else "poses (n, 4, 4)"
            raise InvalidInput(f"places of this limb's foot are finite {kind}", shape=list(given.shape))
        if self.limb.place == "pose":
            return np.ascontiguousarray(given)
        targets = np.tile(np.eye(4), (len(given), 1, 1))
        targets[:, :3, 3] = given
        return targets
