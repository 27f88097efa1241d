"""The chassis moves over feet that all stand: every check at samples so near that nothing between them is missed."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.balance.held_kernel import HeldTables, held_by_some_forces, held_ratio, least_held_ratio
from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.planning.scene.rover_kernel import CLEAR, RoverTables, center_of_mass, first_too_near, place_rover
from footfall.planning.scene.tether_kernel import TetherTables, tether_spare
from footfall.planning.walk.legs_kernel import Feet, LegsTables, between, legs_at, turn_between
from footfall.planning.walk.transition_kernel import PREFERRED, REQUIRED, Balance, margin_without

HOLDS, LEG, MARGIN, TORQUE, NEAR, COARSE, TETHER = range(7)
"""What fails: nothing, a leg's reach, the balance, forces or torques, two bodies too near, samples too far apart, the
way of the tether."""
_TORQUE_EVERY = 4
"""Forces and torques are asked for at every so many samples."""
_LEVERS = np.array([2.1, 1.9, 1.2, 0.8, 0.8, 0.25])
"""No joint of a leg is farther from its wheel's rim [m]."""
DRIFT = 0.001
"""How far a standing wheel may drift between two waypoints [m]; half of what is promised."""


class Checks(NamedTuple):
    """What is checked with: tables of legs on their way, of rover and forces, the balance, the torque that is allowed.

    reaches: (legs × 7,) how far the farthest point of each link is from its origin [m]. gap: how far anything may move
    from one sample to the next [m].
    """

    legs: LegsTables
    rover: RoverTables
    held: HeldTables
    balance: Balance
    most_torque: float
    reaches: Array
    gap: float
    tether: TetherTables


@njit()
def torque_of(
    poses: Array, T: Array, contacts: Array, normals: Array, standing: NDArray[np.bool_], checks: Checks
) -> float:
    """Largest share of a torque limit, at most; the least possible where the cheap bound is not good enough.

    Infinite, too, on a tether where the support must be conservative and nothing holds the rover without some foot.
    """
    ratio = held_ratio(poses, T, contacts, normals, standing, checks.held)[0]
    if not ratio <= checks.most_torque:
        ratio = least_held_ratio(poses, T, contacts, normals, standing, checks.held)
    if ratio <= checks.most_torque and checks.balance.support == REQUIRED and checks.held.tether.shape[0] > 0:
        for leg in np.flatnonzero(standing):
            left = standing.copy()
            left[leg] = False
            # what motors bear without it is not asked, as with a support polygon
            if held_ratio(poses, T, contacts, normals, left, checks.held)[0] < np.inf:
                continue
            if not held_by_some_forces(poses, T, contacts, normals, left, checks.held):
                return np.inf
    return ratio


@njit()
def configuration_fails(
    q: Array, T: Array, contacts: Array, normals: Array, lifted: int, checks: Checks, poses: Array
) -> tuple[int, int, float]:
    """What one configuration fails, with the code of NEAR or TETHER, and by how much; poses are written.

    lifted: the leg about to leave the ground, or that has just come down: it carries nothing; −1: all do.
    """
    place_rover(q, T, checks.rover, poses)
    com = np.array(center_of_mass(poses, T, checks.rover))
    support = 0 if checks.balance.support == PREFERRED else checks.balance.support
    spare = margin_without(contacts, lifted, com, support) - checks.balance.least
    if not spare >= 0.0:
        return MARGIN, 0, spare
    standing = np.ones(len(contacts), np.bool_)
    code, near = first_too_near(poses, T, standing, 0.0, checks.rover)
    if code != CLEAR:
        return NEAR, code, near
    spare, code = tether_spare(poses, T, checks.tether)
    if not spare >= 0.0:
        return TETHER, code, spare
    if lifted >= 0:
        standing[lifted] = False
    ratio = torque_of(poses, T, contacts, normals, standing, checks)
    if not ratio <= checks.most_torque:
        return TORQUE, 0, checks.most_torque - ratio
    return HOLDS, 0, 0.0


@njit()
def held_without(
    q: Array, T: Array, contacts: Array, normals: Array, lifted: int, checks: Checks
) -> tuple[float, float]:
    """Margin [m] and torque ratio of one configuration with a leg off the ground."""
    poses, standing = np.empty((7 * len(contacts), 3, 4)), np.ones(len(contacts), np.bool_)
    place_rover(q, T, checks.rover, poses)
    standing[lifted] = False
    com = np.array(center_of_mass(poses, T, checks.rover))
    support = 0 if checks.balance.support == PREFERRED else checks.balance.support
    ratio = torque_of(poses, T, contacts, normals, standing, checks)
    return margin_without(contacts, lifted, com, support), ratio


@njit()
def moved_between(before: Array, poses: Array, reaches: Array) -> float:
    """How far any point of a link can have moved between two placements (legs × 7, 3, 4) [m]."""
    most = 0.0
    for link in range(len(reaches)):
        away = turn = 0.0
        for i in range(3):
            away += (poses[link, i, 3] - before[link, i, 3]) ** 2
            for k in range(3):
                turn += (poses[link, i, k] - before[link, i, k]) ** 2
        # the largest singular value of a difference of rotations is its Frobenius norm over √2
        most = max(most, math.sqrt(away) + reaches[link] * math.sqrt(0.5 * turn))
    return most


@njit()
def body_path(
    T_from: Array,
    T_to: Array,
    feet: Feet,
    contacts: Array,
    normals: Array,
    lacking: float,
    checks: Checks,
    Ts: Array,
    qs: Array,
    margins: Array,
    torques: Array,
) -> tuple[int, int, float, int]:
    """Write the samples of a straight way of the chassis; returns what fails, of what, by how much, at which sample.

    Ts (n, 3, 4), qs (n, legs × 6), margins (n,) [m], torques (n,), NaN where not asked for. lacking: what the start's
    legs lack of their reserves, which the way may lack as well.
    """
    count, turn = len(Ts), turn_between(T_from, T_to)
    spares = np.empty(len(contacts))
    poses, before = np.empty((7 * len(contacts), 3, 4)), np.empty((7 * len(contacts), 3, 4))
    standing = np.ones(len(contacts), np.bool_)
    for i in range(count):
        between(T_from, T_to, turn, i / (count - 1), Ts[i])
        spare = legs_at(Ts[i], feet, checks.legs, qs[i], spares)
        if not spare >= min(lacking, 0.0) - 1e-9:
            return LEG, int(np.argmin(spares)), spare, i
    support = 0 if checks.balance.support == PREFERRED else checks.balance.support
    for i in range(count):
        place_rover(qs[i], Ts[i], checks.rover, poses)
        if i > 0 and moved_between(before, poses, checks.reaches) > checks.gap:
            return COARSE, 0, 0.0, i
        before[:] = poses
        com = np.array(center_of_mass(poses, Ts[i], checks.rover))
        margins[i] = margin_without(contacts, -1, com, support)
        if not margins[i] >= min(checks.balance.least, margins[0]):
            return MARGIN, 0, margins[i] - checks.balance.least, i
        code, near = first_too_near(poses, Ts[i], standing, 0.0, checks.rover)
        if code != CLEAR and i > 0:
            return NEAR, code, near, i
        spare, code = tether_spare(poses, Ts[i], checks.tether)
        if not spare >= 0.0 and i > 0:
            return TETHER, code, spare, i
        torques[i] = np.nan
        if i % _TORQUE_EVERY == 0 or i == count - 1:
            torques[i] = torque_of(poses, Ts[i], contacts, normals, standing, checks)
            if not torques[i] <= max(checks.most_torque, torques[0]):
                return TORQUE, 0, checks.most_torque - torques[i], i
    return HOLDS, 0, 0.0, count


@njit()
def tether_on_path(path: Array, q: Array, T: Array, leg: int, checks: Checks) -> tuple[float, int]:
    """What the tether has to spare while a leg goes through postures (n, 6), straight between them, (m, code).

    Never more than that; where it may be less than nothing, it is told so. q: (legs × 6,) of the other legs.
    """
    if checks.tether.line.shape[0] == 0:
        return np.inf, -1
    posture, poses = q.copy(), np.empty((7 * (len(q) // 6), 3, 4))
    least, what = np.inf, -1
    for row in range(1, len(path)):
        way = 0.0
        for k in range(6):
            way += _LEVERS[k] * abs(path[row, k] - path[row - 1, k])
        share = 0.0
        while True:
            posture[6 * leg : 6 * leg + 6] = path[row - 1] + share * (path[row] - path[row - 1])
            place_rover(posture, T, checks.rover, poses)
            spare, code = tether_spare(poses, T, checks.tether)
            if spare < least:
                least, what = spare, code
            if least < 0.0 or share >= 1.0:
                break
            # before it is gone, nothing can have come so near
            share = min(1.0, share + max(spare, checks.gap) / max(way, 1e-9))
    return least, what


@njit()
def waypoints_of(qs: Array, farthest: int) -> NDArray[np.int64]:
    """Rows of samples (n, legs × 6) between which straight lines keep every standing wheel within DRIFT.

    farthest: samples from one waypoint to the next, at most.
    """
    rows, count, last = np.empty(len(qs), np.int64), 1, 0
    rows[0] = 0
    while last < len(qs) - 1:
        step = min(farthest, len(qs) - 1 - last)
        while step > 1 and _drift(qs, last, last + step) > DRIFT:
            step -= 1
        last += step
        rows[count] = last
        count += 1
    return rows[:count].copy()


@njit()
def _drift(qs: Array, first: int, last: int) -> float:
    """How far a wheel is at most from where it stands, between two rows joined by a straight line [m]."""
    most = 0.0
    for i in range(first + 1, last):
        share = (i - first) / (last - first)
        for leg in range(qs.shape[1] // 6):
            away = 0.0
            for k in range(6 * leg, 6 * leg + 6):
                away += _LEVERS[k % 6] * abs(qs[i, k] - qs[first, k] - share * (qs[last, k] - qs[first, k]))
            most = max(most, away)
    return most
