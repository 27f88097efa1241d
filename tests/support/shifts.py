"""Shifts of the chassis recovered from poses: the inverse of ``BodyShift.applied``, by scipy's Euler angles."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from footfall.planning.body.body_shift import BodyShift

Array = NDArray[np.float64]


def shift_between(T_from: Array, T_to: Array) -> BodyShift:
    """The shift that leads from one T_site_base (4, 4) to another."""
    yaw, pitch, roll = Rotation.from_matrix(T_from[:3, :3].T @ T_to[:3, :3]).as_euler("ZYX")
    dx, dy, dz = (float(d) for d in T_to[:3, 3] - T_from[:3, 3])
    return BodyShift(dx, dy, dz, float(roll), float(pitch), float(yaw))


def back(shift: BodyShift) -> BodyShift:
    """The shift that leads back."""
    return shift_between(shift.applied(np.eye(4)), np.eye(4))
