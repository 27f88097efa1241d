"""Whether a move of the chassis leaves the standing legs a reserve: short of straight, and inside their joints' limits.

A leg that ends straight passes every other check, and then the chassis can go nowhere: the next shift is refused. So a
move keeps a reserve where it ends. What a leg lacks already before the move it may lack after it, but not more.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.planning.answers import Check
from footfall.planning.body.checked import MoveCheck
from footfall.planning.body.move import BodyMoveSettings
from footfall.robot.model import Robot
from footfall.robot.reserve import joint_reserves, reach_reserves

SAME = 1e-6
"""Less than this is lost by rounding alone [m, rad]."""


def required(reserves: Array | float, wanted: float) -> Array:
    """What is asked of reserves (…) like those before a move [m, rad]: ``wanted``, or what there is, if less."""
    return np.minimum(wanted, np.maximum(reserves, 0.0))


def reserves(
    robot: Robot, start: Array, goal: Array, standing: Sequence[int], settings: BodyMoveSettings
) -> Iterable[MoveCheck]:
    """The checks of what standing legs have left at the goal.

    Args:
        robot: the rover.
        start: posture, (legs × 6,) [rad].
        goal: posture, (legs × 6,) [rad].
        standing: numbers of those legs.
        settings: the reserves that are asked for.

    Returns:
        The checks; none for a reserve of 0 that was asked for.
    """
    legs = list(standing)
    if settings.reach_reserve > 0:
        had, has = reach_reserves(robot, np.array([start, goal]))[:, legs]
        least = required(had, settings.reach_reserve)
        at = int(np.argmin(has - least))
        yield _checked("reach reserve", had[at], has[at], least[at], "m", f"leg {legs[at]}", "straight or folded")
    if settings.joint_reserve > 0:
        joints = [6 * leg + joint for leg in legs for joint in range(6)]
        had, has = joint_reserves(robot, np.array([start, goal]))[:, joints]
        least = required(had, settings.joint_reserve)
        at = int(np.argmin(has - least))
        name = robot.joint_names[joints[at]]
        yield _checked("joint reserve", had[at], has[at], least[at], "rad", name, "its limit")


def _checked(name: str, had: float, has: float, least: float, unit: str, what: str, short_of: str) -> MoveCheck:
    spare = float(has - least)
    holds = spare >= -SAME
    left, wanted = beside(has, least) if not holds else (f"{has:z.3f}", f"{least:z.3f}")
    where = f"{what} ends {left} {unit} from {short_of}, {had:z.3f} before, at least {wanted} asked"
    return MoveCheck(Check(name, holds, max(spare, 0.0) if holds else spare, unit, where), at_goal=not holds)
