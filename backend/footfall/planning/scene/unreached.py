"""Why no posture puts a wheel where it is wanted: which joint would turn too far, or which way the leg is too short."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.robot.ik import solve_leg
from footfall.robot.limits import farthest_past, room_to_limits
from footfall.robot.model import Robot


def unreached(robot: Robot, leg: int, Ts_base_wheel: Array) -> str:
    """What keeps the leg from every one of some wheel poses, of the pose that it gets nearest to.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        Ts_base_wheel: (n, 4, 4).

    Returns:
        One sentence.
    """
    q = solve_leg(robot, leg, Ts_base_wheel).q.reshape(-1, 6)
    q = q[np.isfinite(q).all(axis=1)]
    if not len(q):
        short = np.minimum(shortfalls(robot, leg, Ts_base_wheel, False), shortfalls(robot, leg, Ts_base_wheel, True))
        return f"thigh and shank miss it by {max(float(short.min()), 0.0005):z.3f} m"
    own = slice(6 * leg, 6 * leg + 6)
    nearest = q[int(np.argmax(room_to_limits(robot, q, own).min(axis=1)))]
    worst = farthest_past(robot, nearest, own)
    excess = max(worst.excess, 0.0005)
    return f"{worst.name} would turn {excess:z.3f} rad ({np.rad2deg(excess):z.1f}°) past its limit"


def shortfalls(robot: Robot, leg: int, Ts_base_wheel: Array, back: bool) -> Array:
    """How much too far (or too near) the ankle is for thigh and shank.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        Ts_base_wheel: poses of the wheel, (n, 4, 4).
        back: whether the leg reaches back over its hip (shoulder 1).

    Returns:
        (n,) [m]; at most 0 where the leg reaches.
    """
    spec, away = robot.description.legs[leg], ankle_distances(robot, leg, Ts_base_wheel, back)
    return np.maximum(away - spec.thigh - spec.shank, abs(spec.thigh - spec.shank) - away)


def ankle_distances(robot: Robot, leg: int, Ts_base_wheel: Array, back: bool) -> Array:
    """How far the ankle is from the hip pitch joint where the hip's yaw has turned the leg's plane to it.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        Ts_base_wheel: poses of the wheel, (n, 4, 4).
        back: whether the leg reaches back over its hip (shoulder 1).

    Returns:
        (n,) [m].
    """
    spec = robot.description.legs[leg]
    ankles = apply(inverse(spec.T_base_hip), Ts_base_wheel[:, :3, 3] - spec.foot * Ts_base_wheel[:, :3, 0])
    reach = np.hypot(ankles[:, 0], ankles[:, 1]) * (-1.0 if back else 1.0)
    return np.hypot(reach - spec.hip_offset[0], ankles[:, 2] - spec.hip_offset[2])
