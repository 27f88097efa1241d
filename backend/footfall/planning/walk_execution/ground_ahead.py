"""The ground that the rest of a walk stands on: whether it is known now, and is where the walk takes it to be.

A walk is planned on one map and carried out while another look makes it a better one. What is left of it keeps its
footfalls where those still lie on the ground.
"""

import numpy as np

from footfall.maps.standing import STANDING_GAP
from footfall.planning.walk.footfalls import unknown_away
from footfall.planning.walk.ground_cost import oldest_under
from footfall.planning.walk.problem import WalkPlan, part_name
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.age import BANDS
from footfall.terrain.ground.surface import height_at

GROUND_MOVED = 0.03
"""A footfall of the walk may be so far above or below the ground as it is known now [m]: what a wheel may cut in."""


def unknown_ground(robot: Robot, dem: Dem, walk: WalkPlan, first: int, last: int) -> str:
    """Where a foot of the foot moves ``first`` … ``last − 1`` comes down on ground that is not known; or nothing.

    It is asked what a place must be for a walk to put a foot there.
    """
    for number in range(first, min(last, walk.foot_moves)):
        leg = walk.legs[number]
        at = walk.stances[number + 1].contacts[leg, :2]
        away = float(unknown_away(dem, at[None])[0])
        if not away > robot.wheel_radius:
            return (
                f"unknown ground is {away:z.2f} m from where {part_name(number, walk.foot_moves)} puts the foot of leg "
                f"{leg} ({at[0]:z.2f}, {at[1]:z.2f}), within {robot.wheel_radius:g} m"
            )
    return ""


def remembered_ground(robot: Robot, dem: Dem, walk: WalkPlan, first: int, last: int) -> str:
    """Which foot comes down on the oldest ground, where that counts as older; or nothing.

    Of the foot moves ``first`` … ``last − 1``.
    """
    numbers = range(first, min(last, walk.foot_moves))
    if not numbers:
        return ""
    put = np.array([walk.stances[number + 1].contacts[walk.legs[number]] for number in numbers])
    old = oldest_under(dem, put, robot.wheel_radius)
    oldest = int(np.argmax(old))
    if not old[oldest] >= BANDS[0]:
        return ""
    return f"leg {walk.legs[numbers[oldest]]} comes down on ground last seen {old[oldest]:z.0f} s before the newest"


def moved_ground(dem: Dem, walk: WalkPlan, first: int) -> str:
    """Which foot that stands before foot move ``first``, or is put down later, is not on the ground as known now.

    Nothing where all are. One on ground that is not known any more is asked when its turn comes. A foot that stands
    since the walk began would stand so in every other walk from here: of it no more is asked than where a walk begins.
    """
    numbers = range(first, walk.foot_moves)
    stands = walk.stances[first].contacts
    put = [walk.stances[number + 1].contacts[walk.legs[number]] for number in numbers]
    contacts = np.vstack([stands, *put])
    most = np.full(len(contacts), GROUND_MOVED)
    most[: len(stands)][[leg not in walk.legs[:first] for leg in range(len(stands))]] = STANDING_GAP
    off = height_at(dem, contacts[:, 0], contacts[:, 1]) - contacts[:, 2]
    off = np.where(np.isfinite(off), off, 0.0)
    worst = int(np.argmax(np.abs(off) - most))
    if abs(off[worst]) <= most[worst]:
        return ""
    side = "above" if off[worst] > 0 else "below"
    later = worst - len(stands)
    whose = f"leg {worst} stands" if later < 0 else f"{part_name(numbers[later], walk.foot_moves)} puts its foot"
    size = f"{abs(off[worst]):z.3f} m {side} where {whose} in the walk"
    return f"the ground is {size}, at most {most[worst]:g} m are accepted"
