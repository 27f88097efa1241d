"""From which part of a guide each leg reaches each footfall: compiled."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.planning.scene.rover_kernel import RoverTables, leg_too_near_itself
from footfall.planning.walk.legs_kernel import LegsTables, leg_at, pose_of


class Reaching(NamedTuple):
    """What counts as reached, and where that is looked at.

    A leg reaches a wheel where it has ``least`` to spare both on the ground and lifted by ``lift`` [m]. reach: no wheel
    farther from its hip is looked at [m]; beside: (m,) the pose beside each wheel; near: how many before and after it
    are looked at.
    """

    lift: float
    least: float
    reach: float
    beside: NDArray[np.int64]
    near: int


class Spans(NamedTuple):
    """first, last: (m,) of the longest run of poses, n and −1 where there is none; best: (m,) most to spare."""

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    best: Array


@njit(parallel=True)
def spans(
    Ts_site_base: Array,
    Ts_site_wheel: Array,
    branches: NDArray[np.int64],
    leg: int,
    asked: Reaching,
    legs: LegsTables,
    rover: RoverTables,
    out: Spans,
) -> None:
    """Write the longest run of poses (n, 3, 4) from which a leg reaches each wheel pose.

    Ts_site_wheel: (m, 3, 4), branches: (m,).
    """
    lift, least, reach, beside, near = asked.lift, asked.least, asked.reach, asked.beside, asked.near
    first, last, best = out.first, out.last, out.best
    count = len(Ts_site_base)
    H = legs.Ts_base_hip[leg]
    hips = np.empty((count, 3))
    for i in range(count):
        for k in range(3):
            T = Ts_site_base[i]
            hips[i, k] = T[k, 0] * H[0, 3] + T[k, 1] * H[1, 3] + T[k, 2] * H[2, 3] + T[k, 3]
    for unsigned in prange(len(Ts_site_wheel)):
        j = np.int64(unsigned)
        T_site_wheel, q, above = Ts_site_wheel[j].copy(), np.empty(6), np.empty(6)
        poses = np.empty((7 * len(legs.lengths), 3, 4))
        z = T_site_wheel[2, 3]
        first[j], last[j], best[j] = count, -1, -np.inf
        begin = -1
        end = min(beside[j] + near + 1, count)
        for i in range(max(beside[j] - near, 0), end + 1):
            good = False
            if i < end:
                away = math.hypot(hips[i, 0] - T_site_wheel[0, 3], hips[i, 1] - T_site_wheel[1, 3])
                if away <= reach:
                    T_site_wheel[2, 3] = z
                    spare = leg_at(Ts_site_base[i], T_site_wheel, branches[j], leg, legs, q)
                    if spare >= least:
                        T_site_wheel[2, 3] = z + lift
                        lifted = leg_at(Ts_site_base[i], T_site_wheel, branches[j], leg, legs, above)
                        spare = min(spare, lifted)
                    if spare >= least:
                        spare = min(spare, leg_too_near_itself(q, leg, Ts_site_base[i], rover, poses))
                    if spare >= least:
                        spare = min(spare, leg_too_near_itself(above, leg, Ts_site_base[i], rover, poses))
                    best[j] = max(best[j], spare)
                    good = spare >= least
            if good and begin < 0:
                begin = i
            if not good and begin >= 0:
                if i - 1 - begin > last[j] - first[j]:
                    first[j], last[j] = begin, i - 1
                begin = -1


@njit()
def poses_of(vectors: Array, Ts: Array) -> None:
    """Write T_site_base (n, 3, 4) of x, y, z [m], roll, pitch, yaw [rad], (n, 6)."""
    for i in range(len(vectors)):
        pose_of(vectors[i], Ts[i])
