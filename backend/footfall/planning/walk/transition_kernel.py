"""FIND-TRANSITION: a pose of the chassis from which one foot can be moved while all others stand. Compiled.

After Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006), which samples poses around
a nominal one and repairs them; here the repair is an evolution strategy (1 + 1) with the one-fifth rule (Rechenberg,
"Evolutionsstrategie", 1973) on what the legs and the balance lack, since the inverse kinematics is closed-form.
"""

import math
from typing import NamedTuple

import numpy as np

from footfall.balance.support_kernel import margin_of_feet
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
from footfall.planning.walk.legs_kernel import UNREACHED, Feet, LegsTables, leg_at, legs_at, pose_of

IGNORED, PREFERRED, REQUIRED = 0, 1, 2
"""What the conservative support polygon counts for."""
PENALTY = 100.0
"""Of each metre or radian that is lacked."""
ROOM, ROOM_WEIGHT = 0.08, 4.0
"""Spare that is still worth more [m, rad], and what each metre of it is worth."""
SIZES = np.array([0.2, 0.2, 0.25, 0.15, 0.15, 0.25])
"""Distances from the pose aimed at that cost one: x, y, z [m], roll, pitch, yaw [rad]."""
NEAREST = 0.2
"""What two bodies that are too near lack counts up to this [m]."""
SPREAD, LEAST_SPREAD = 0.3, 0.01
"""Of the first change and of the last, as shares of SIZES."""
GROWS, SHRINKS = 1.5, 0.9


class Balance(NamedTuple):
    """support: IGNORED, PREFERRED or REQUIRED; least: margin that is asked for [m]."""

    support: int
    least: float


class Move(NamedTuple):
    """One foot's: leg, or −1 where none moves; where its wheel is to stand, T_site_wheel (3, 4), and on which branch.

    lift: how high it goes straight up before and comes down after [m]; contacts: (legs, 3) of all feet before.
    Arrays are read-only, as a Stance has them: what takes a Move is compiled anew for arrays of another kind.
    """

    leg: int
    T_site_wheel: Array
    branch: int
    lift: float
    contacts: Array


@njit()
def _spare_to_rise(
    T: Array, T_site_wheel: Array, branch: int, move: Move, legs: LegsTables, raised: Array, q: Array
) -> float:
    """What the leg has to spare with its wheel straight above where it stands."""
    raised[:] = T_site_wheel
    raised[2, 3] += move.lift
    return leg_at(T, raised, branch, move.leg, legs, q)


@njit()
def margin_without(contacts: Array, leg: int, com: Array, support: int) -> float:
    """Margin of a centre of mass to the polygon of all feet but ``leg`` (−1: of all), [m]; conservative if REQUIRED."""
    feet = len(contacts) - (leg >= 0)
    x, y, at = np.empty(feet), np.empty(feet), 0
    for i in range(len(contacts)):
        if i != leg:
            x[at], y[at] = contacts[i, 0], contacts[i, 1]
            at += 1
    return margin_of_feet(x, y, com[0], com[1], int(support == REQUIRED))


@njit()
def _balance_lacks(q: Array, T: Array, move: Move, rover: RoverTables, balance: Balance, poses: Array) -> float:
    """What the margin lacks while the leg is off the ground in posture q [m]; preferred: a fifth of it counts."""
    place_rover(q, T, rover, poses)
    com = np.array(center_of_mass(poses, T, rover))
    plain = 0 if balance.support == PREFERRED else balance.support
    lacks = max(balance.least - margin_without(move.contacts, move.leg, com, plain), 0.0)
    if balance.support == PREFERRED and lacks == 0.0:
        lacks = -min(margin_without(move.contacts, move.leg, com, REQUIRED) - balance.least, 0.0)
        return -min(lacks, 1.0)
    return min(lacks, 10.0)


@njit()
def transition_cost(
    vector: Array,
    aim: Array,
    feet: Feet,
    move: Move,
    legs: LegsTables,
    rover: RoverTables,
    balance: Balance,
    most: float,
) -> tuple[float, float]:
    """What a chassis at ``vector`` (6,) lacks for the foot move [m, rad], and what it costs; see ``find_pose``.

    most: a cost from which on it is no matter how much more: nothing more is asked once it costs that. What is asked
    later only adds to a cost, and rounding keeps the order of sums, so that no pose is taken for dearer than it is.
    """
    cost = 0.0
    for k in range(6):
        cost += ((vector[k] - aim[k]) / SIZES[k]) ** 2
    if cost - ROOM_WEIGHT * ROOM >= most:
        return np.inf, cost - ROOM_WEIGHT * ROOM
    T, q, after = np.empty((3, 4)), np.empty(6 * len(legs.lengths)), np.empty(6)
    above = np.empty((2, 6))
    spares = np.empty(len(legs.lengths))
    pose_of(vector, T)
    least, spare = legs_at(T, feet, legs, q, spares), np.inf
    if move.leg >= 0:
        raised = np.empty((3, 4))
        for put in range(2):
            T_site_wheel = move.T_site_wheel if put else feet.Ts_site_wheel[move.leg]
            branch = move.branch if put else feet.branches[move.leg]
            spare = min(spare, _spare_to_rise(T, T_site_wheel, branch, move, legs, raised, above[put]))
        spare = min(spare, leg_at(T, move.T_site_wheel, move.branch, move.leg, legs, after))
    lacks = max(-spare, 0.0)
    for one in spares:
        lacks += max(-one, 0.0)
    if min(least, spare) < -UNREACHED:
        return lacks, cost + PENALTY * (lacks + 2.0)
    room = min(least, spare, ROOM)
    if _cost(cost, lacks, 0.0, room) >= most:
        return lacks, _cost(cost, lacks, 0.0, room)
    poses, standing = np.empty((7 * len(legs.lengths), 3, 4)), np.full(len(legs.lengths), STANDING)
    preferred = near = 0.0
    for put in range(1 + (move.leg >= 0)):
        if put:
            q[6 * move.leg : 6 * move.leg + 6] = after
        lacking = _balance_lacks(q, T, move, rover, balance, poses)
        lacks += max(lacking, 0.0)
        preferred += max(-lacking, 0.0)
        so_far = _cost(cost, lacks + near, preferred, room)
        if so_far >= most:
            return lacks + near, so_far
        if lacks == 0.0:
            near += min(max(-first_too_near(poses, T, standing, 0.0, rover)[1], 0.0), NEAREST)
        if lacks == 0.0 and move.leg >= 0:
            own = slice(6 * move.leg, 6 * move.leg + 6)
            q[own] = above[put]
            place_rover(q, T, rover, poses)
            standing[move.leg] = LIFTED
            near += min(max(-first_too_near(poses, T, standing, 0.0, rover)[1], 0.0), NEAREST)
            standing[move.leg] = STANDING
    # two bodies too near count less than a leg that does not reach, so that these are mended first
    lacks += near
    return lacks, _cost(cost, lacks, preferred, room)


@njit(inline="always")
def _cost(away: float, lacks: float, preferred: float, room: float) -> float:
    return away + PENALTY * lacks + 10.0 * preferred - ROOM_WEIGHT * room


@njit()
def find_pose(
    guesses: Array,
    aim: Array,
    feet: Feet,
    move: Move,
    legs: LegsTables,
    rover: RoverTables,
    balance: Balance,
    rng: np.random.Generator,
    looks: int,
    best: Array,
) -> float:
    """Write the best chassis pose found, (6,): x, y, z [m], roll, pitch, yaw [rad]; returns what it lacks, 0 is good.

    guesses: (n, 6) to begin with; aim: (6,) what it is to be near. looks: how many poses are looked at.
    """
    lacks, cost = np.inf, np.inf
    for i in range(len(guesses)):
        guess = guesses[i]
        found = transition_cost(guess, aim, feet, move, legs, rover, balance, cost)
        if found[1] < cost:
            lacks, cost = found
            best[:] = guess
    spread, tried = SPREAD, np.empty(6)
    for look in range(looks):
        if spread < LEAST_SPREAD or (look > looks // 2 and lacks > 0.3):
            break
        for k in range(6):
            tried[k] = best[k] + spread * SIZES[k] * rng.standard_normal()
        found = transition_cost(tried, aim, feet, move, legs, rover, balance, cost)
        if found[1] < cost:
            lacks, cost = found
            best[:] = tried
            spread = min(spread * GROWS, 1.0)
        else:
            spread *= SHRINKS
    return lacks


@njit()
def vector_of(T: Array) -> Array:
    """x, y, z [m], roll, pitch, yaw [rad] of a chassis pose (3, 4): backwards ``pose_of``."""
    pitch = -math.asin(min(max(T[2, 0], -1.0), 1.0))
    return np.array([T[0, 3], T[1, 3], T[2, 3], math.atan2(T[2, 1], T[2, 2]), pitch, math.atan2(T[1, 0], T[0, 0])])
