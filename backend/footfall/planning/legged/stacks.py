"""Legs that turn about shared upright axes, the stacks of the Ambler, and where these may be over feet that stand.

A stack's legs reach their feet while it is in a ring about each of them; what all rings of a stack share is its
*reachable space*, as a rule a crescent. The stack goes with the chassis, so it bounds where the chassis may go.

D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int. Conf. on Systems
Engineering, 1990.
"""

from typing import NamedTuple

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.limb.cylindrical import CylindricalLimb

SAME = 1e-6
"""Axes are one where they are nearer than this [m], and upright where they lean by less."""
RING = 72
"""Pieces that stand for a ring where it is drawn."""


class Stack(NamedTuple):
    """axis: in base, (2,) [m]. legs: that turn about it, from below. nearest, farthest: of a foot from the axis [m]."""

    axis: Array
    legs: tuple[int, ...]
    nearest: float
    farthest: float


def stacks_of(robot: LeggedRobot) -> tuple[Stack, Stack]:
    """The two stacks of a robot, the left one first.

    Raises InvalidInput for a robot with a leg that is of none, and unless two stacks carry all legs.
    """
    found: list[tuple[Array, list[int]]] = []
    for leg in robot.legs:
        solver = robot.limbs[leg]
        if not isinstance(solver, CylindricalLimb) or abs(solver.axis[2]) < 1 - SAME:
            raise InvalidInput(
                f"leg {robot.leg_names[leg]} of {robot.name} does not turn about an upright axis, slide out and slide "
                "down, as legs do that pass through the body: plan the walk by the wave",
                leg=leg,
            )
        place = solver.limb.placements[0, :2, 3]
        same = next((legs for axis, legs in found if np.linalg.norm(axis - place) < SAME), None)
        if same is None:
            found.append((place, [leg]))
        else:
            same.append(leg)
    if len(found) != 2 or min(len(legs) for _, legs in found) < 3:
        sizes = ", ".join(str(len(legs)) for _, legs in found)
        raise InvalidInput(f"{robot.name} has stacks of {sizes} legs; two of three or more are needed to pass through")
    left, right = (_stack(robot, axis, legs) for axis, legs in sorted(found, key=lambda one: -one[0][1]))
    return left, right


def _stack(robot: LeggedRobot, axis: Array, legs: list[int]) -> Stack:
    upward = sorted(legs, key=lambda leg: float(robot.limbs[leg].limb.placements[0, 2, 3]))
    radii = np.array([solver.radii for leg in legs if isinstance(solver := robot.limbs[leg], CylindricalLimb)])
    return Stack(axis, tuple(upward), float(radii[:, 0].max()), float(radii[:, 1].min()))


def ring_margins(stack: Stack, soles: Array, places: Array, legs: tuple[int, ...]) -> Array:
    """How far inside its reachable space a stack is at places.

    Args:
        stack: of the robot.
        soles: of all legs, (legs, 3) in site [m].
        places: (n, 2) in site [m].
        legs: numbers of those that stand.

    Returns:
        (n,) [m]; below zero: outside.
    """
    own = [leg for leg in stack.legs if leg in legs]
    away = np.linalg.norm(places[:, None] - soles[own, :2], axis=2)
    return np.minimum(away - stack.nearest, stack.farthest - away).min(axis=1, initial=np.inf)


def crescent(stack: Stack, soles: Array, legs: tuple[int, ...]) -> Array:
    """The rings of a stack that bound its reachable space: pieces of them inside all its other rings.

    Args:
        stack: of the robot.
        soles: of all legs, (legs, 3) in site [m].
        legs: numbers of those that stand.

    Returns:
        Pieces (n, 2, 2) in site [m].
    """
    around = 2 * np.pi * np.arange(RING) / RING
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rims = [
        soles[leg, :2] + size * circle for leg in stack.legs if leg in legs for size in (stack.nearest, stack.farthest)
    ]
    pieces = np.array([np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in rims]).reshape(-1, 2, 2)
    inside = ring_margins(stack, soles, pieces.reshape(-1, 2), legs).reshape(-1, 2) > -SAME
    return pieces[inside.all(axis=1)]
