"""The least torque ratio for many places of one foot, each with the leg's posture there: the torque check of a map."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.cones import facets, unit_normals
from footfall.balance.moving_leg import body_moments, centers_of_mass, leg_links
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import PostureStatics, lowest_rim_points
from footfall.balance.settings import BalanceSettings
from footfall.balance.simplex import UNFINISHED
from footfall.balance.torque_kernel import least_ratios
from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.frames import apply, inverse, require_transform
from footfall.robot.description import JOINTS
from footfall.robot.model import Robot

Array = NDArray[np.float64]


def torque_ratios_for_postures(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    normals: ArrayLike,
    leg: int,
    qs_leg: ArrayLike,
    leg_normals: ArrayLike,
    settings: BalanceSettings,
) -> Array:
    """Ratios (n,) as :func:`footfall.balance.torques.torque_check` gives with ``leg`` down in each of many postures.

    legs, normals (k, 3): the other standing legs, as ``posture`` has them, and the ground under them; qs_leg (n, 6)
    [rad] and leg_normals (n, 3): the leg's angles and the ground there, site. A row with NaN gets NaN; one whose normal
    does not point up, against gravity, or where no forces hold the rover, inf. Raises InvalidInput where the legs
    don't fit.
    """
    T_site_base = require_transform(T_site_base, "T_site_base")
    leg = robot.require_leg(leg)
    standing = [robot.require_leg(one) for one in legs]
    if len({leg, *standing}) != len(standing) + 1:
        raise InvalidInput("a leg stands only once among the supporting legs", legs=[*standing, leg])
    qs, toward = np.asarray(qs_leg, float), np.asarray(leg_normals, float)
    if qs.ndim != 2 or qs.shape[1] != 6 or toward.shape != (len(qs), 3):
        raise InvalidInput("each posture of the leg needs six angles and one normal", shape=list(qs.shape))
    unit = unit_normals(np.asarray(normals, float).reshape(-1, 3))
    if len(unit) != len(standing):
        raise InvalidInput("each supporting leg needs one normal", legs=len(standing), normals=len(unit))
    statics = PostureStatics(robot, posture)
    R_level_base = settings.R_level_site @ T_site_base[:3, :3]
    up, limits = R_level_base[2], robot.torque_limits.reshape(-1, 6)
    mass, coms = loaded(robot, centers_of_mass(robot, posture, leg, qs), settings)
    weight = mass * settings.gravity

    contacts_base = apply(inverse(T_site_base), statics.contacts(standing, unit, T_site_base))
    shares = statics.gravity_torques(up, settings.gravity).reshape(-1, 6) / limits
    J = statics.contact_jacobians(standing, contacts_base)
    effect = _effect(R_level_base, J, limits[standing], weight)
    faces = facets(unit @ settings.R_level_site.T, settings.friction, settings.sides)

    with np.errstate(invalid="ignore", divide="ignore"):
        own_unit = toward / np.linalg.norm(toward, axis=1, keepdims=True)
    origins, rotations = leg_links(robot, leg, qs)
    axes = np.stack([rotations[:, i, :, "xyz".index(axis)] for i, (_, axis) in enumerate(JOINTS)], axis=1)
    outward = rotations[:, 5, :, 0]
    centers = origins[:, 5] + robot.description.legs[leg].foot * outward
    own = lowest_rim_points(centers, rotations[:, 5, :, 1], outward, own_unit @ T_site_base[:3, :3], robot.wheel_radius)
    own_J = np.cross(axes, own[:, None] - origins).transpose(0, 2, 1)
    masses, moments = body_moments(robot, leg, origins, rotations)
    # what each joint carries: the bodies from its own link outward
    carried = np.cumsum(masses[::-1])[::-1]
    beyond = np.cumsum(moments[:, ::-1], axis=1)[:, ::-1] - carried[:, None] * origins
    own_share = settings.gravity * (np.cross(axes, beyond) @ up) / limits[leg]

    level_unit = own_unit @ settings.R_level_site.T
    ratios = np.empty(len(qs))
    size = max(float(np.abs(contacts_base - statics.com).max(initial=0.0)), 1.0)
    status = least_ratios(
        contacts_base @ R_level_base.T,
        faces,
        effect,
        shares[standing],
        own @ R_level_base.T,
        level_unit,
        _effect(R_level_base, own_J, limits[leg], weight),
        own_share,
        coms @ R_level_base.T,
        size,
        settings.friction,
        ratios,
    )
    if (status == UNFINISHED).any():
        raise FootFallError("a torque program was not solved")
    ratios[level_unit[:, 2] <= 0] = np.inf
    in_the_air = [other for other in robot.legs if other not in (leg, *standing)]
    return np.maximum(ratios, np.abs(shares[in_the_air]).max(initial=0.0))


def _effect(R_level_base: Array, J: Array, limits: Array, weight: float) -> Array:
    """Ratios of a leg's joints by the force on its foot, in weights and level, (…, 6, 3), from J (…, 3, 6) in base."""
    return np.ascontiguousarray(np.swapaxes(-weight * (R_level_base @ J), -1, -2) / np.expand_dims(limits, -1))
