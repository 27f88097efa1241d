"""One foot move, whole: a chassis pose for it, the chassis' way there, and the swing. Everything is checked."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.balance.support import half_planes
from footfall.core.arrays import Array
from footfall.core.frames import turn_of
from footfall.planning.scene.certificate import body_tables
from footfall.planning.scene.leg_over_ground import LegOverGround
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
    configuration_fails,
    held_without,
    tether_on_path,
    waypoints_of,
)
from footfall.planning.walk.legs_kernel import Feet, leg_at, legs_at, pose_of
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.swing import Swing, swing
from footfall.planning.walk.transition_kernel import Move, find_pose, vector_of
from footfall.planning.walk.world import World
from footfall.robot.proof.clearance import LegClearance
from footfall.robot.proof.ground_tables import GroundTables

LOOKS = 90
"""Chassis poses that are looked at for one foot move."""
BODY_STEP, BODY_TURN = 0.006, 0.004
"""From one sample of the chassis' way to the next [m, rad]; halved as often as anything moves too far between."""
FAR_DOWN = 0.3
"""The chassis is so far above or below where it is to be [m]: legs may have to fold or stretch on the way there."""
FARTHEST = 8
"""Samples from one waypoint to the next, at most."""
NAMES = {LEG: "reach", MARGIN: "balance", TORQUE: "torque", NEAR: "collision", COARSE: "sampling", TETHER: "tether"}
_NOWHERE = np.zeros((3, 4))
_NOWHERE.setflags(write=False)
SWING_TURN = 0.1
"""Of a joint between two looks at forces and torques on a swing [rad]."""


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


@dataclass(frozen=True, eq=False)
class Moved:
    """A foot move: where it ends, the chassis' way before it, the swing with margins and torques at its waypoints."""

    to: At
    leg: int
    body: BodyWay
    swing: Swing
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


def foot_move(world: World, at: At, leg: int, to: Stance, aim: Array, rng: np.random.Generator) -> Moved | Fails:
    """Move the foot of a leg, the chassis going first where all feet but that one hold it before and after.

    The chassis stays while the leg swings.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        leg: number of the leg, from 0.
        to: how the feet are to stand then.
        aim: chassis pose to be near, x, y, z [m], roll, pitch, yaw [rad], (6,).
        rng: what draws.

    Returns:
        The foot move, or what fails.
    """
    now = vector_of(np.ascontiguousarray(at.T_site_base[:3]))
    aims = []
    if abs(aim[2] - now[2]) > FAR_DOWN:
        # where legs are nearly straight, wrists would pass straight on the way down or up: so nearer to its own height
        as_high = np.concatenate([aim[:2], now[2:5], aim[5:]])
        aims = [as_high, 0.5 * (aim + as_high)]
    found = _foot_move_near(world, at, leg, to, now, aim, rng)
    for near in aims:
        if isinstance(found, Moved):
            break
        found = _foot_move_near(world, at, leg, to, now, near, rng)
    return found


def _foot_move_near(
    world: World, at: At, leg: int, to: Stance, now: Array, aim: Array, rng: np.random.Generator
) -> Moved | Fails:
    checks = world.around(at.T_site_base).checks
    guesses, best = np.array([aim, now, 0.5 * (aim + now)]), np.empty(6)
    feet, move = feet_of(at.stance), move_of(world, at.stance, leg, to)
    lacks = find_pose(guesses, aim, feet, move, world.legs, checks.rover, checks.balance, rng, LOOKS, best)
    if lacks > 0.0:
        return Fails("transition", leg, lacks)
    return foot_move_at(world, at, leg, to, best, rng)


def move_of(world: World, stance: Stance, leg: int, to: Stance) -> Move:
    """The move of a foot from a stance to the next, as kernels take it."""
    wheel, branch = np.ascontiguousarray(to.Ts_site_wheel[leg, :3]), int(to.branches[leg])
    return Move(leg, wheel, branch, world.settings.lift, stance.contacts)


def nobody(stance: Stance) -> Move:
    """No foot's move, over all feet of a stance, as kernels take it."""
    return Move(-1, _NOWHERE, 0, 0.0, stance.contacts)


def foot_move_at(world: World, at: At, leg: int, to: Stance, vector: Array, rng: np.random.Generator) -> Moved | Fails:
    """Move the foot of a leg with the chassis at a pose meanwhile.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        leg: number of the leg, from 0.
        to: how the feet are to stand then.
        vector: chassis pose, x, y, z [m], roll, pitch, yaw [rad], (6,).
        rng: what draws.

    Returns:
        The foot move, or what fails.
    """
    piece = world.around(at.T_site_base)
    checks, feet = piece.checks, feet_of(at.stance)
    T, q, spares = np.empty((3, 4)), np.empty_like(at.posture), np.empty(len(feet.branches))
    pose_of(vector, T)
    least = legs_at(T, feet, world.legs, q, spares)
    after, q_leg = q.copy(), np.empty(6)
    wheel, branch = np.ascontiguousarray(to.Ts_site_wheel[leg, :3]), int(to.branches[leg])
    if not min(least, leg_at(T, wheel, branch, leg, world.legs, q_leg)) >= 0.0:
        return Fails(NAMES[LEG], leg)
    after[6 * leg : 6 * leg + 6] = q_leg
    poses = np.empty((7 * len(spares), 3, 4))
    for stance, posture in ((at.stance, q), (to, after)):
        failed, code, _ = configuration_fails(posture, T, stance.contacts, stance.normals, leg, checks, poses)
        if failed != HOLDS:
            return Fails(failure_in_words(failed, code), leg)
    T_site_base = np.vstack([T, (0.0, 0.0, 0.0, 1.0)])
    body = body_way(checks, at, T_site_base)
    if isinstance(body, Fails):
        return body
    over = _swing(world, piece.ground, at.stance, to, T_site_base, q, q_leg, leg, rng)
    if isinstance(over, str):
        return Fails(over, leg)
    spare, code = tether_on_path(over.waypoints, q, T, leg, checks)
    if not spare >= 0.0:
        return Fails(failure_in_words(TETHER, code), leg)
    margins, torques = _along(checks, over, q, T, at.stance, leg)
    if not (np.isfinite(torques).all() and torques.max() <= checks.most_torque):
        return Fails(NAMES[TORQUE], leg)
    return Moved(At(to, T_site_base, after), leg, body, over, margins, torques)


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
    straight = _straight(checks, at, T_site_base)
    if not isinstance(straight, Fails):
        return straight
    vector, goal = (vector_of(np.ascontiguousarray(T[:3])) for T in (at.T_site_base, T_site_base))
    vector[2:5] = goal[2:5]
    T_via = np.eye(4)
    pose_of(vector, T_via[:3])
    first = _straight(checks, at, T_via)
    if isinstance(first, Fails):
        return straight
    then = _straight(checks, At(at.stance, T_via, first.postures[-1]), T_site_base)
    if isinstance(then, Fails):
        return straight
    return BodyWay(
        *(
            np.concatenate([getattr(first, name), getattr(then, name)[1:]])
            for name in ("postures", "Ts_site_base", "margins", "torques")
        )
    )


def _straight(checks: Checks, at: At, T_site_base: Array) -> BodyWay | Fails:
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


def _swing(
    world: World,
    ground: GroundTables,
    stance: Stance,
    to: Stance,
    T_site_base: Array,
    q: Array,
    q_leg: Array,
    leg: int,
    rng: np.random.Generator,
) -> Swing | str:
    settings = world.settings
    clearance = LegClearance(
        world.robot, q, leg, T_site_base, ground, settings.clearance, settings.raise_terrain, drum=True
    ).tables
    others = np.delete(np.array(stance.contacts), leg, axis=0)
    normals, offsets = half_planes(others, settings.support == "required")
    asked = settings.least_margin, settings.balance
    body = body_tables(world.robot, q, T_site_base, leg, normals, offsets, *asked)
    T = np.ascontiguousarray(T_site_base[:3])
    wheels = (
        np.ascontiguousarray(stance.Ts_site_wheel[leg, :3]),
        np.ascontiguousarray(to.Ts_site_wheel[leg, :3]),
    )
    branches = int(stance.branches[leg]), int(to.branches[leg])
    ends = q[6 * leg : 6 * leg + 6].copy(), q_leg
    over_ground = LegOverGround(world.robot, leg, T_site_base, world.ground, settings.clearance)
    return swing(T, ends, wheels, branches, leg, settings.lift, world.legs, clearance, body, over_ground, rng)


def _along(checks: Checks, over: Swing, q: Array, T: Array, stance: Stance, leg: int) -> tuple[Array, Array]:
    """Margins and torques (n,) at a swing's waypoints, each the worst since the one before it."""
    margins, torques = [], []
    last = over.waypoints[0]
    for waypoint in over.waypoints:
        parts = max(1, int(np.ceil(np.abs(waypoint - last).max() / SWING_TURN)))
        worst = [np.inf, 0.0]
        for i in range(1, parts + 1):
            posture = q.copy()
            posture[6 * leg : 6 * leg + 6] = last + (i / parts) * (waypoint - last)
            margin, torque = held_without(posture, T, stance.contacts, stance.normals, leg, checks)
            worst = [min(worst[0], margin), max(worst[1], torque)]
        margins.append(worst[0])
        torques.append(worst[1])
        last = waypoint
    return np.array(margins), np.array(torques)
