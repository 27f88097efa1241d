"""Whether a standing rover is held, for very many postures: the tables of held_kernel.py, and a call for many at once.

The answer is that of :func:`footfall.balance.torques.torque_check`, thousands of times sooner where little is asked of
the motors and the ground.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.held_kernel import HeldTables, all_held_within
from footfall.balance.moving_leg import leg_bodies, leg_links
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import lowest_rim_points
from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.robot.description import PARTS
from footfall.robot.model import Robot


def held_tables(robot: Robot, settings: BalanceSettings, tether: Tether | None = None) -> HeldTables:
    """What the compiled checks need of a robot, loaded and judged as the settings say, that may hang on a tether."""
    parts = np.empty((robot.leg_count, 6, 4))
    for leg in robot.legs:
        parts[leg, :, 3], parts[leg, :, :3] = leg_bodies(robot, leg)
    # the links as if all were at base's origin: what is left of the loaded moment is that of chassis and payload
    chassis, payload = robot.model.inertias[0], robot.description.payload
    moment = chassis.mass * chassis.lever
    if payload is not None:
        moment = moment + payload.mass * payload.position
    mass, center = loaded(robot, moment / robot.mass, settings)
    own = mass - parts[:, :, 3].sum()
    inside = settings.friction * np.cos(np.pi / settings.sides)
    return HeldTables(
        parts,
        robot.torque_limits.reshape(-1, 6).copy(),
        np.append(mass * center / own, own),
        np.ascontiguousarray(settings.R_level_site),
        np.array([settings.gravity, settings.friction, inside, settings.sides]),
        np.empty((0, 7))
        if tether is None
        else np.array([[*tether.anchor, *tether.attachment, tether.most_force]], float),
    )


def postures_held(
    robot: Robot,
    postures: ArrayLike,
    Ts_site_base: ArrayLike,
    standing: ArrayLike,
    normals: ArrayLike,
    settings: BalanceSettings,
    most: float = 1.0,
    tether: Tether | None = None,
) -> NDArray[np.bool_]:
    """Which postures are held with at most a share of every torque limit.

    Wheels touch with the lowest points of their rims.

    Args:
        robot: the rover.
        postures: (n, legs × 6) [rad].
        Ts_site_base: poses of the chassis, (n, 4, 4).
        standing: (n, legs) bool, the legs on the ground.
        normals: (n, legs, 3) of the ground under those, in site.
        settings: friction, gravity and payload.
        most: largest share of a torque limit, 1: all of it.
        tether: that the rover hangs on; None: none.

    Returns:
        (n,); False where a number is not finite, and where a normal does not point up and there is no tether.

    Raises:
        InvalidInput: shapes don't fit.
    """
    args = placed_postures(robot, postures, Ts_site_base, standing, normals)
    return all_held_within(*args, held_tables(robot, settings, tether), float(most))


def placed_postures(
    robot: Robot, postures: ArrayLike, Ts_site_base: ArrayLike, standing: ArrayLike, normals: ArrayLike
) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    """The first five arguments of the kernels' ``all_held_within``.

    Args:
        robot: the rover.
        postures: (n, legs × 6) [rad].
        Ts_site_base: poses of the chassis, (n, 4, 4).
        standing: (n, legs) bool, the legs on the ground.
        normals: (n, legs, 3) of the ground under those, in site.

    Returns:
        Poses of the links in base, Ts_site_base, contacts, normals, standing.

    Raises:
        InvalidInput: shapes don't fit.
    """
    qs, stands, toward = np.asarray(postures, float), np.asarray(standing, bool), np.asarray(normals, float)
    Ts, legs = np.asarray(Ts_site_base, float), robot.leg_count
    n = len(qs)
    if qs.shape != (n, 6 * legs) or stands.shape != (n, legs) or toward.shape != (n, legs, 3) or Ts.shape != (n, 4, 4):
        raise InvalidInput("each posture needs joint angles, a pose, and of every leg whether it stands and a normal")
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = toward / np.linalg.norm(toward, axis=2, keepdims=True)
    T_base_link, contacts = np.empty((n, legs, len(PARTS), 3, 4)), np.empty((n, legs, 3))
    for leg in robot.legs:
        origins, rotations = leg_links(robot, leg, qs[:, 6 * leg : 6 * leg + 6])
        axles, outward = rotations[:, 5, :, 1], rotations[:, 5, :, 0]
        centers = origins[:, 5] + robot.description.legs[leg].foot * outward
        T_base_link[:, leg, :6, :, :3], T_base_link[:, leg, :6, :, 3] = rotations, origins
        T_base_link[:, leg, 6, :, :3], T_base_link[:, leg, 6, :, 3] = rotations[:, 5], centers
        normals_base = (unit[:, leg, None] @ Ts[:, :3, :3])[:, 0]
        contacts[:, leg] = lowest_rim_points(centers, axles, outward, normals_base, robot.wheel_radius)
    R, at = Ts[:, :3, :3], Ts[:, :3, 3]
    poses = R[:, None, None] @ T_base_link
    poses[..., 3] += at[:, None, None]
    contacts = contacts @ R.swapaxes(1, 2) + at[:, None]
    poses = np.ascontiguousarray(poses.reshape(n, -1, 3, 4))
    return poses, Ts, contacts, unit, stands
