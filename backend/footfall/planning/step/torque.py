"""The least torque ratio for many postures of a leg in the air: the others stand, their joints as they are.

What the standing legs' joints carry depends on the moving leg by the centre of mass alone: all but that is set up once.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from footfall.balance.cones import facets, unit_normals
from footfall.balance.moving_leg import body_moments, centers_of_mass, leg_links
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import PostureStatics
from footfall.balance.settings import BalanceSettings
from footfall.balance.simplex import INFEASIBLE, OPTIMAL
from footfall.balance.torque_kernel import least_ratio
from footfall.core.errors import FootFallError
from footfall.core.frames import apply, inverse
from footfall.planning.step.edges import Array
from footfall.robot.description import JOINTS
from footfall.robot.model import Robot


def swing_torque_ratios(
    robot: Robot,
    posture: Array,
    T_site_base: Array,
    legs: Sequence[int],
    normals: Array,
    leg: int,
    qs: Array,
    settings: BalanceSettings,
) -> Array:
    """Ratios (n,) as :func:`footfall.balance.torques.torque_check` gives with ``leg`` in the air at qs (n, 6) [rad].

    legs, normals (k, 3): the standing legs, as ``posture`` has them, and the ground under them, site. inf where no
    forces hold the rover.
    """
    standing, unit = list(legs), unit_normals(np.asarray(normals, float))
    statics = PostureStatics(robot, posture)
    R_level_base = settings.R_level_site @ T_site_base[:3, :3]
    limits = robot.torque_limits.reshape(-1, 6)
    mass, coms = loaded(robot, centers_of_mass(robot, posture, leg, qs), settings)
    contacts_base = apply(inverse(T_site_base), statics.contacts(standing, unit, T_site_base))
    shares = statics.gravity_torques(R_level_base[2], settings.gravity).reshape(-1, 6) / limits
    J_level = R_level_base @ statics.contact_jacobians(standing, contacts_base)
    effect = np.ascontiguousarray((-mass * settings.gravity / limits[standing][:, None] * J_level).transpose(0, 2, 1))
    ratios = np.empty(len(qs))
    solved = _ratios(
        np.ascontiguousarray(contacts_base @ R_level_base.T),
        facets(unit @ settings.R_level_site.T, settings.friction, settings.sides),
        effect,
        np.ascontiguousarray(shares[standing]),
        np.ascontiguousarray(coms @ R_level_base.T),
        ratios,
    )
    if not solved:
        raise FootFallError("a torque program was not solved")
    in_the_air = [other for other in robot.legs if other not in (leg, *standing)]
    carried = np.abs(_gravity_torques(robot, leg, qs, R_level_base[2], settings.gravity) / limits[leg]).max(axis=1)
    return np.maximum(np.maximum(ratios, carried), np.abs(shares[in_the_air]).max(initial=0.0))


def _gravity_torques(robot: Robot, leg: int, qs: Array, up_base: Array, gravity: float) -> Array:
    """What holds the hanging leg's joints, (n, 6) [N·m]."""
    origins, rotations = leg_links(robot, leg, qs)
    masses, moments = body_moments(robot, leg, origins, rotations)
    axes = np.stack([rotations[:, i, :, "xyz".index(axis)] for i, (_, axis) in enumerate(JOINTS)], axis=1)
    # each joint carries the bodies from its own link outward
    beyond = np.cumsum(moments[:, ::-1], axis=1)[:, ::-1] - np.cumsum(masses[::-1])[::-1, None] * origins
    return gravity * (np.cross(axes, beyond) @ up_base)


@njit(cache=True)
def _ratios(contacts: Array, faces: Array, effect: Array, constant: Array, coms: Array, ratios: Array) -> bool:
    """Fill in the ratio for each centre of mass (n, 3); whether all programs were solved."""
    forces = np.empty(contacts.shape)
    for i in range(coms.shape[0]):
        arms = contacts - coms[i]
        size = max(np.abs(arms).max(), 1e-6)
        status, ratio = least_ratio(arms / size, faces, effect, constant, forces)
        if status == INFEASIBLE:
            ratio = np.inf
        elif status != OPTIMAL:
            return False
        ratios[i] = ratio
    return True
