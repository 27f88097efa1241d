"""Numeric inverse kinematics of a limb, compiled: Levenberg–Marquardt from many seeds.

T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg–Marquardt method", IEEE Transactions on
Robotics 27 (2011): the damping is the squared error plus a small constant, so steps are short far from a place and
near singular postures, and Newton's where it matters.

A place is a pose (4, 4) of the foot; with 3 equations only its origin counts. Errors of turns are weighed by a length,
so that everything is in metres.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array

MOST_STEPS = 40
DAMPING = 1e-9
"""Constant part of the damping, as a share of the squared length [–]."""
LIMIT_SLACK = 1e-9
"""By how much rounding may bring a joint past its limit [rad or m]."""


class LimbChain(NamedTuple):
    """A limb's joints.

    placements: (joints + 1, 4, 4) from each to the next; axes: (joints, 3) unit; slides: which do; lower, upper: their
    limits [rad or m]; leads, ratios, offsets: which follow which, as ``coupling.Coupling`` has it.
    """

    placements: Array
    axes: Array
    slides: NDArray[np.bool_]
    lower: Array
    upper: Array
    leads: NDArray[np.int64]
    ratios: Array
    offsets: Array


class Nearness(NamedTuple):
    """What counts as at a place: an error of up to ``tolerance`` [m] in so many equations, turns times ``length``."""

    length: float
    equations: int
    tolerance: float


class Seeds(NamedTuple):
    """Postures that are known beforehand, (seeds, joints), and how many of them are tried for each place.

    places: of their feet, (seeds, 3 or 12): origins, then rotations row by row.
    """

    postures: Array
    places: Array
    tried: int


@njit()
def foot_and_jacobian(
    placements: Array, axes: Array, slides: NDArray[np.bool_], q: Array, T: Array, points: Array, turns: Array
) -> None:
    """Write the foot's pose (4, 4), and origin and axis of each joint on the body, both (joints, 3).

    The product of exponentials link by link; a turn about a unit axis by Rodrigues' formula.
    """
    R, p = np.eye(3), np.zeros(3)
    S = np.empty((3, 3))
    joints = q.size
    for link in range(joints + 1):
        P = placements[link]
        for i in range(3):
            p[i] += R[i, 0] * P[0, 3] + R[i, 1] * P[1, 3] + R[i, 2] * P[2, 3]
        for i in range(3):
            for k in range(3):
                S[i, k] = R[i, 0] * P[0, k] + R[i, 1] * P[1, k] + R[i, 2] * P[2, k]
        if link == joints:
            for i in range(3):
                for k in range(3):
                    T[i, k] = S[i, k]
                T[i, 3] = p[i]
            break
        x, y, z = axes[link, 0], axes[link, 1], axes[link, 2]
        for i in range(3):
            turns[link, i] = S[i, 0] * x + S[i, 1] * y + S[i, 2] * z
            points[link, i] = p[i]
        if slides[link]:
            for i in range(3):
                p[i] += q[link] * turns[link, i]
                for k in range(3):
                    R[i, k] = S[i, k]
            continue
        c, s = math.cos(q[link]), math.sin(q[link])
        d = 1.0 - c
        a00, a01, a02 = c + x * x * d, x * y * d - z * s, x * z * d + y * s
        a10, a11, a12 = y * x * d + z * s, c + y * y * d, y * z * d - x * s
        a20, a21, a22 = z * x * d - y * s, z * y * d + x * s, c + z * z * d
        for i in range(3):
            R[i, 0] = S[i, 0] * a00 + S[i, 1] * a10 + S[i, 2] * a20
            R[i, 1] = S[i, 0] * a01 + S[i, 1] * a11 + S[i, 2] * a21
            R[i, 2] = S[i, 0] * a02 + S[i, 1] * a12 + S[i, 2] * a22


@njit()
def error_of(T: Array, target: Array, length: float, equations: int, error: Array) -> float:
    """Write how the foot must move and turn to its place, (equations,) [m]; returns the squared sum.

    The turn is the rotation vector from the foot's to the asked orientation, times ``length``.
    """
    for i in range(3):
        error[i] = target[i, 3] - T[i, 3]
    if equations == 6:
        # D = target Tᵀ; its rotation vector
        d01 = d02 = d10 = d12 = d20 = d21 = trace = 0.0
        for k in range(3):
            trace += target[0, k] * T[0, k] + target[1, k] * T[1, k] + target[2, k] * T[2, k]
            d01 += target[0, k] * T[1, k]
            d02 += target[0, k] * T[2, k]
            d10 += target[1, k] * T[0, k]
            d12 += target[1, k] * T[2, k]
            d20 += target[2, k] * T[0, k]
            d21 += target[2, k] * T[1, k]
        x, y, z = d21 - d12, d02 - d20, d10 - d01
        sine = 0.5 * math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, 0.5 * (trace - 1.0))
        # at half a turn the axis is lost: any step leads away from there
        factor = 0.5 * length * (angle / sine if sine > 1e-9 else 1.0)
        error[3], error[4], error[5] = factor * x, factor * y, factor * z
    total = 0.0
    for i in range(equations):
        total += error[i] * error[i]
    return total


@njit()
def _step(J: Array, error: Array, damping: float, equations: int, joints: int, H: Array, step: Array) -> bool:
    """Write (JᵀJ + damping·1)⁻¹ Jᵀ error by Cholesky's factors; False where rounding leaves none."""
    for i in range(joints):
        for k in range(i + 1):
            total = damping if i == k else 0.0
            for row in range(equations):
                total += J[row, i] * J[row, k]
            for m in range(k):
                total -= H[i, m] * H[k, m]
            if i == k:
                if total <= 0.0:
                    return False
                H[i, i] = math.sqrt(total)
            else:
                H[i, k] = total / H[k, k]
    for i in range(joints):
        total = 0.0
        for row in range(equations):
            total += J[row, i] * error[row]
        for m in range(i):
            total -= H[i, m] * step[m]
        step[i] = total / H[i, i]
    for i in range(joints - 1, -1, -1):
        total = step[i]
        for m in range(i + 1, joints):
            total -= H[m, i] * step[m]
        step[i] = total / H[i, i]
    return True


@njit()
def descend(chain: LimbChain, target: Array, near: Nearness, q: Array) -> float:
    """Change ``q`` (joints,) in place until the foot is at its place; returns the error left [m].

    Limits are not heeded here: a turn that ends past one may be the same posture a whole turn earlier.
    """
    placements, axes, slides, leads, joints = chain.placements, chain.axes, chain.slides, chain.leads, q.size
    length, equations, tolerance = near.length, near.equations, near.tolerance
    T = np.empty((3, 4))
    points, turns = np.empty((joints, 3)), np.empty((joints, 3))
    J, H = np.empty((6, joints)), np.zeros((joints, joints))
    error, step = np.zeros(6), np.empty(joints)
    left = np.inf
    for _ in range(MOST_STEPS):
        foot_and_jacobian(placements, axes, slides, q, T, points, turns)
        squared = error_of(T, target, length, equations, error)
        left = math.sqrt(squared)
        if left <= tolerance:
            break
        for joint in range(joints):
            ax, ay, az = turns[joint, 0], turns[joint, 1], turns[joint, 2]
            if slides[joint]:
                J[0, joint], J[1, joint], J[2, joint] = ax, ay, az
                J[3, joint], J[4, joint], J[5, joint] = 0.0, 0.0, 0.0
                continue
            rx, ry, rz = T[0, 3] - points[joint, 0], T[1, 3] - points[joint, 1], T[2, 3] - points[joint, 2]
            J[0, joint], J[1, joint], J[2, joint] = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx
            J[3, joint], J[4, joint], J[5, joint] = length * ax, length * ay, length * az
        for joint in range(joints):
            if leads[joint] != joint:
                for row in range(6):
                    J[row, leads[joint]] += chain.ratios[joint] * J[row, joint]
                    J[row, joint] = 0.0
        if not _step(J, error, 0.5 * squared + DAMPING * length * length, equations, joints, H, step):
            break
        for joint in range(joints):
            q[joint] += step[joint]
        for joint in range(joints):
            if leads[joint] != joint:
                q[joint] = chain.ratios[joint] * q[leads[joint]] + chain.offsets[joint]
    return left


@njit()
def is_among(q: Array, known: Array, slides: NDArray[np.bool_], apart: float) -> bool:
    """Whether a posture (joints,) is one of ``known``: less than ``apart`` off in every joint, whole turns aside."""
    for other in range(known.shape[0]):
        same = True
        for joint in range(q.size):
            away = abs(q[joint] - known[other, joint])
            if not slides[joint]:
                away -= 2 * math.pi * math.floor(away / (2 * math.pi) + 0.5)
            if abs(away) >= apart:
                same = False
                break
        if same:
            return True
    return False


@njit()
def into_limits(q: Array, chain: LimbChain) -> bool:
    """Turn each angle by whole turns into its limits, in place; False where one can't be.

    Joints that follow others, and these, are not turned: a whole turn of one need not be one of the other.
    """
    slides, lower, upper, leads = chain.slides, chain.lower, chain.upper, chain.leads
    for joint in range(q.size):
        value = q[joint]
        coupled = False
        for other in range(q.size):
            coupled |= leads[other] != other and (other == joint or leads[other] == joint)
        if not slides[joint] and not coupled:
            value -= 2 * math.pi * math.floor((value - lower[joint] + LIMIT_SLACK) / (2 * math.pi))
        if not lower[joint] - LIMIT_SLACK <= value <= upper[joint] + LIMIT_SLACK:
            return False
        q[joint] = min(max(value, lower[joint]), upper[joint])
    return True


@njit()
def nearest_seeds(seeds: Seeds, target: Array, near: Nearness, chosen: NDArray[np.int64]) -> int:
    """Fill ``chosen`` with the numbers of the seeds whose feet are nearest to the place; returns how many there are.

    The distance is that of points, and of rotations by their chord, times the length.
    """
    seed_places, length, equations = seeds.places, near.length, near.equations
    count = chosen.size
    best = np.full(count, np.inf)
    held = 0
    for seed in range(seed_places.shape[0]):
        away = 0.0
        for i in range(3):
            d = seed_places[seed, i] - target[i, 3]
            away += d * d
        if held == count and away >= best[count - 1]:
            continue
        if equations == 6:
            chord = 0.0
            for i in range(3):
                for k in range(3):
                    d = seed_places[seed, 3 + 3 * i + k] - target[i, k]
                    chord += d * d
            away += 0.5 * length * length * chord
            if held == count and away >= best[count - 1]:
                continue
        at = held if held < count else count - 1
        while at > 0 and best[at - 1] > away:
            best[at], chosen[at] = best[at - 1], chosen[at - 1]
            at -= 1
        best[at], chosen[at] = away, seed
        if held < count:
            held += 1
    return held


@njit()
def solve_places(
    chain: LimbChain, targets: Array, near: Nearness, seeds: Seeds, apart: float, q: Array, left: Array
) -> None:
    """Write all different postures found for places (n, 4, 4): q (n, most, joints), NaN beyond, and their errors.

    apart: two postures that differ by less in every joint are one [rad or m].
    """
    joints, most = chain.lower.size, q.shape[1]
    chosen = np.empty(seeds.tried, np.int64)
    trial = np.empty(joints)
    for i in range(targets.shape[0]):
        found = 0
        held = nearest_seeds(seeds, targets[i], near, chosen)
        for at in range(held):
            trial[:] = seeds.postures[chosen[at]]
            error = descend(chain, targets[i], near, trial)
            if not error <= near.tolerance or not into_limits(trial, chain):
                continue
            if found < most and not is_among(trial, q[i, :found], chain.slides, apart):
                q[i, found] = trial
                left[i, found] = error
                found += 1


@njit()
def solve_from(chain: LimbChain, targets: Array, near: Nearness, q: Array) -> None:
    """Change each posture (n, joints) to the one at its place (n, 4, 4) that the way leads to, NaN where to none."""
    for i in range(targets.shape[0]):
        error = descend(chain, targets[i], near, q[i])
        if not error <= near.tolerance or not into_limits(q[i], chain):
            q[i] = np.nan
