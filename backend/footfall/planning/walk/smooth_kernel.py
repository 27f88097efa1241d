"""A better pose of the chassis for a foot move that has one: compiled.

The evolution strategy is that of ``find_pose``, on what smoothing lowers, over poses that lack nothing.
"""

import math
from typing import NamedTuple

import numpy as np

from footfall.balance.held_kernel import held_ratio
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.planning.scene.rover_kernel import (
    LIFTED,
    STANDING,
    RoverTables,
    center_of_mass,
    first_too_near,
    place_rover,
)
from footfall.planning.walk.body_kernel import Checks
from footfall.planning.walk.legs_kernel import Feet, LegsTables, leg_at, legs_at, pose_of
from footfall.planning.walk.transition_kernel import (
    GROWS,
    LEAST_SPREAD,
    PREFERRED,
    SHRINKS,
    SPREAD,
    Move,
    margin_without,
    transition_cost,
)

ROOMY_MARGIN = 0.3
"""Margin of the centre of mass beyond the least, up to which more is worth having [m]."""
ROOMY = 0.05
"""The same of clearances between parts of the rover, and of what legs have to spare [m, rad]."""
OFF_HEIGHT = 0.25
"""How far off the height wanted the weight for it is meant [m]."""
METRES_A_RADIAN = 1.2
"""A turn of the chassis by so much counts as so many metres of its way."""


class Weights(NamedTuple):
    """What poses are weighed with: see ``Smoothing``; height: of the chassis above its feet that is wanted [m].

    roomy: the rover's tables with clearances between its own parts larger by ROOMY.
    """

    way: float
    torque: float
    margin: float
    clearance: float
    nominal: float
    height: float
    roomy: RoverTables


class MoveInWalk(NamedTuple):
    """A foot move, or nobody's at the end, and what is about it.

    before, after: poses of the chassis (6,); normals: (legs, 3) of the ground under the feet.
    """

    before: Array
    after: Array
    feet: Feet
    normals: Array
    move: Move


class Measures(NamedTuple):
    """What the cost of a pose is computed with."""

    legs: LegsTables
    checks: Checks
    weights: Weights


@njit()
def way_between(one: Array, other: Array) -> float:
    """How long the chassis' way between two poses (6,) is, a turn counting as METRES_A_RADIAN [m]."""
    far = turn = 0.0
    for k in range(3):
        far += (other[k] - one[k]) ** 2
        by = (other[k + 3] - one[k + 3] + math.pi) % (2.0 * math.pi) - math.pi
        turn += by * by
    return math.sqrt(far) + METRES_A_RADIAN * math.sqrt(turn)


@njit()
def short_of(size: float, wanted: float) -> float:
    """How much is short of what is wanted, as a share, squared."""
    return max(1.0 - max(size, 0.0) / wanted, 0.0) ** 2


@njit()
def off_height(vector: Array, contacts: Array, height: float) -> float:
    """How far a chassis (6,) is from a height above its feet, in OFF_HEIGHT, squared."""
    return ((vector[2] - contacts[:, 2].mean() - height) / OFF_HEIGHT) ** 2


@njit()
def tightness(
    vector: Array, feet: Feet, normals: Array, move: Move, legs: LegsTables, checks: Checks, roomy: RoverTables
) -> tuple[float, float, float]:
    """How near its limits a rover is with its chassis at ``vector`` (6,), at five moments of a foot's move.

    Returned are the largest share of a torque limit, an upper bound; the least margin beyond what is asked for [m]; and
    what legs and clearances have to spare, at most ROOMY [m, rad]. normals: (legs, 3) of the ground under the feet.
    """
    count = len(legs.lengths)
    T, q, spares, above = np.empty((3, 4)), np.empty(6 * count), np.empty(count), np.empty((5, 6))
    poses, standing, held = np.empty((7 * count, 3, 4)), np.full(count, STANDING), np.ones(count, np.bool_)
    pose_of(vector, T)
    room = legs_at(T, feet, legs, q, spares)
    support = 0 if checks.balance.support == PREFERRED else checks.balance.support
    if move.leg >= 0:
        raised = np.empty((3, 4))
        own = slice(6 * move.leg, 6 * move.leg + 6)
        held[move.leg] = False
        above[0] = q[own]
        room = min(room, leg_at(T, move.T_site_wheel, move.branch, move.leg, legs, above[4]))
        for put in range(2):
            raised[:] = move.T_site_wheel if put else feet.Ts_site_wheel[move.leg]
            raised[2, 3] += move.lift
            branch = move.branch if put else feet.branches[move.leg]
            room = min(room, leg_at(T, raised, branch, move.leg, legs, above[1 + 2 * put]))
        # a swing is mostly a straight line of joints
        above[2] = 0.5 * (above[1] + above[3])
    torque, margin = 0.0, np.inf
    for k in range(len(above) if move.leg >= 0 else 1):
        if move.leg >= 0:
            q[own] = above[k]
            standing[move.leg] = LIFTED if 0 < k < 4 else STANDING
        place_rover(q, T, checks.rover, poses)
        com = np.array(center_of_mass(poses, T, checks.rover))
        margin = min(margin, margin_without(move.contacts, move.leg, com, support) - checks.balance.least)
        torque = max(torque, held_ratio(poses, T, move.contacts, normals, held, checks.held)[0])
        room = min(room, ROOMY + first_too_near(poses, T, standing, 0.0, roomy)[1])
    return torque, margin, min(room, ROOMY)


@njit()
def _pose_cost(vector: Array, at: MoveInWalk, measures: Measures, most: float) -> float:
    """What a pose (6,) costs between that before and that after; inf where it lacks anything or costs ``most``."""
    feet, move, legs, checks, weights = at.feet, at.move, measures.legs, measures.checks, measures.weights
    cost = weights.way * (way_between(at.before, vector) + way_between(vector, at.after))
    cost += weights.nominal * off_height(vector, move.contacts, weights.height)
    if cost >= most or transition_cost(vector, vector, feet, move, legs, checks.rover, checks.balance, np.inf)[0] > 0.0:
        return np.inf
    torque, margin, room = tightness(vector, feet, at.normals, move, legs, checks, weights.roomy)
    if not torque <= checks.most_torque:
        return np.inf
    cost += weights.torque * torque**4 + weights.margin * short_of(margin, ROOMY_MARGIN)
    return cost + weights.clearance * short_of(room, ROOMY)


@njit()
def better_pose(
    now: Array,
    guesses: Array,
    sizes: Array,
    at: MoveInWalk,
    measures: Measures,
    rng: np.random.Generator,
    looks: int,
    best: Array,
) -> float:
    """Write a pose of the chassis (6,) that costs less than ``now``; returns by how much, 0 where none was found.

    guesses: (n, 6) to look at first; sizes: (6,) of changes [m, rad], 0: none of that number. looks: how many poses
    are looked at.
    """
    first = cost = _pose_cost(now, at, measures, np.inf)
    best[:] = now
    for i in range(len(guesses)):
        guess = guesses[i]
        found = _pose_cost(guess, at, measures, cost)
        if found < cost:
            cost = found
            best[:] = guess
    spread, tried = SPREAD, np.empty(6)
    for _ in range(looks):
        if spread < LEAST_SPREAD:
            break
        for k in range(6):
            tried[k] = best[k] + spread * sizes[k] * rng.standard_normal()
        found = _pose_cost(tried, at, measures, cost)
        if found < cost:
            cost = found
            best[:] = tried
            spread = min(spread * GROWS, 1.0)
        else:
            spread *= SHRINKS
    return first - cost if cost < first else 0.0
