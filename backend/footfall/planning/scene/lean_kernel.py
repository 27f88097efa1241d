"""Wheels leaned into the plane of their leg, compiled; what that is for is told in lift.py."""

import math

import numpy as np

from footfall.compiled import njit
from footfall.core.arrays import Array

_ROUNDS = 10
_SETTLED = 1e-15
"""Change of a direction below which the rounds of one lean end."""
_PLACINGS = 12
_PLACED = 1e-14
"""Change of a pose below which a wheel stays where it was placed."""


@njit()
def lean_each(Ts_base_wheel: Array, shares: Array, T_base_hip: Array, foot: float) -> Array:
    """Poses (n, 4, 4) leaned by shares (n,) of 0…1, their centres kept. foot: from ankle to wheel centre [m]."""
    out = Ts_base_wheel.copy()
    for i in range(out.shape[0]):
        _lean(Ts_base_wheel[i], shares[i], T_base_hip, foot, out[i])
    return out


@njit()
def lean_onto(
    Ts_base_wheel: Array, point: Array, normal: Array, radius: float, T_base_hip: Array, foot: float
) -> Array:
    """Upright poses (n, 4, 4) leaned wholly; lowest along the normal (3,) their rims are at ``point`` (3,), in base."""
    out = Ts_base_wheel.copy()
    placed, before = np.empty((4, 4)), np.empty((4, 4))
    for i in range(out.shape[0]):
        for _ in range(_PLACINGS):
            along = size = 0.0
            for k in range(3):
                along += out[i, k, 1] * normal[k]
            for k in range(3):
                size += (along * out[i, k, 1] - normal[k]) ** 2
            size = math.sqrt(size)
            placed[:], before[:] = Ts_base_wheel[i], out[i]
            for k in range(3):
                placed[k, 3] = point[k] - radius * (along * out[i, k, 1] - normal[k]) / size
            _lean(placed, 1.0, T_base_hip, foot, out[i])
            if np.abs(out[i] - before).max() <= _PLACED:
                break
    return out


@njit()
def _lean(T: Array, share: float, T_base_hip: Array, foot: float, out: Array) -> None:
    """Write the pose T (4, 4) leaned."""
    x, across, turn = np.empty(3), np.empty(3), np.empty((3, 3))
    for k in range(3):
        x[k] = T[k, 0]
    # the ankle, and with it the plane, moves a little as the wheel leans
    for _ in range(_ROUNDS):
        east = north = 0.0
        for k in range(3):
            ankle = T[k, 3] - foot * x[k] - T_base_hip[k, 3]
            east += ankle * T_base_hip[k, 0]
            north += ankle * T_base_hip[k, 1]
        azimuth = math.atan2(north, east)
        c, s, off = math.cos(azimuth), math.sin(azimuth), 0.0
        for k in range(3):
            across[k] = c * T_base_hip[k, 1] - s * T_base_hip[k, 0]
            off += T[k, 0] * across[k]
        size = change = 0.0
        for k in range(3):
            size += (T[k, 0] - share * off * across[k]) ** 2
        size = math.sqrt(size)
        for k in range(3):
            new = (T[k, 0] - share * off * across[k]) / size
            change, x[k] = max(change, abs(new - x[k])), new
        if change <= _SETTLED:
            break
    # the shortest turn from T's x to the leaned one, v = sin · axis (Rodrigues)
    vx, vy, vz = T[1, 0] * x[2] - T[2, 0] * x[1], T[2, 0] * x[0] - T[0, 0] * x[2], T[0, 0] * x[1] - T[1, 0] * x[0]
    cosine = T[0, 0] * x[0] + T[1, 0] * x[1] + T[2, 0] * x[2]
    rest = 1.0 / (1.0 + cosine)
    turn[0, 0], turn[0, 1], turn[0, 2] = cosine + rest * vx * vx, rest * vx * vy - vz, rest * vx * vz + vy
    turn[1, 0], turn[1, 1], turn[1, 2] = rest * vx * vy + vz, cosine + rest * vy * vy, rest * vy * vz - vx
    turn[2, 0], turn[2, 1], turn[2, 2] = rest * vx * vz - vy, rest * vy * vz + vx, cosine + rest * vz * vz
    for row in range(3):
        for column in range(3):
            out[row, column] = turn[row, 0] * T[0, column] + turn[row, 1] * T[1, column] + turn[row, 2] * T[2, column]
        out[row, 3] = T[row, 3]
