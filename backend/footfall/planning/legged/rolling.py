"""Feet that stand roll: a ball that does not slip goes along as its leg turns, and so does a disc on its rim.

A body that rolls turns about the point where it touches the ground, so its centre moves by ω × r n (D. Montana, "The
kinematics of contact and grasp", Int. Journal of Robotics Research 7(3), 1988). A foot that ends in a point stays.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.planning.legged.footing import rest
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import Placed, legs_to, placed
from footfall.terrain.dem import Dem

ROUNDS = 4
"""How far feet roll depends on where they roll to; in each round what is left of it gets ten times smaller."""


class Stood(NamedTuple):
    """Where feet stand: centres of their soles, contacts and normals of the ground, (legs, 3) each, in site [m]."""

    soles: Array
    contacts: Array
    normals: Array


def foot_turns(robot: LeggedRobot, where: Placed, T_site_base: Array) -> Array:
    """How the bodies that end in feet are turned.

    Args:
        robot: the robot.
        where: its bodies at a posture.
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        (legs, 3, 3), from their frames to site.
    """
    ends = [robot.slices[leg].stop for leg in robot.legs]
    return T_site_base[:3, :3] @ where.Ts_base_body[ends, :3, :3]


def ways_rolled(robot: LeggedRobot, normals: Array, before: Array, after: Array) -> Array:
    """How far the centres of feet go that roll on the ground.

    Args:
        robot: the robot.
        normals: of the ground, (legs, 3) in site.
        before: ``foot_turns`` at first, (legs, 3, 3).
        after: the same at the end, turned by a small angle.

    Returns:
        (legs, 3) in site [m]; NaN where a normal is not known.
    """
    turned = Rotation.from_matrix(after @ before.transpose(0, 2, 1)).as_rotvec()
    return robot.radii[:, None] * np.cross(turned, normals)


def rested(robot: LeggedRobot, dem: Dem, stood: Stood, soles: Array, legs: Sequence[int]) -> Stood:
    """Feet let down where they rolled to.

    Args:
        robot: the robot.
        dem: the ground, in site.
        stood: where they stood.
        soles: centres that they rolled to, (legs, 3) in site [m].
        legs: numbers of those that stand; the others are left as they are.

    Returns:
        Where they stand now; NaN on ground that is not known. Points stand where they stood.
    """
    parts = Stood(*(part.copy() for part in stood))
    for leg in legs:
        if robot.radii[leg] > 0:
            x, y, _ = (float(one) for one in soles[leg])
            parts.soles[leg], parts.contacts[leg], parts.normals[leg] = rest(dem, x, y, float(robot.radii[leg]))
    return parts


def legs_rolled_to(
    robot: LeggedRobot, dem: Dem, q: Array, T_before: Array, T_after: Array, stood: Stood
) -> tuple[Array, Stood]:
    """The posture that carries the chassis a little way on over feet that all stand, and where these roll to.

    Args:
        robot: the robot.
        dem: the ground, in site.
        q: posture before, (joints,) [rad or m].
        T_before: pose of the chassis before, (4, 4).
        T_after: its pose after, (4, 4).
        stood: where the feet stand before.

    Returns:
        (joints,) [rad or m], NaN for a leg whose way leads nowhere, and where the feet stand then.
    """
    there = legs_to(robot, T_after, stood.soles, q)
    if not robot.rolls:
        return there, stood
    before, now = foot_turns(robot, placed(robot, q), T_before), stood
    for number in range(ROUNDS):
        if not np.isfinite(there).all():
            return there, now
        after = foot_turns(robot, placed(robot, there), T_after)
        now = stood._replace(soles=stood.soles + ways_rolled(robot, stood.normals, before, after))
        if number == ROUNDS - 1:
            now = rested(robot, dem, stood, now.soles, robot.legs)
            if not np.isfinite(now.soles).all():
                return there, now
        there = legs_to(robot, T_after, now.soles, q)
    return there, now
