"""Why a rover can't walk on a tether as it was given: looked at before any search, told with the size."""

from dataclasses import replace

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tether import SHORTEST, Tether
from footfall.balance.torques import torque_check
from footfall.core.arrays import Array
from footfall.core.beside import roughly
from footfall.core.frames import apply
from footfall.planning.answers import No, Status
from footfall.planning.scene.rover_kernel import place_rover
from footfall.planning.scene.tether_kernel import DECK, tether_spare
from footfall.planning.walk.body_way import At
from footfall.planning.walk.problem import WalkGoal
from footfall.planning.walk.world import World
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.extent import outside
from footfall.terrain.ground.surface import height_at

SUNK = 0.05
"""An anchor, or a tether, that is so deep in the ground lies on it [m]."""
NEARER = 1.0
"""The chassis may come so much nearer to the anchor than where it would be at ease at its goal [m]."""
STRONGEST = 1e6
"""A drum that is stronger is not looked for [N]."""
_STEP = 0.05
"""Between places at which a tether's height over the ground is looked at [m]."""
_ROUND = 10.0
"""The least force of a drum is told as the next multiple of this [N]."""


def anchor_refused(dem: Dem, T_site_base: Array, tether: Tether) -> str:
    """Why an anchor can't be there, or the tether not go from it to the chassis.

    Args:
        dem: the ground, in site.
        T_site_base: pose of the chassis, (4, 4).
        tether: that the rover hangs on; None: none.

    Returns:
        One sentence; "" where it can.
    """
    x, y, z = (float(one) for one in tether.anchor)
    which, off = f"the tether's anchor ({x:g}, {y:g}, {z:g}) m", outside(dem.geometry, x, y)
    if not off <= 0:
        return f"{which} lies {roughly(off)} m off the map: nobody knows the ground under the tether; choose one inside"
    length = float(tether.lengths(T_site_base[None])[0])
    if length > tether.free_length:
        return f"the tether is {tether.free_length:g} m long, its anchor {length:z.2f} m away; choose a nearer anchor"
    if not length > SHORTEST:
        return f"{which} is where the tether leaves the chassis, so that it has no direction; choose one farther away"
    ground = float(height_at(dem, x, y))
    if not np.isfinite(ground):
        return f"{which} lies where nothing is known of the ground; choose one over known ground"
    if ground - z > SUNK:
        return f"{which} is {ground - z:z.2f} m below the ground, which is {ground:z.2f} m high there; raise it"
    deep, at = _deepest(dem, apply(T_site_base, tether.attachment), tether, length)
    if deep > SUNK:
        return (
            f"where the walk begins the tether goes through the ground, {deep:z.2f} m deep at ({at[0]:z.2f}, "
            f"{at[1]:z.2f}) m; choose another anchor, or a higher one"
        )
    return ""


def _deepest(dem: Dem, end: Array, tether: Tether, length: float) -> tuple[float, Array]:
    """How deep the tether is in known ground beyond what may lie on it, and where (3,) [m]."""
    first = min(tether.bare / length, 1.0)
    shares = np.linspace(first, 1.0, 2 + int((1.0 - first) * length / _STEP))
    points = tether.anchor + shares[:, None] * (end - tether.anchor)
    below = np.nan_to_num(height_at(dem, points[:, 0], points[:, 1]) - points[:, 2], nan=-np.inf)
    worst = int(np.argmax(below))
    return float(below[worst]), points[worst]


def goal_refused(tether: Tether, goal: WalkGoal, at_goal: Array) -> str:
    """Why a tether does not reach a chassis at the goal.

    Args:
        tether: that the rover hangs on; None: none.
        goal: where the chassis is to be.
        at_goal: about where its origin is then, (3,) in site [m].

    Returns:
        One sentence; "" where it may.
    """
    away = float(np.linalg.norm(tether.anchor - at_goal))
    least = away - float(np.linalg.norm(tether.attachment)) - goal.within - NEARER
    if least <= tether.free_length:
        return ""
    return (
        f"the tether is {tether.free_length:g} m long, and the goal is {away:z.2f} m from its anchor, where at least "
        f"{least:z.2f} m would have to be paid out; choose a nearer goal or anchor, or a longer tether"
    )


def hold_refused(robot: Robot, start: At, balance: BalanceSettings, tether: Tether) -> str:
    """Why ground and tether don't hold the rover where the walk begins, or "". start: in site."""
    if _holds(robot, start, balance, tether):
        return ""
    reason = f"ground and tether don't hold the rover where it stands: its drum pulls with {tether.most_force:z.0f} N"
    most, least = STRONGEST, tether.most_force
    if most <= least or not _holds(robot, start, balance, replace(tether, most_force=most)):
        return f"{reason}, and more would not do from that anchor; choose one that is up the slope from the rover"
    while most - least > 0.1 * _ROUND:
        middle = 0.5 * (most + least)
        held = _holds(robot, start, balance, replace(tether, most_force=middle))
        most, least = (middle, least) if held else (most, middle)
    return f"{reason} at most, and {np.ceil(most / _ROUND) * _ROUND:z.0f} N are needed; give a stronger one"


def _holds(robot: Robot, start: At, balance: BalanceSettings, tether: Tether) -> bool:
    normals = start.stance.normals
    return torque_check(robot, start.posture, start.T_site_base, robot.legs, normals, balance, tether).holds


def through_chassis(world: World, start: At) -> str:
    """Why the tether can't leave the chassis where the walk begins, or "". All in the slope's frame."""
    T, poses = np.ascontiguousarray(start.T_site_base[:3]), np.empty((7 * world.robot.leg_count, 3, 4))
    checks = world.first.checks
    place_rover(start.posture, T, checks.rover, poses)
    spare, code = tether_spare(poses, T, checks.tether)
    if spare >= 0.0 or code != DECK:
        return ""
    return (
        "where the walk begins the tether goes through the chassis; choose an anchor on the side on which it leaves, "
        "or another place at which it does"
    )


def refused_before(
    robot: Robot, dem: Dem, start: At, goal: WalkGoal, at_goal: Array, balance: BalanceSettings, tether: Tether
) -> No | None:
    """What speaks against a walk on a tether before any search.

    Args:
        robot: the rover.
        dem: the ground, in site.
        start: where the rover is, in site.
        goal: where the chassis is to be.
        at_goal: about where its origin is then, (3,) in site [m].
        balance: friction and payload.
        tether: that the rover hangs on; None: none.

    Returns:
        Why not; None where nothing does.
    """
    reason = anchor_refused(dem, np.asarray(start.T_site_base), tether)
    if reason:
        return No(Status.START_INVALID, reason)
    reason = goal_refused(tether, goal, at_goal)
    if reason:
        return No(Status.GOAL_INVALID, reason)
    reason = hold_refused(robot, start, balance, tether)
    return No(Status.START_INVALID, reason) if reason else None
