"""What solves a limb: postures that bring its foot to a place, found in closed form or by descent."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.robot.limb import limb_kernel
from footfall.robot.limb.coupling import Coupling
from footfall.robot.limb.limb import Limb


@dataclass(frozen=True)
class LimbSolutions:
    """q: (n, most, joints) postures of each place, NaN where there is none; left: (n, most) errors [m], NaN alike."""

    q: Array
    left: Array

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many postures each place has, (n,)."""
        return (~np.isnan(self.left)).sum(axis=1)


class LimbSolver(ABC):
    """Solves one limb; the same limb gives the same answers. coupling: which of its joints follow others of it."""

    def __init__(self, limb: Limb, coupling: Coupling | None = None) -> None:
        self.limb = limb
        self.coupling = Coupling.none(len(limb.names)) if coupling is None else coupling
        follows = self.coupling.leads, self.coupling.ratios, self.coupling.offsets
        self._chain = limb_kernel.LimbChain(limb.placements, limb.axes, limb.slides, limb.lower, limb.upper, *follows)

    def feet(self, q: ArrayLike) -> Array:
        """Poses T_base_foot (n, 4, 4) at postures (n, joints)."""
        postures, joints = self._postures(q), len(self.limb.names)
        Ts = np.tile(np.eye(4), (len(postures), 1, 1))
        points, turns = np.empty((joints, 3)), np.empty((joints, 3))
        for posture, T in zip(postures, Ts, strict=True):
            limb_kernel.foot_and_jacobian(*self._chain[:3], posture, T, points, turns)
        return Ts

    @abstractmethod
    def solve(self, places: ArrayLike) -> LimbSolutions:
        """Postures inside the limits for places of the foot on the body.

        places: (n, 3) points or (n, 4, 4) poses, as the limb asks for. Raises InvalidInput for other shapes, and for
        numbers that are not finite.
        """

    @abstractmethod
    def solve_from(self, places: ArrayLike, q: ArrayLike) -> Array:
        """The posture of each place that the way from a posture (n, joints) leads to, NaN where it leads to none.

        Raises InvalidInput as :meth:`solve`.
        """

    def _from(self, places: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
        """Places as poses, and as many postures to begin from."""
        targets, postures = self._targets(places), self.coupling.followed(self._postures(q)).copy()
        if len(postures) != len(targets):
            raise InvalidInput(f"{len(targets)} places need as many postures to begin from, not {len(postures)}")
        return targets, postures

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
