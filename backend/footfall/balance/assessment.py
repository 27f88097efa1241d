"""How stably a rover stands, by every measure at once, with legs named by their numbers.

The settings may tilt the site or add a payload: everything is computed in the *level* frame, whose z points against
gravity and whose origin is the site's, see :attr:`footfall.balance.settings.BalanceSettings.R_level_site`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.payload import loaded
from footfall.balance.region import (
    RegionMargin,
    equilibrium_region,
    region_margin,
    regions_without_each,
    require_stance,
    surviving_margin,
)
from footfall.balance.settings import BalanceSettings
from footfall.balance.support import SupportMargin, support_margin
from footfall.balance.tip_over import TipOver, tip_over
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, require_transform
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Assessment:
    """mass [kg] and com: (3,) [m], level, with the payload. Feet and lost legs are leg numbers; edges are level.

    plain, conservative: to the support polygons, which know no friction. region, surviving: to the equilibrium region
    of all feet, and to what is left of it after the loss of any one leg. tipping: the energy stability margin.
    """

    mass: float
    com: Array
    plain: SupportMargin
    conservative: SupportMargin
    region: RegionMargin
    surviving: RegionMargin
    tipping: TipOver


def assess(
    robot: Robot,
    posture: ArrayLike,
    T_site_base: ArrayLike,
    legs: Sequence[int],
    contacts: ArrayLike,
    normals: ArrayLike,
    settings: BalanceSettings,
) -> Assessment:
    """Every margin of a rover that stands on ``legs`` at contacts (k, 3) [m] with normals (k, 3), both in site.

    Raises InvalidInput for numbers that are not finite, legs that don't exist or stand twice, shapes that don't fit,
    and normals that don't point up against gravity. Fewer than three feet are answered, with the reason.
    """
    T_site_base = require_transform(T_site_base, "T_site_base")
    standing = tuple(robot.require_leg(leg) for leg in legs)
    if len(set(standing)) != len(standing):
        raise InvalidInput("a leg stands only once among the supporting legs", legs=list(standing))
    points, unit = require_stance(level(contacts, settings), level(normals, settings))
    if len(points) != len(standing):
        raise InvalidInput("each supporting leg needs one contact", legs=len(standing), contacts=len(points))
    mass, com_base = loaded(robot, center_of_mass(robot, posture), settings)
    com = level(apply(T_site_base, com_base), settings)
    whole = equilibrium_region(points, unit, settings.friction, settings.sides)
    rests = regions_without_each(points, unit, settings.friction, settings.sides)
    return Assessment(
        mass,
        com,
        _of_legs(support_margin(points, com[:2]), standing),
        _of_legs(support_margin(points, com[:2], conservative=True), standing),
        _carried_by(region_margin(whole, com[:2]), standing),
        _carried_by(surviving_margin(rests, com[:2]), standing),
        _about_legs(tip_over(points, com, mass, settings.gravity), standing),
    )


def level(vectors: ArrayLike, settings: BalanceSettings) -> Array:
    """Points or directions (…, 3) of the site in the level frame."""
    turned = np.asarray(vectors, float)
    if turned.shape[-1:] != (3,):
        raise InvalidInput("points and normals need three numbers each", shape=list(turned.shape))
    return turned @ settings.R_level_site.T


def from_level(points_xy: ArrayLike, height: float, settings: BalanceSettings) -> Array:
    """Corners (m, 2) of a polygon in the level frame, moved along gravity onto the site's z = height: (m, 3) [m]."""
    xy = np.asarray(points_xy, float).reshape(-1, 2)
    R = settings.R_level_site
    # z_site = R[0, 2] x + R[1, 2] y + R[2, 2] z, solved for the level z
    z = (height - xy @ R[:2, 2]) / R[2, 2]
    return np.column_stack([xy, z]) @ R


def _of_legs(margin: SupportMargin, legs: tuple[int, ...]) -> SupportMargin:
    feet = None if margin.feet is None else (legs[margin.feet[0]], legs[margin.feet[1]])
    return replace(margin, feet=feet, lost=None if margin.lost is None else legs[margin.lost])


def _carried_by(margin: RegionMargin, legs: tuple[int, ...]) -> RegionMargin:
    lost = None if margin.lost is None else legs[margin.lost]
    return replace(margin, carrying=tuple(legs[foot] for foot in margin.carrying), lost=lost)


def _about_legs(tipping: TipOver, legs: tuple[int, ...]) -> TipOver:
    feet = None if tipping.feet is None else (legs[tipping.feet[0]], legs[tipping.feet[1]])
    return replace(tipping, feet=feet)
