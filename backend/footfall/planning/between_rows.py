"""What lies between the rows of a motion: joints go straight, the chassis too, and it turns about one axis."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.planning.motion import Motion


def at(motion: Motion, moment: float) -> tuple[Array, Array]:
    """Where the rover is at 0…1 of a motion, measured by the largest joint's travel: long rows take longer.

    Args:
        motion: of two rows or more.
        moment: 0…1.

    Returns:
        Posture (joints,) and T_site_base (4, 4).
    """
    along = motion.travelled
    travel = np.diff(along)
    here = np.clip(moment, 0, 1) * along[-1]
    posture = np.array([np.interp(here, along, joint) for joint in motion.waypoints.T])
    after = min(max(int(np.searchsorted(along, here)), 1), len(travel))
    share = (here - along[after - 1]) / travel[after - 1] if travel[after - 1] else 1.0
    T_from, T_to = motion.Ts_site_base[after - 1 : after + 1]
    return posture, base_path(T_from, T_to, np.array([share]))[0]


def finer(motion: Motion, step: float, fewest: int = 1) -> tuple[Motion, NDArray[np.int64]]:
    """A motion with rows between, evenly on each way; its own rows are in it bit for bit.

    Args:
        motion: any.
        step: no joint changes by more from one row to the next [rad].
        fewest: into so many parts at least the way to each row is cut.

    Returns:
        The same motion, and of each of its rows the number of the one that is gone to, (m,).
    """
    counts = np.maximum(np.ceil(motion.travel / step).astype(int), fewest)
    waypoints, poses = [motion.waypoints[:1]], [motion.Ts_site_base[:1]]
    for row, count in enumerate(counts):
        (before, after), (T_from, T_to) = motion.waypoints[row : row + 2], motion.Ts_site_base[row : row + 2]
        shares = np.arange(1, count + 1) / count
        waypoints += [before + shares[:-1, None] * (after - before), after[None]]
        poses.append(base_path(T_from, T_to, shares))
    gone_to = np.repeat(np.arange(len(motion.phases)), [1, *counts])
    phases = tuple(motion.phases[row] for row in gone_to)
    return Motion(np.concatenate(waypoints), np.concatenate(poses), motion.stays[gone_to], phases), gone_to


def base_path(T_from: Array, T_to: Array, fractions: Array) -> Array:
    """Chassis poses between two: the origin on a straight line, the turn about one axis.

    Translation and rotation are interpolated apart (slerp, constant rate), so the origin's path does not depend on the
    turn.

    Args:
        T_from: where it begins, (4, 4).
        T_to: where it ends, (4, 4).
        fractions: of the way, (n,) 0…1.

    Returns:
        (n, 4, 4); at 0 and 1 the two poses, bit for bit.
    """
    t = np.asarray(fractions, float)
    turn = Rotation.from_matrix(T_from[:3, :3].T @ T_to[:3, :3]).as_rotvec()
    Ts = np.tile(np.eye(4), (len(t), 1, 1))
    Ts[:, :3, :3] = T_from[:3, :3] @ Rotation.from_rotvec(t[:, None] * turn).as_matrix()
    Ts[:, :3, 3] = (1 - t[:, None]) * T_from[:3, 3] + t[:, None] * T_to[:3, 3]
    Ts[t == 0.0], Ts[t == 1.0] = T_from, T_to
    return Ts
