"""One foot move of a gait: the chassis goes to its next pose, then a group of feet swings. All of it is checked."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.gait.stride_kernel import group_swings
from footfall.planning.scene.rover_kernel import LIFTED, STANDING, TOUCHING
from footfall.planning.walk.body_kernel import HOLDS, LEG, MARGIN, NEAR, TORQUE
from footfall.planning.walk.body_way import NAMES, At, BodyWay, Fails, body_way, failure_in_words
from footfall.planning.walk.legs_kernel import UNREACHED, leg_at
from footfall.planning.walk.problem import LIFT, LOWER, SWING, Stance
from footfall.planning.walk.swing import HIGHER, RISES, risen
from footfall.planning.walk.world import World

STILL = 1e-9
"""A chassis that goes no farther stays [m]."""
UNITS = {LEG: "m or rad", MARGIN: "m", NEAR: "m", TORQUE: "of the limit"}


@dataclass(frozen=True, eq=False)
class Swung:
    """How some legs go from footfall to footfall.

    postures (n, legs × 6), the first where they stood; phases, margins [m] and torques (n,), the worst since the row
    before.
    """

    legs: tuple[int, ...]
    postures: Array
    phases: tuple[str, ...]
    margins: Array
    torques: Array


@dataclass(frozen=True, eq=False)
class Stepped:
    """A foot move: where it ends, the chassis' way before it, None where it stays, and the swing."""

    to: At
    body: BodyWay | None
    swung: Swung


@dataclass(frozen=True)
class Lack(Fails):
    """The same with the unit of what is lacking."""

    unit: str = ""


def gone_to(world: World, at: At, T_site_base: Array) -> BodyWay | Lack | None:
    """The chassis' way to its next pose.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        T_site_base: the pose that it is to have, (4, 4).

    Returns:
        The way, or what it lacks; None where the chassis stays.
    """
    if np.abs(at.T_site_base - T_site_base).max() <= STILL:
        return None
    way = body_way(world.around(at.T_site_base).checks, at, T_site_base)
    if not isinstance(way, Fails):
        return way
    short = next((unit for what, unit in UNITS.items() if way.check.startswith(NAMES[what])), "")
    return Lack(way.check, way.leg, _size(way.lacks), short)


def stepped(world: World, at: At, group: tuple[int, ...], to: Stance, T_site_base: Array) -> Stepped | Lack:
    """Move the feet of a group together.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        group: numbers of the legs that move.
        to: the stance that they are to have.
        T_site_base: pose of the chassis meanwhile, (4, 4).

    Returns:
        The motion and where the rover is then, or what it lacks.
    """
    T = np.ascontiguousarray(T_site_base[:3])
    for stance, legs in ((at.stance, world.robot.legs), (to, group)):
        for leg in legs:
            lack = leg_lacks(world, T, stance.Ts_site_wheel[leg], int(stance.branches[leg]), leg)
            if lack is not None:
                return lack
    body = gone_to(world, at, T_site_base)
    if isinstance(body, Lack):
        return body
    posture = at.posture if body is None else body.postures[-1]
    lack = None
    for share in HIGHER:
        swung = _swung(world, at.stance, to, T_site_base, posture, group, share)
        if isinstance(swung, Swung):
            return Stepped(At(to, T_site_base, swung.postures[-1]), body, swung)
        lack = lack or swung
    return lack or Lack("swing")


def leg_lacks(world: World, T: Array, T_site_wheel: Array, branch: int, leg: int) -> Lack | None:
    """Why a leg can't hold its wheel as a foot move wants it.

    Args:
        world: rover, ground and settings of the walk.
        T: pose of the chassis in site, (3, 4).
        T_site_wheel: pose of the wheel, (4, 4).
        branch: of the inverse kinematics that the leg is on.
        leg: number of the leg, from 0.

    Returns:
        What is missing; None: it can.
    """
    legs, wheel, q = world.legs, np.ascontiguousarray(T_site_wheel[:3]), np.empty(6)
    if leg_at(T, wheel, branch, leg, legs, q) >= 0.0:
        return None
    free = legs._replace(joint_reserve=-np.inf, wrist=-np.inf, knee_roll=np.inf)
    unlimited = free._replace(lower=np.full_like(legs.lower, -np.inf), upper=np.full_like(legs.upper, np.inf))
    for name, tables, unit in (
        ("reach", unlimited, "m"),
        ("joint limits", free._replace(joint_reserve=legs.joint_reserve), "rad"),
        ("wrist", free._replace(wrist=legs.wrist), "rad"),
    ):
        spare = leg_at(T, wheel, branch, leg, tables, q)
        if not spare >= 0.0:
            beyond = legs.reach_reserve if name == "reach" else legs.joint_reserve
            return Lack(f"{name}", leg, -spare if spare > -UNREACHED else -spare - UNREACHED + beyond, unit)
    return Lack("knee roll", leg, abs(q[3]) - legs.knee_roll, "rad")


def _swung(
    world: World, stance: Stance, to: Stance, T_site_base: Array, posture: Array, group: tuple[int, ...], share: float
) -> Swung | Lack:
    """The feet straight up, over in straight lines of their joints, and straight down; share: of the lift asked for."""
    T, lift = np.ascontiguousarray(T_site_base[:3]), share * world.settings.lift
    path = np.tile(posture, (2 * RISES + 2, 1))
    for leg in group:
        own = slice(6 * leg, 6 * leg + 6)
        ends = []
        for name, where in ((LIFT, stance), (LOWER, to)):
            wheel, branch = np.ascontiguousarray(where.Ts_site_wheel[leg, :3]), int(where.branches[leg])
            q = posture[own].copy()
            if name == LOWER:
                leg_at(T, wheel, branch, leg, world.legs, q)
            up = risen(T, q, wheel, branch, leg, lift, world.legs)
            above = wheel.copy()
            above[2, 3] += lift
            lack = leg_lacks(world, T, above, branch, leg)
            if up is None or lack is not None:
                return lack or Lack(f"{name} without a jump", leg)
            ends.append(up)
        path[: RISES + 1, own], path[RISES + 1 :, own] = ends[0], ends[1][::-1]
    ways, standing = np.full((len(path), len(stance.contacts)), STANDING), np.ones(len(stance.contacts), np.bool_)
    moving = list(group)
    ways[:, moving], standing[moving] = TOUCHING, False
    ways[RISES + 1, moving] = LIFTED
    margins, torques = np.empty(len(path)), np.empty(len(path))
    checks = world.around(T_site_base).checks
    raised = world.settings.raise_terrain
    failed, code, spare, row = group_swings(
        path, ways, standing, T, stance.contacts, stance.normals, raised, checks, margins, torques
    )
    phases = (LIFT,) * (RISES + 1) + (SWING,) + (LOWER,) * RISES
    if failed != HOLDS:
        return Lack(f"{failure_in_words(failed, code)} in {phases[row]}", -1, _size(-spare), UNITS[failed])
    return Swung(group, path, phases, margins, torques)


def _size(lacks: float) -> float:
    return lacks if lacks > 0.0 else math.inf if math.isinf(lacks) else math.nan
