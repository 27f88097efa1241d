"""By how much a link is in what it collides with, and that in words: for reports, after a collision was found."""

from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.collision import TERRAIN, Collision
from footfall.robot.meshes.depth import overlap
from footfall.robot.meshes.ground import surface_points
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

SPACING = 0.01
"""How densely the link's surface is compared with the ground [m]."""


class Met(NamedTuple):
    """A collision.

    depth: how deep the rover is in what it hits [m]; negative: how far from it. missed: by how much the distance is
    less than what is required [m].
    """

    hit: Collision
    depth: float
    missed: float


def worst(hits: list[Collision], robot: Robot, dem: Dem, posture: Array, T_site_base: Array, lift: float = 0.0) -> Met:
    """Of what the rover collides with, at least one thing, what misses most that is required.

    Args:
        hits: the collisions.
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        lift: by how much the ground is raised [m].

    Returns:
        That collision, and how deep it is.
    """
    found = []
    for hit in hits:
        depth = _depth(hit, robot, dem, posture, T_site_base, lift)
        # a wheel that touches needs no distance but may sink
        missed = depth + (hit.required or -robot.description.clearances.wheel_sink)
        found.append(Met(hit, depth, missed))
    return max(found, key=lambda one: one.missed)


def _depth(hit: Collision, robot: Robot, dem: Dem, posture: Array, T_site_base: Array, lift: float) -> float:
    if hit.distance != 0:
        return -hit.distance
    if hit.link_b != TERRAIN:
        return overlap(robot, posture, hit.link_a, hit.link_b)
    return _sunk(robot, dem, posture, T_site_base, hit.link_a, lift)


def in_words(met: Met, robot: Robot, what: str) -> str:
    """What a link collides with, and by how much. what: the name of the other thing."""
    hit, depth = met.hit, met.depth
    needed = f"{hit.required:z.3f} m must stay clear"
    if hit.distance < 0:
        return f"{hit.link_a} is {depth:z.3f} m below {what}"
    if hit.distance > 0:
        distance, required = beside(hit.distance, hit.required)
        return f"{hit.link_a} is {distance} m from {what}, {required} m is needed"
    if hit.link_b != TERRAIN:
        # of the hulls: the meshes may be a little less deep in each other
        return f"{hit.link_a} cuts up to {depth:z.3f} m into {what} ({needed})"
    deep = f"{depth:z.3f}"
    if hit.required == 0:
        deep, allowed = beside(depth, robot.description.clearances.wheel_sink)
        needed = f"{allowed} m is allowed"
    return f"{hit.link_a} cuts {deep} m into {what} ({needed})"


def _sunk(robot: Robot, dem: Dem, posture: Array, T_site_base: Array, link: str, lift: float) -> float:
    """How far the deepest place of a link's surface is straight below the ground raised by ``lift`` [m].

    0 where none is, or the ground there is unknown. posture: (legs × 6,) [rad].
    """
    surface = surface_points(robot.description.meshes[link], SPACING)
    points = apply(T_site_base @ link_poses(robot, posture)[link], surface)
    depth = height_at(dem, points[:, 0], points[:, 1]) + lift - points[:, 2]
    return max(float(np.max(np.where(np.isfinite(depth), depth, 0.0))), 0.0)
