"""Joint angles that bring a limb's foot to a place, for limbs without a closed form."""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.robot.limb import limb_kernel
from footfall.robot.limb.coupling import Coupling
from footfall.robot.limb.limb import Limb
from footfall.robot.limb.limb_solver import LimbSolutions, LimbSolver

SEEDS, TRIED, TRIED_OF_FEW = 1000, 64, 32
"""Postures that are known beforehand, and how many of them, the nearest ones, are tried for each place; those of
limbs of up to three joints, of which a place has four postures at most."""
MOST = 16
"""Different postures of one place: a limb of six turning joints has no more (Primrose, 1986)."""
TOLERANCE = 1e-12
"""Of the foot's place, as a share of the limb's reach."""
APART = 1e-4
"""Two postures that differ by less in every joint are one [rad or m]."""


class NumericLimb(LimbSolver):
    """Solves one limb by descent from many known postures.

    All postures of a place are looked for, none is promised: what is found is right, what is not found may exist. A
    limb with more joints than its place has numbers has no end of postures; some of them are answered.
    """

    def __init__(self, limb: Limb, coupling: Coupling | None = None) -> None:
        super().__init__(limb, coupling)
        self._near = limb_kernel.Nearness(0.5 * limb.reach, limb.equations, TOLERANCE * limb.reach)
        tried = TRIED if self.coupling.free.sum() > 3 else TRIED_OF_FEW
        rng = np.random.default_rng(0)
        postures = self.coupling.followed(rng.uniform(limb.lower, limb.upper, (SEEDS, len(limb.names))))
        feet = self.feet(postures)
        places = np.hstack([feet[:, :3, 3], feet[:, :3, :3].reshape(SEEDS, 9)])
        self._seeds = limb_kernel.Seeds(postures, places, tried)

    def solve(self, places: ArrayLike) -> LimbSolutions:
        """Those found first, then NaN; at most 16 (MOST) of each place."""
        targets = self._targets(places)
        q = np.full((len(targets), MOST, len(self.limb.names)), np.nan)
        left = np.full((len(targets), MOST), np.nan)
        limb_kernel.solve_places(self._chain, targets, self._near, self._seeds, APART, q, left)
        return LimbSolutions(q, left)

    def solve_from(self, places: ArrayLike, q: ArrayLike) -> Array:
        """The end of a descent."""
        targets, postures = self._from(places, q)
        limb_kernel.solve_from(self._chain, targets, self._near, postures)
        return postures
