"""Where commands bring a robot that others described: feet that stand carry the chassis, a leg moves its own foot.

The robot is taken as rigid, and a foot stays on the ground where it was put, as in the planner.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.footing import rest
from footfall.planning.legged.step import FEET_OFF
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import Command
from footfall.sequence.passage import fitted
from footfall.terrain.dem import Dem

FEWEST_FEET = 3
"""Fewer don't say where the chassis is."""


@dataclass(frozen=True)
class LeggedPassage:
    """One row. before, after: postures (joints,); T_before, T_after: T_site_base (4, 4).

    stood: (legs, 3) soles' centres in site where they stand when it begins; NaN for legs in the air. feet: those that
    stand through it, with contacts and normals of the ground.
    """

    before: Array
    after: Array
    T_before: Array
    T_after: Array
    stood: Array
    feet: Feet


def asked_for(robot: LeggedRobot, posture: Array, command: Command) -> Array:
    """The posture that a command asks for.

    Args:
        robot: the robot.
        posture: before, (joints,) [rad or m].
        command: of one leg, or of all.

    Returns:
        (joints,) [rad or m]; unchanged where it moves nothing or is not well formed.
    """
    own = robot.layout.moved(command.kind, command.leg)
    joints = command.joints
    if joints is None or len(joints) != own.stop - own.start or not np.isfinite(joints).all():
        return posture
    asked = posture.copy()
    asked[own] = joints
    return asked


def legged_passages(
    robot: LeggedRobot, start: Array, T_site_base: Array, commands: tuple[Command, ...], dem: Dem
) -> list[LeggedPassage]:
    """How each row goes.

    Args:
        robot: the robot.
        start: posture before the first, (joints,) [rad or m].
        T_site_base: pose of the chassis before the first, (4, 4).
        commands: the rows.
        dem: the ground, in site.

    Returns:
        One for each row.
    """
    rows: list[LeggedPassage] = []
    posture, T = np.asarray(start, float), np.asarray(T_site_base, float)
    stood, contacts, normals = (np.full((len(robot.legs), 3), np.nan) for _ in range(3))

    def put_down(legs: list[int]) -> None:
        for leg, foot in zip(legs, landed(robot, dem, posture, T, legs), strict=True):
            stood[leg], contacts[leg], normals[leg] = foot

    put_down(list(robot.legs))
    for command in commands:
        after = asked_for(robot, posture, command)
        down = [leg for leg in robot.legs if np.isfinite(stood[leg]).all() and leg != command.leg]
        T_after = chassis_on(robot, after, stood, down, T) if command.kind.moves_all else T
        feet = Feet(tuple(down), contacts.copy(), normals.copy())
        rows.append(LeggedPassage(posture, after, T, T_after, stood.copy(), feet))
        posture, T = after, T_after
        put_down([leg for leg in robot.legs if leg == command.leg or (command.kind.moves_all and leg not in down)])
    return rows


def landed(
    robot: LeggedRobot, dem: Dem, posture: Array, T_site_base: Array, legs: Sequence[int]
) -> list[tuple[Array, Array, Array]]:
    """Whether feet stand on the ground as the robot is.

    Args:
        robot: the robot.
        dem: the ground, in site.
        posture: now, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs that are asked about.

    Returns:
        For each leg the centre of its sole, NaN where that is farther than FEET_OFF from the ground; contact and normal
        of the ground under it; (3,) each, in site [m].
    """
    soles = apply(T_site_base, placed(robot, posture).soles)
    found: list[tuple[Array, Array, Array]] = []
    for leg in legs:
        x, y, z = (float(part) for part in soles[leg])
        down = rest(dem, x, y, float(robot.radii[leg]))
        stands = abs(z - down.center[2]) <= FEET_OFF
        found.append((soles[leg] if stands else np.full(3, np.nan), down.contact, down.normal))
    return found


def chassis_on(robot: LeggedRobot, posture: Array, stood: Array, down: Sequence[int], T: Array) -> Array:
    """Pose of the chassis that leaves the soles of the legs that stand nearest to where they stood.

    Args:
        robot: the robot.
        posture: now, (joints,) [rad or m].
        stood: where the soles stood, (legs, 3) in site [m].
        down: numbers of the legs that stand.
        T: pose of the chassis so far, (4, 4).

    Returns:
        T_site_base, (4, 4); ``T`` where fewer than three stand.
    """
    if len(down) < FEWEST_FEET:
        return T
    return fitted(placed(robot, posture).soles, stood, down)[0]
