"""The least torque ratio for many postures of one leg: on the ground, as maps ask, and in the air, as steps do.

What the other standing legs' joints carry depends on that leg by the centre of mass alone: all but that is set up once.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.cones import facets, unit_normals
from footfall.balance.moving_leg import centers_with, gravity_torques, joint_axes, leg_links, moment_without
from footfall.balance.payload import loaded
from footfall.balance.posture_statics import PostureStatics, lowest_rim_points
from footfall.balance.simplex import UNFINISHED
from footfall.balance.torque_kernel import hull_rows, least_ratios, ratios_for_centers
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.frames import apply, inverse, require_transform
from footfall.robot.model import Robot


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
    """Ratios as :func:`footfall.balance.torques.torque_check` gives with ``leg`` down in each of many postures.

    Args:
        robot: the rover.
        posture: joint angles of the other legs, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the other standing legs, k of them.
        normals: (k, 3) of the ground under those, in site.
        leg: number of the leg, from 0.
        qs_leg: (n, 6) angles of that leg [rad].
        leg_normals: (n, 3) of the ground under it, in site.
        settings: friction, gravity and payload.

    Returns:
        (n,); NaN for a row with NaN, inf where a normal does not point up, against gravity, or no forces hold the
        rover.

    Raises:
        InvalidInput: the legs or the shapes don't fit.
        FootFallError: a program for the forces was not solved, which is a defect.
    """
    qs, toward = np.asarray(qs_leg, float), np.asarray(leg_normals, float)
    if qs.ndim != 2 or qs.shape[1] != 6 or toward.shape != (len(qs), 3):
        raise InvalidInput("each posture of the leg needs six angles and one normal", shape=list(qs.shape))
    T_site_base = require_transform(T_site_base, "T_site_base")
    others = StandingLegs(robot, posture, T_site_base, legs, normals, leg, settings)
    R_level_base, limits = others.R_level_base, robot.torque_limits.reshape(-1, 6)
    with np.errstate(invalid="ignore", divide="ignore"):
        own_unit = toward / np.linalg.norm(toward, axis=1, keepdims=True)
    origins, rotations = leg_links(robot, leg, qs)
    outward = rotations[:, 5, :, 0]
    centers = origins[:, 5] + robot.description.legs[leg].foot * outward
    own = lowest_rim_points(centers, rotations[:, 5, :, 1], outward, own_unit @ T_site_base[:3, :3], robot.wheel_radius)
    own_J = np.cross(joint_axes(rotations), own[:, None] - origins).transpose(0, 2, 1)
    own_share = gravity_torques(robot, leg, qs, R_level_base[2], settings.gravity) / limits[leg]

    level_unit = settings.level(own_unit)
    ratios = np.empty(len(qs))
    status = least_ratios(
        others.contacts,
        others.faces,
        others.effect,
        others.constant,
        own @ R_level_base.T,
        level_unit,
        _effect(R_level_base, own_J, limits[leg], others.weight),
        own_share,
        others.centers(qs),
        others.size,
        settings.friction,
        ratios,
    )
    if (status == UNFINISHED).any():
        raise FootFallError("a torque program was not solved")
    ratios[level_unit[:, 2] <= 0] = np.inf
    return np.maximum(ratios, others.idle)


def torque_ratios_in_the_air(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    normals: ArrayLike,
    leg: int,
    qs_leg: ArrayLike,
    settings: BalanceSettings,
) -> Array:
    """Ratios as :func:`footfall.balance.torques.torque_check` gives with ``leg`` in the air in each posture.

    Args:
        robot: the rover.
        posture: joint angles of the other legs, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the standing legs, k of them.
        normals: (k, 3) of the ground under those, in site.
        leg: number of the leg, from 0.
        qs_leg: (n, 6) angles of that leg [rad].
        settings: friction, gravity and payload.

    Returns:
        (n,); inf where no forces hold the rover.

    Raises:
        InvalidInput: the legs don't fit.
    """
    qs = np.asarray(qs_leg, float)
    others = StandingLegs(robot, posture, T_site_base, legs, normals, leg, settings)
    return np.maximum(others.ratios(others.centers(qs)), others.hanging(qs))


class StandingLegs:
    """What the legs that stand besides ``leg`` put into the programs of all its postures; read only.

    R_level_base: (3, 3), base turned level; contacts: (k, 3) there [m]; faces, effect, constant: see least_ratio.
    weight: of the loaded rover [N]; size: of the stance [m]; idle: the largest ratio of the legs that neither stand nor
    are ``leg``. Raises InvalidInput where the legs don't fit.
    """

    def __init__(
        self,
        robot: Robot,
        posture: ArrayLike,
        T_site_base: ArrayLike,
        legs: Sequence[int],
        normals: ArrayLike,
        leg: int,
        settings: BalanceSettings,
    ) -> None:
        T_site_base = require_transform(T_site_base, "T_site_base")
        leg, standing = robot.require_leg(leg), [robot.require_leg(one) for one in legs]
        if len({leg, *standing}) != len(standing) + 1:
            raise InvalidInput("a leg stands only once among the supporting legs", legs=[*standing, leg])
        unit = unit_normals(np.asarray(normals, float).reshape(-1, 3))
        if len(unit) != len(standing):
            raise InvalidInput("each supporting leg needs one normal", legs=len(standing), normals=len(unit))
        self._robot, self._leg, self._settings = robot, leg, settings
        self._rest = moment_without(robot, posture, leg)
        statics = PostureStatics(robot, posture)
        self.R_level_base = settings.R_level_site @ T_site_base[:3, :3]
        limits = robot.torque_limits.reshape(-1, 6)
        mass, _ = loaded(robot, statics.com, settings)
        self.weight = mass * settings.gravity
        contacts_base = apply(inverse(T_site_base), statics.contacts(standing, unit, T_site_base))
        shares = statics.gravity_torques(self.R_level_base[2], settings.gravity).reshape(-1, 6) / limits
        J = statics.contact_jacobians(standing, contacts_base)
        self.contacts = contacts_base @ self.R_level_base.T
        self.faces = facets(settings.level(unit), settings.friction, settings.sides)
        self.effect, self.constant = _effect(self.R_level_base, J, limits[standing], self.weight), shares[standing]
        self.size = max(float(np.abs(contacts_base - statics.com).max(initial=0.0)), 1.0)
        in_the_air = [other for other in robot.legs if other not in (leg, *standing)]
        self.idle = float(np.abs(shares[in_the_air]).max(initial=0.0))

    def centers(self, qs: Array) -> Array:
        """Centres of mass of the loaded rover with the leg at qs (n, 6) [rad], in base turned level, (n, 3) [m]."""
        _, coms = loaded(self._robot, centers_with(self._robot, self._leg, self._rest, qs), self._settings)
        return coms @ self.R_level_base.T

    def ratios(self, coms: Array) -> Array:
        """Least ratios (k,) of the standing legs alone for centres of mass (k, 3); inf where no forces hold them."""
        ratios = np.empty(len(coms))
        if not ratios_for_centers(self.contacts, self.faces, self.effect, self.constant, coms, ratios):
            raise FootFallError("a torque program was not solved")
        return ratios

    def hanging(self, qs: Array) -> Array:
        """Largest ratio of the legs in the air, the moving one at qs (n, 6) among them, (n,)."""
        torques = gravity_torques(self._robot, self._leg, qs, self.R_level_base[2], self._settings.gravity)
        limits = self._robot.torque_limits.reshape(-1, 6)[self._leg]
        return np.maximum(np.abs(torques / limits).max(axis=1), self.idle)

    def worst(self, qs: Array) -> tuple[int, float]:
        """Which of the ratios of :func:`torque_ratios_in_the_air` is largest at qs (n, 6), and that ratio.

        What the standing legs need is the value of a linear program whose right-hand side is linear in the horizontal
        place of the centre of mass: its height adds no moment to a vertical weight. Such a value is convex (S. Boyd,
        L. Vandenberghe, *Convex Optimization*, 2004, §5.6.1), so it is largest at a corner of the places' convex hull,
        and only those are solved.
        """
        coms = self.centers(qs)
        places = np.ascontiguousarray(coms[:, :2])
        corners = hull_rows(places, np.lexsort((places[:, 1], places[:, 0])))
        ratios = self.hanging(qs)
        ratios[corners] = np.maximum(ratios[corners], self.ratios(coms[corners]))
        worst = int(np.argmax(ratios))
        return worst, float(ratios[worst])


def _effect(R_level_base: Array, J: Array, limits: Array, weight: float) -> Array:
    """Ratios of a leg's joints by the force on its foot, in weights and level, (…, 6, 3), from J (…, 3, 6) in base."""
    return np.ascontiguousarray(np.swapaxes(-weight * (R_level_base @ J), -1, -2) / np.expand_dims(limits, -1))
