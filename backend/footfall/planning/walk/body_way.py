"""The chassis' way over all its feet, from one pose to another, every check of it holding."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import turn_of
from footfall.planning.scene.rover_tables import named
from footfall.planning.scene.tether_tables import beside_tether
from footfall.planning.walk.body_kernel import (
    COARSE,
    HOLDS,
    LEG,
    MARGIN,
    NEAR,
    TETHER,
    TORQUE,
    Checks,
    body_path,
    waypoints_of,
)
from footfall.planning.walk.legs_kernel import Feet, legs_at, pose_of
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.transition_kernel import vector_of

BODY_STEP, BODY_TURN = 0.006, 0.004
"""From one sample of the chassis' way to the next [m, rad]; halved as often as anything moves too far between."""
FARTHEST = 8
"""Samples from one waypoint to the next, at most."""
NAMES = {LEG: "reach", MARGIN: "balance", TORQUE: "torque", NEAR: "collision", COARSE: "sampling", TETHER: "tether"}


@dataclass(frozen=True, eq=False)
class At:
    """The rover on all its feet: T_site_base (4, 4), posture (legs × 6,)."""

    stance: Stance
    T_site_base: Array
    posture: Array


@dataclass(frozen=True, eq=False)
class BodyWay:
    """Waypoints of a chassis' way, the first where it begins: postures (n, legs × 6), Ts_site_base (n, 4, 4)."""

    postures: Array
    Ts_site_base: Array
    margins: Array
    torques: Array


@dataclass(frozen=True)
class Fails:
    """Why there is no foot move: the check, of which leg, or −1, and what is lacking, NaN where that is not known."""

    check: str
    leg: int = -1
    lacks: float = math.nan


def feet_of(stance: Stance) -> Feet:
    """A stance as kernels take it."""
    return Feet(np.ascontiguousarray(stance.Ts_site_wheel[:, :3]), np.array(stance.branches))


def failure_in_words(failed: int, code: int) -> str:
    """The check that failed, in words; code: of NEAR."""
    if failed == TETHER:
        return f"{NAMES[failed]} and {beside_tether(code)}"
    return f"{NAMES[failed]} of {named(code)}" if failed == NEAR else NAMES[failed]


def body_way(checks: Checks, at: At, T_site_base: Array) -> BodyWay | Fails:
    """The chassis' way over all its feet to a pose, every check of it holding.

    It is straight, or where that fails up or down and level with the pose first, then straight.

    Args:
        checks: of the chassis here.
        at: where the rover is.
        T_site_base: where the way ends, (4, 4).

    Returns:
        The way, or what fails.
    """
    straight = straight_way(checks, at, T_site_base)
    if not isinstance(straight, Fails):
        return straight
    vector, goal = (vector_of(np.ascontiguousarray(T[:3])) for T in (at.T_site_base, T_site_base))
    vector[2:5] = goal[2:5]
    T_via = np.eye(4)
    pose_of(vector, T_via[:3])
    first = straight_way(checks, at, T_via)
    if isinstance(first, Fails):
        return straight
    then = straight_way(checks, At(at.stance, T_via, first.postures[-1]), T_site_base)
    if isinstance(then, Fails):
        return straight
    return joined([first, then])


def joined(ways: list[BodyWay]) -> BodyWay:
    """Ways one after the other, each of which begins where the one before it ends."""
    names = ("postures", "Ts_site_base", "margins", "torques")
    first, *others = ways
    return BodyWay(*(np.concatenate([getattr(first, n), *(getattr(one, n)[1:] for one in others)]) for n in names))


def straight_way(checks: Checks, at: At, T_site_base: Array) -> BodyWay | Fails:
    """The chassis' straight way over all its feet to a pose, every check of it holding.

    Args:
        checks: of the chassis here.
        at: where the rover is.
        T_site_base: where the way ends, (4, 4).

    Returns:
        The way, or what fails.
    """
    feet, legs = feet_of(at.stance), len(at.stance.branches)
    spares, q = np.empty(legs), np.empty(6 * legs)
    T_from, T_to = np.ascontiguousarray(at.T_site_base[:3]), np.ascontiguousarray(T_site_base[:3])
    lacking = legs_at(T_from, feet, checks.legs, q, spares)
    away = float(np.linalg.norm(T_to[:, 3] - T_from[:, 3]))
    turn = turn_of(T_from[:, :3].T @ T_to[:, :3])
    count = 2 + int(max(away / BODY_STEP, turn / BODY_TURN))
    while True:
        Ts, qs = np.empty((count, 3, 4)), np.empty((count, 6 * legs))
        margins, torques = np.empty(count), np.empty(count)
        failed, what, spare, _ = body_path(
            T_from,
            T_to,
            feet,
            at.stance.contacts,
            at.stance.normals,
            lacking,
            checks,
            Ts,
            qs,
            margins,
            torques,
        )
        if failed == COARSE:
            count = 2 * count
            continue
        if failed != HOLDS:
            return Fails(f"{failure_in_words(failed, what)} on the body's way", what if failed == LEG else -1, -spare)
        # bit for bit where it is
        qs[0] = at.posture
        rows = waypoints_of(qs, FARTHEST)
        poses = np.tile(np.eye(4), (len(rows), 1, 1))
        poses[:, :3] = Ts[rows]
        poses[0], poses[-1] = at.T_site_base, T_site_base
        return BodyWay(qs[rows], poses, margins[rows], _filled(torques)[rows])


def _filled(torques: Array) -> Array:
    """Torques (n,) with those not asked for as large as the larger of their neighbours that were."""
    known = np.flatnonzero(np.isfinite(torques))
    rows = np.arange(len(torques))
    before = known[np.searchsorted(known, rows, side="right") - 1]
    following = known[np.minimum(np.searchsorted(known, rows), len(known) - 1)]
    return np.maximum(torques[before], torques[following])
