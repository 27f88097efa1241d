"""Which wheels stand on the ground, where they touch it, and how far the others are from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.description import link_name
from footfall.robot.ik import lowest_rim_point
from footfall.robot.kinematics import link_poses, wheel_pose
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

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
SAME_PLACE = 1e-3
"""Contacts this near to each other are one [m]."""
UPRIGHT = 1e-6
"""A wheel whose leg points along the ground's normal to this stands upright on it."""


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
    not the point lowest in height, but up to a wheel's radius times the slope uphill of it. At an edge of the ground
    there may be several such places: then it is the one that the wheel stands upright on, as a footfall is planned.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the wheels' legs, k of them.

    Returns:
        Points and normals (k, 3) each, in site [m].
    """
    Ts_site_wheel = [np.asarray(T_site_base, float) @ wheel_pose(robot, posture, leg) for leg in legs]
    found = _settled(robot, dem, Ts_site_wheel)
    upright = np.array([-T[:3, 0] for T in Ts_site_wheel]).reshape(-1, 3)
    points = _lowest(robot, Ts_site_wheel, upright)
    doubtful = np.linalg.norm(points - found.points, axis=1) > SAME_PLACE
    if not doubtful.any():
        return found
    normals = normal_at(dem, points[:, 0], points[:, 1], robot.wheel_radius)
    stands = doubtful & (np.linalg.norm(normals - upright, axis=1) <= UPRIGHT)
    rows = stands[:, None]
    return Contacts(np.where(rows, points, found.points), np.where(rows, normals, found.normals), found.seen | stands)


def _settled(robot: Robot, dem: Dem, Ts_site_wheel: Sequence[Array]) -> Contacts:
    """Contacts found beginning with vertical normals."""
    normals = np.tile((0.0, 0.0, 1.0), (len(Ts_site_wheel), 1))
    seen = np.zeros(len(Ts_site_wheel), bool)
    points = _lowest(robot, Ts_site_wheel, normals)
    for _ in range(_ROUNDS):
        found = normal_at(dem, points[:, 0], points[:, 1], robot.wheel_radius)
        seen = np.asarray(np.isfinite(found).all(axis=1))
        normals = np.where(seen[:, None], found, (0.0, 0.0, 1.0))
        before, points = points, _lowest(robot, Ts_site_wheel, normals)
        if np.abs(points - before).max(initial=0.0) <= _SETTLED:
            break
    return Contacts(points, normals, seen)


def wheel_gaps(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: ArrayLike, legs: Sequence[int]) -> Array:
    """Least height of wheels' rims over the ground below them.

    Cameras hardly ever see the ground under a standing wheel. Where it is unknown under the lowest part of the rim, it
    is taken to be as high as the highest known ground within a wheel's radius, but no higher than the rim.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the wheels' legs, k of them.

    Returns:
        Gaps (k,) [m]; negative: the rim is under the ground, NaN: all is unknown.
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
    """Those of some legs whose wheels stand, or are over ground that nobody saw.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs that are asked about.

    Returns:
        Numbers of those that stand, in the same order.
    """
    gaps = wheel_gaps(robot, dem, posture, T_site_base, legs)
    return [leg for leg, gap in zip(legs, gaps, strict=True) if not gap > STANDING_GAP]


def _lowest(robot: Robot, Ts_site_wheel: Sequence[Array], normals: Array) -> Array:
    found = [lowest_rim_point(robot, T, normal) for T, normal in zip(Ts_site_wheel, normals, strict=True)]
    return np.array(found).reshape(-1, 3)
