"""Joints of a limb that follow others of it, as rods of a pantograph make them: angle = ratio × leader's + offset."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.value import Value, value


@value
class Coupling(Value):
    """leads: (joints,) number of the joint that each goes with, its own where it moves by itself.

    ratios, offsets: (joints,) [rad or m]; 1 and 0 of joints that move by themselves.
    """

    leads: NDArray[np.int64]
    ratios: Array
    offsets: Array

    def check(self) -> None:
        """Raises InvalidRobot where a joint follows one that follows another, or stands still as that moves."""
        joints = np.arange(len(self.leads))
        if self.ratios.shape != joints.shape or self.offsets.shape != joints.shape:
            raise InvalidRobot(f"{len(joints)} joints need as many ratios and offsets")
        if not (np.isin(self.leads, joints).all() and (self.leads[self.leads] == self.leads).all()):
            raise InvalidRobot("a joint follows one that moves by itself")
        if not (np.isfinite(self.ratios) & np.isfinite(self.offsets) & (self.ratios != 0)).all():
            raise InvalidRobot("a joint follows another by a finite ratio other than 0")
        if (self.ratios[self.free] != 1).any() or self.offsets[self.free].any():
            raise InvalidRobot("a joint that moves by itself has ratio 1 and offset 0")

    @classmethod
    def none(cls, joints: int) -> "Coupling":
        """Of so many joints that all move by themselves."""
        return cls(np.arange(joints), np.ones(joints), np.zeros(joints))

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which joints move by themselves, (joints,)."""
        return self.leads == np.arange(len(self.leads))

    @property
    def alone(self) -> NDArray[np.bool_]:
        """Which joints follow none and are followed by none, (joints,)."""
        return self.free & (np.bincount(self.leads, minlength=len(self.leads)) == 1)

    @property
    def couples(self) -> bool:
        """Whether a joint follows another."""
        return not bool(self.free.all())

    def followed(self, q: Array) -> Array:
        """Postures (…, joints) with followers where their leaders have them [rad or m]."""
        return self.ratios * q[..., self.leads] + self.offsets if self.couples else q

    def folded(self, rows: Array) -> Array:
        """What leaders move or bear together with their followers, by virtual work; followers' own rows are zero.

        Args:
            rows: of each joint, (joints, …): an effort, or how a point moves with it.

        Returns:
            (joints, …).
        """
        if not self.couples:
            return rows
        found = np.where(self.free.reshape(-1, *[1] * (rows.ndim - 1)), rows, 0.0)
        for joint in np.flatnonzero(~self.free):
            found[self.leads[joint]] += self.ratios[joint] * rows[joint]
        return found

    def part(self, own: slice) -> "Coupling":
        """That of some of the joints, whose leaders are among them."""
        return Coupling(self.leads[own] - own.start, self.ratios[own], self.offsets[own])
