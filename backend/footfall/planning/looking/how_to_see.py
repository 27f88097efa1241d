"""What shows ground that nobody saw: images from here, or images with a leg lifted that hides it.

A wheel hides the ground around it from every camera. Of a rover on rocks, hardly any of that comes into view from a
chassis that is shifted or turned, nearly all of it with the leg lifted by LIFTED (``benchmarks/looking.py``).
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.looking.in_view import in_view
from footfall.planning.scene.lift import vertical
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between

LIFTED = 0.3
"""So high a leg is lifted straight up to look at what it hides [m]."""
ENOUGH = 0.5
"""Where this share of unknown ground comes into view, images are worth taking."""
NEAREST = 2
"""So many legs are asked whether they hide it, the nearest first."""
MOST = 400
"""Points that are asked about at once: more say no more."""
FROM_HERE = "take images: from here they show it"
"""What to do where they do."""


def how_to_see(robot: Robot, dem: Dem, state: RobotState, place: ArrayLike, radius: float) -> str:
    """What to do to see the unknown ground around a place.

    Nothing is asked of the balance of a rover with a leg lifted: planning that says so.

    Args:
        robot: the rover; it has closed-form legs.
        dem: the ground, in site.
        state: how the rover stands.
        place: (2,) in site [m].
        radius: so far around it [m].

    Returns:
        A clause for a refusal; empty where nothing is unknown there, or nothing is known anywhere near.
    """
    unknown = unknown_around(dem, np.asarray(place, float), radius)
    if len(unknown) == 0:
        return ""
    if in_view(robot, dem, state, unknown).mean() >= ENOUGH:
        return FROM_HERE
    for leg, lifted in islice(_lifted(robot, state, unknown), NEAREST):
        if in_view(robot, dem, lifted, unknown).mean() >= ENOUGH:
            up = f"take images while that leg is {LIFTED:g} m up"
            return f"leg {leg} hides it: {up}, as in a step onto its own place that is sent row by row"
    return "no camera sees it from here: take images from elsewhere"


def unknown_around(dem: Dem, place: Array, radius: float) -> Array:
    """Unknown ground around a place.

    Args:
        dem: the ground, in site.
        place: (2,) in site [m].
        radius: so far around it [m].

    Returns:
        Middles of unknown cells, (n, 3) in site [m], MOST at most, each as high as its highest known neighbour; none
        where no ground is known there at all.
    """
    whole = without_holes_between(dem, place - radius, place + radius, np.zeros((0, 3)))
    if whole is None:
        return np.zeros((0, 3))
    grid = whole.dem.geometry
    near = np.hypot(grid.xs - place[0], (grid.ys - place[1])[:, None]) <= radius
    rows, cols = np.nonzero(near & whole.filled)
    evenly = np.linspace(0, len(rows) - 1, min(len(rows), MOST)).astype(np.int64)
    rows, cols = rows[evenly], cols[evenly]
    return np.column_stack([grid.xs[cols], grid.ys[rows], whole.dem.heights[rows, cols].astype(float)])


def with_leg_up(robot: Robot, state: RobotState, leg: int) -> RobotState | None:
    """How the rover stands with one leg lifted straight up.

    Args:
        robot: the rover; it has closed-form legs.
        state: how it stands.
        leg: number of the leg, from 0.

    Returns:
        That state; None where the leg can't be lifted by LIFTED.
    """
    own = slice(6 * leg, 6 * leg + 6)
    up = vertical(robot, leg, np.asarray(state.T_site_base, float), np.asarray(state.posture, float)[own], LIFTED)
    if isinstance(up, str):
        return None
    posture = np.array(state.posture)
    posture[own] = up[-1]
    return replace(state, posture=posture)


def _lifted(robot: Robot, state: RobotState, unknown: Array) -> Iterator[tuple[int, RobotState]]:
    """How the rover stands with one leg lifted, the leg whose wheel is nearest to the ground first."""
    wheels = apply(np.asarray(state.T_site_base, float), wheel_centers(robot, state.posture))
    away = np.linalg.norm(wheels[:, :2] - unknown[:, :2].mean(axis=0), axis=1)
    for leg in np.argsort(away, kind="stable"):
        lifted = with_leg_up(robot, state, int(leg))
        if lifted is not None:
            yield int(leg), lifted
