"""How many footfalls the legs can choose from along a way of the chassis: what a walk that is to end there needs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply, heading
from footfall.planning.step.ground import Nearby
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.guide import Guide, guide
from footfall.planning.walk.plan import BESIDE
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.reach import Reach, come_to, reaches
from footfall.planning.walk.world import World
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choices:
    """way: the poses of the chassis that are looked at; counts: (n, legs) footfalls that each leg reaches from each."""

    way: Guide
    counts: NDArray[np.int64]


def choices_along(
    robot: Robot, dem: Dem, state: RobotState, through: Array, yaw: float, settings: WalkSettings
) -> Choices | None:
    """Of a rover that goes on through places (n, 2) of the chassis and faces ``yaw`` [rad] at the last of them.

    Footfalls are those that a walk with these settings would be planned with, and that the foot comes to from where it
    stands by moves that are not too long. None where no ground at all is known.
    """
    T_site_base = state.T_site_base
    low, high = through.min(axis=0) - BESIDE, through.max(axis=0) + BESIDE
    whole = without_holes_between(dem, low - BESIDE, high + BESIDE, np.zeros((0, 3)))
    if whole is None:
        return None
    places = footfalls(robot, dem, low, high, settings)
    world = World(robot, Nearby(whole.dem, whole.filled), settings, T_site_base)
    facing = heading(T_site_base)
    ease = footprint(robot, settings.height)
    way = guide(whole.dem, np.append(through[0], facing), np.append(through[-1], yaw), ease, through)
    feet = apply(T_site_base, wheel_centers(robot, state.posture))[:, :2]
    counts = [
        _counts(one, places.contacts[:, :2], foot, settings.longest, way.ways)
        for one, foot in zip(reaches(world, way, places), feet, strict=True)
    ]
    return Choices(way, np.column_stack(counts))


def _counts(reach: Reach, xy: Array, foot: Array, longest: float, ways: Array) -> NDArray[np.int64]:
    """How many places (n, 2) a leg reaches from so far along the way, (m,) [m], among those that its foot comes to."""
    own = np.flatnonzero(np.isfinite(reach.low))
    own = own[come_to(xy[own], foot, longest)]
    return ((reach.low[own] <= ways[:, None]) & (ways[:, None] <= reach.high[own])).sum(axis=1)
