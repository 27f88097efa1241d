"""A shift of the chassis over feet that stay where they are, and the two answers to it."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_rpy, rpy
from footfall.core.value import Provenance, Value, value
from footfall.telemetry.state import RobotState

FARTHEST = 5.0
"""Largest shift along one axis that is taken for meant [m]."""


@value
class BodyShift(Value):
    """How the chassis is to move, from where it is.

    R_site_base′ = R_site_base · Rz(dyaw) · Ry(dpitch) · Rx(droll). Where the chassis is level, dyaw turns it about the
    vertical, dpitch > 0 lowers its front and droll > 0 lowers its right side.

    Attributes:
        dx: of the base's origin, along x of the site, east [m].
        dy: of the base's origin, along y of the site, north [m].
        dz: of the base's origin, along z of the site, up [m].
        droll: turn about the base's own x as it is now, forward [rad].
        dpitch: turn about the base's own y as it is now, left [rad].
        dyaw: turn about the base's own z as it is now, up [rad].
    """

    dx: float = 0.0
    dy: float = 0.0
    dz: float = 0.0
    droll: float = 0.0
    dpitch: float = 0.0
    dyaw: float = 0.0

    def check(self) -> None:
        """Raises InvalidInput for a shift that is not finite, too far along an axis, or over half a turn about one."""
        if not np.isfinite(self.vector).all():
            raise InvalidInput("a shift of the chassis needs finite dx, dy, dz [m] and droll, dpitch, dyaw [rad]")
        if np.abs(self.vector[:3]).max() > FARTHEST or np.abs(self.vector[3:]).max() > np.pi:
            raise InvalidInput(f"a shift of the chassis is at most {FARTHEST:g} m along an axis and π about one")

    @property
    def vector(self) -> Array:
        """(6,): dx, dy, dz [m], droll, dpitch, dyaw [rad]."""
        return np.array([self.dx, self.dy, self.dz, self.droll, self.dpitch, self.dyaw], float)

    def applied(self, T_site_base: Array) -> Array:
        """Move a chassis by the shift.

        Args:
            T_site_base: pose of the chassis before, (4, 4).

        Returns:
            T_site_base′ (4, 4) after it, equal to the one before where the shift is none.
        """
        T = np.array(T_site_base, float)
        if self.vector.any():
            T[:3, :3] = T[:3, :3] @ rotation_rpy(self.droll, self.dpitch, self.dyaw)
            T[:3, 3] += (self.dx, self.dy, self.dz)
        return T

    @classmethod
    def between(cls, T_site_base: Array, T_site_moved: Array) -> "BodyShift":
        """The shift that takes a chassis from one pose to another: backwards :meth:`applied`, |dpitch| < π/2.

        Args:
            T_site_base: pose of the chassis before, (4, 4).
            T_site_moved: pose of the chassis after, (4, 4).

        Returns:
            The shift, at most FARTHEST along each axis.

        Raises:
            InvalidInput: the poses are farther apart than that.
        """
        R = np.asarray(T_site_base, float)[:3, :3].T @ np.asarray(T_site_moved, float)[:3, :3]
        dx, dy, dz = np.asarray(T_site_moved, float)[:3, 3] - np.asarray(T_site_base, float)[:3, 3]
        return cls(float(dx), float(dy), float(dz), *rpy(R))


@value
class PredictedState(RobotState):
    """A state that was computed, not measured: posture and chassis pose are what was asked for.

    predicted: fields that come from a model of static contact (rigid legs, friction; the forces of least norm) where
    a measured state has measurements. provenance: the state it starts from, and the shift as settings.
    """

    predicted: tuple[str, ...]
    provenance: Provenance


@value
class ShiftRefused(Value):
    """Why the chassis can't be there with the feet where they are.

    leg: the leg in the way, or None where the rover as a whole would tip. joint: its joint outside its limits, or
    empty. excess: by how much: [rad] where a joint is named, else [m]; NaN where it has no size. reason: in words.
    """

    leg: int | None
    joint: str
    excess: float
    reason: str
