"""The motion of one leg from a footfall to the next while the chassis stays: up, over, down; sure all the way.

The swing is a straight line in joint space where that is surely free, else the compiled SBL finds it (Sánchez &
Latombe, "A single-query bi-directional probabilistic roadmap planner with lazy collision checking", 2001).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.joint_path import samples
from footfall.planning.scene.leg_free_kernel import SURE, BodyTables, edge_is_sure, edges_are_sure, first_unsure
from footfall.planning.scene.leg_over_ground import LegOverGround
from footfall.planning.step.search.sbl_kernel import GROWING, JOINED, grow, planted, route
from footfall.planning.step.search.shortcut_kernel import shortened
from footfall.planning.walk.legs_kernel import LegsTables, leg_at
from footfall.robot.proof.leg_clearance_kernel import NO_GROUND, RAISED_GROUND, TRUE_GROUND, LegTables

EPSILON = 0.01
"""Resolution of edges where they are not proven as a whole [rad]."""
RISES = 8
"""Waypoints of a lift after the first."""
HIGHER = (1.0, 1.5, 2.2)
"""Lifts that are tried, as shares of the one asked for: beside a slope the raised ground is near for long."""
LARGEST_TURN = 0.2
"""Of a joint from one waypoint of a lift to the next [rad]; more is a jump."""
MILESTONES, PICKS, RADIUS = 400, 64, 0.4
TRIES = 60
"""Places for shortcuts that are drawn."""


@dataclass(frozen=True)
class Swing:
    """waypoints: (n, 6) from footfall to footfall; the last of the lift and of the swing are at ``up`` and ``down``."""

    waypoints: Array
    up: int
    down: int


def swing(
    T_site_base: Array,
    ends: tuple[Array, Array],
    wheels: tuple[Array, Array],
    branches: tuple[int, int],
    leg: int,
    lift: float,
    legs: LegsTables,
    clearance: LegTables,
    body: BodyTables,
    over_ground: LegOverGround,
    rng: np.random.Generator,
) -> Swing | str:
    """The motion between two postures of a leg on the ground.

    Args:
        T_site_base: pose of the chassis meanwhile, (3, 4).
        ends: postures of the leg, (6,) each [rad].
        wheels: T_site_wheel, (3, 4), at both ends.
        branches: of the inverse kinematics at both ends.
        leg: number of the leg, from 0.
        lift: how high the wheel goes up at both ends [m].
        legs: what the kernels need of all legs.
        clearance: what they need of this leg and what it may touch.
        body: what they need of the chassis and its balance.
        over_ground: asked where a wheel on the ground is not surely free.
        rng: what draws.

    Returns:
        The motion, or the phase that was not found.
    """
    rises = []
    for name, q, T_site_wheel, branch in zip(("lift", "lower"), ends, wheels, branches, strict=True):
        for share in HIGHER:
            up = risen(T_site_base, q, T_site_wheel, branch, leg, share * lift, legs)
            if up is None or first_unsure(up[-1:], clearance, body, RAISED_GROUND) == SURE:
                break
        if up is None or first_unsure(up[-1:], clearance, body, RAISED_GROUND) != SURE:
            return name
        if not (_is_sure(up, clearance, body, TRUE_GROUND) or _is_free(up, clearance, body, over_ground)):
            return name
        rises.append(up)
    start, goal = rises[0][-1], rises[1][-1]
    if edge_is_sure(start, goal, EPSILON, clearance, body, RAISED_GROUND):
        over = np.array([start, goal])
    else:
        trees, outcome = planted(start, goal, MILESTONES), GROWING
        while outcome == GROWING:
            outcome = grow(trees, rng, RADIUS, EPSILON, PICKS, clearance, body, RAISED_GROUND)
        if outcome != JOINED:
            return "swing"
        over = shortened(route(trees), rng, TRIES, EPSILON, clearance, body, RAISED_GROUND)
    waypoints = np.concatenate([rises[0], over[1:], rises[1][-2::-1]])
    return Swing(waypoints, RISES, RISES + len(over) - 1)


def _is_sure(path: Array, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    if first_unsure(path, clearance, body, mode) != SURE:
        return False
    return edges_are_sure(path, EPSILON, clearance, body, mode)


def _is_free(path: Array, clearance: LegTables, body: BodyTables, over_ground: LegOverGround) -> bool:
    """Whether a lift is free by the meshes of the ground, and sure in all else."""
    if not _is_sure(path, clearance, body, NO_GROUND):
        return False
    dense = np.concatenate([[q for _, q in samples(a, b, EPSILON)] for a, b in pairwise(path)])
    return over_ground.collision(dense, 0.0, touching=True) is None


def risen(
    T_site_base: Array, q: Array, T_site_wheel: Array, branch: int, leg: int, lift: float, legs: LegsTables
) -> Array | None:
    """Postures with the wheel going straight up.

    Args:
        T_site_base: pose of the chassis, (3, 4).
        q: posture of the leg where it begins, (6,) [rad].
        T_site_wheel: pose of its wheel there, (3, 4).
        branch: of the inverse kinematics.
        leg: number of the leg, from 0.
        lift: how high [m].
        legs: what the kernels need of all legs.

    Returns:
        (RISES + 1, 6) [rad], or None where it can't.
    """
    out = np.empty((RISES + 1, 6))
    out[0] = q
    T = T_site_wheel.copy()
    for i in range(1, RISES + 1):
        T[2, 3] = T_site_wheel[2, 3] + lift * i / RISES
        leg_at(T_site_base, T, branch, leg, legs, out[i])
        if not np.abs(out[i] - out[i - 1]).max() <= LARGEST_TURN:
            return None
    return out
