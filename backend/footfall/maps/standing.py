"""Which wheels stand on the ground, where they touch it, and how far the others are from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.frames import apply
from footfall.robot.description import link_name
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

Array = NDArray[np.float64]

STANDING_GAP = 0.05
"""A wheel stands on the ground when some of it is within this of it [m].

Reconstructed heights are good to a few centimetres; a foot that is being lifted is soon farther off."""

LOWEST_PART = 0.02
"""This much of the rim's height counts as its lowest part [m]."""

_DISC = np.array([(r * np.cos(a), r * np.sin(a)) for r in (0.25, 0.5, 0.75, 1.0) for a in np.pi / 8 * np.arange(16)])
"""Places in a disc of radius 1."""

_ROUNDS = 12
"""Most corrections of a contact by the normal of the ground there; on even ground one is enough."""
_SETTLED = 1e-9


@dataclass(frozen=True)
class Contacts:
    """Where the wheels of k legs touch the ground, or would if they were down on it.

    points: (k, 3), the lowest rim points along the ground's normals, site [m]; normals: (k, 3) upward;
    seen: (k,), whether the ground there is known; where not, the normal is taken as vertical.
    """

    points: Array
    normals: Array
    seen: NDArray[np.bool_]


def contacts(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int]) -> Contacts:
    """The contacts of some wheels; no wheel is asked whether it is down.

    The contact lies where the wheel is lowest along the normal that the ground has at the contact: on a slope that is
    not the point lowest in height, but up to a wheel's radius times the slope uphill of it.
    """
    normals = np.tile((0.0, 0.0, 1.0), (len(legs), 1))
    seen = np.zeros(len(legs), bool)
    points = _lowest(robot, posture, T_site_base, legs, normals)
    for _ in range(_ROUNDS):
        found = normal_at(dem, points[:, 0], points[:, 1], robot.wheel_radius)
        seen = np.asarray(np.isfinite(found).all(axis=1))
        normals = np.where(seen[:, None], found, (0.0, 0.0, 1.0))
        before, points = points, _lowest(robot, posture, T_site_base, legs, normals)
        if np.abs(points - before).max(initial=0.0) <= _SETTLED:
            break
    return Contacts(points, normals, seen)


def wheel_gaps(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int]) -> Array:
    """Least height of a wheel's rim over the ground below it, (k,) [m]; negative: under it, NaN: all unknown.

    Cameras hardly ever see the ground under a standing wheel. Where it is unknown under the lowest part of the rim, it
    is taken to be as high as the highest known ground within a wheel's radius, but no higher than the rim.
    """
    gaps = np.full(len(legs), np.nan)
    poses = link_poses(robot, posture)
    for i, leg in enumerate(legs):
        rims = np.asarray(robot.description.meshes[link_name(leg, "wheel")].vertices)
        # between the two rims the tread's middle
        points = apply(np.asarray(T_site_base) @ poses[link_name(leg, "wheel")], np.vstack([rims, rims * (1, 0, 1)]))
        above = points[:, 2] - height_at(dem, points[:, 0], points[:, 1])
        lowest = points[np.argmin(points[:, 2])]
        if not np.isfinite(above[points[:, 2] <= lowest[2] + LOWEST_PART]).any():
            disc = robot.wheel_radius * _DISC
            around = height_at(dem, lowest[0] + disc[:, 0], lowest[1] + disc[:, 1])
            if np.isfinite(around).any():
                above = np.append(above, max(lowest[2] - np.nanmax(around), 0.0))
        if np.isfinite(above).any():
            gaps[i] = np.nanmin(above)
    return gaps


def standing(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int]) -> list[int]:
    """Those of some legs whose wheels stand, or are over ground that nobody saw."""
    gaps = wheel_gaps(robot, dem, posture, T_site_base, legs)
    return [leg for leg, gap in zip(legs, gaps, strict=True) if not gap > STANDING_GAP]


def _lowest(robot: Robot, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int], normals: Array) -> Array:
    found = [contact_point(robot, posture, leg, T_site_base, normal) for leg, normal in zip(legs, normals, strict=True)]
    return np.array(found).reshape(-1, 3)
