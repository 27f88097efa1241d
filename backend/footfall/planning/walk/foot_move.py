"""One foot move, whole: a chassis pose for it, the chassis' way there, and the swing. Everything is checked."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from footfall.balance.support import half_planes
from footfall.core.arrays import Array
from footfall.planning.scene.certificate import body_tables
from footfall.planning.scene.leg_over_ground import LegOverGround
from footfall.planning.walk.body_kernel import (
    HOLDS,
    LEG,
    TETHER,
    TORQUE,
    Checks,
    configuration_fails,
    held_without,
    tether_on_path,
)
from footfall.planning.walk.body_way import NAMES, At, BodyWay, Fails, body_way, failure_in_words, feet_of
from footfall.planning.walk.legs_kernel import leg_at, legs_at, pose_of
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.swing import Swing, swing
from footfall.planning.walk.transition_kernel import Move, find_pose, vector_of
from footfall.planning.walk.world import World
from footfall.robot.proof.clearance import LegClearance
from footfall.robot.proof.ground_tables import GroundTables

LOOKS = 90
"""Chassis poses that are looked at for one foot move."""
FAR_DOWN = 0.3
"""The chassis is so far above or below where it is to be [m]: legs may have to fold or stretch on the way there."""
_NOWHERE = np.zeros((3, 4))
_NOWHERE.setflags(write=False)
SWING_TURN = 0.1
"""Of a joint between two looks at forces and torques on a swing [rad]."""


WayOf = Callable[[Checks, At, Array], BodyWay | Fails]
"""Finds the chassis' way from where the rover is to a pose (4, 4), or says what fails."""


@dataclass(frozen=True, eq=False)
class Moved:
    """A foot move: where it ends, the chassis' way before it, the swing with margins and torques at its waypoints."""

    to: At
    leg: int
    body: BodyWay
    swing: Swing
    margins: Array
    torques: Array


def foot_move(
    world: World,
    at: At,
    leg: int,
    to: Stance,
    aim: Array,
    rng: np.random.Generator,
    way_of: WayOf = body_way,
) -> Moved | Fails:
    """Move the foot of a leg, the chassis going first where all feet but that one hold it before and after.

    The chassis stays while the leg swings.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        leg: number of the leg, from 0.
        to: how the feet are to stand then.
        aim: chassis pose to be near, x, y, z [m], roll, pitch, yaw [rad], (6,).
        rng: what draws.
        way_of: finds the chassis' way.

    Returns:
        The foot move, or what fails.
    """
    now = vector_of(np.ascontiguousarray(at.T_site_base[:3]))
    aims = []
    if abs(aim[2] - now[2]) > FAR_DOWN:
        # where legs are nearly straight, wrists would pass straight on the way down or up: so nearer to its own height
        as_high = np.concatenate([aim[:2], now[2:5], aim[5:]])
        aims = [as_high, 0.5 * (aim + as_high)]
    found = _foot_move_near(world, at, leg, to, now, aim, rng, way_of)
    for near in aims:
        if isinstance(found, Moved):
            break
        found = _foot_move_near(world, at, leg, to, now, near, rng, way_of)
    return found


def _foot_move_near(
    world: World, at: At, leg: int, to: Stance, now: Array, aim: Array, rng: np.random.Generator, way_of: WayOf
) -> Moved | Fails:
    checks = world.around(at.T_site_base).checks
    guesses, best = np.array([aim, now, 0.5 * (aim + now)]), np.empty(6)
    feet, move = feet_of(at.stance), move_of(world, at.stance, leg, to)
    lacks = find_pose(guesses, aim, feet, move, world.legs, checks.rover, checks.balance, rng, LOOKS, best)
    if lacks > 0.0:
        return Fails("transition", leg, lacks)
    return foot_move_at(world, at, leg, to, best, rng, way_of)


def move_of(world: World, stance: Stance, leg: int, to: Stance) -> Move:
    """The move of a foot from a stance to the next, as kernels take it."""
    wheel, branch = np.ascontiguousarray(to.Ts_site_wheel[leg, :3]), int(to.branches[leg])
    return Move(leg, wheel, branch, world.settings.lift, stance.contacts)


def nobody(stance: Stance) -> Move:
    """No foot's move, over all feet of a stance, as kernels take it."""
    return Move(-1, _NOWHERE, 0, 0.0, stance.contacts)


def foot_move_at(
    world: World,
    at: At,
    leg: int,
    to: Stance,
    vector: Array,
    rng: np.random.Generator,
    way_of: WayOf = body_way,
) -> Moved | Fails:
    """Move the foot of a leg with the chassis at a pose meanwhile.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        leg: number of the leg, from 0.
        to: how the feet are to stand then.
        vector: chassis pose, x, y, z [m], roll, pitch, yaw [rad], (6,).
        rng: what draws.
        way_of: finds the chassis' way.

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
    body = way_of(checks, at, T_site_base)
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
