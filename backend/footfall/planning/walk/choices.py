"""How many footfalls the legs can choose from along a way of the chassis: what a walk that is to end there needs."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import heading
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.chains import APART, joined
from footfall.planning.walk.footfalls import footfalls
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.guide import Guide, guide
from footfall.planning.walk.plan import BESIDE
from footfall.planning.walk.problem import Stance, WalkSettings
from footfall.planning.walk.reach import FootfallReach, reach_of, reaches, steps_onto
from footfall.planning.walk.start import stance_of
from footfall.planning.walk.world import World
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import without_holes_between


@dataclass(frozen=True, eq=False)
class WayAhead:
    """A way of the chassis over ground, whatever the seed is that footfalls are drawn with.

    way: the poses of the chassis that are looked at. through: (n, 2) that it leads through [m]; begin: how the rover
    stands now; facing: of the chassis now [rad].
    """

    world: World
    dem: Dem
    way: Guide
    through: Array
    begin: Stance
    facing: float

    def turned(self, yaw: float) -> "WayAhead":
        """The same way, at whose end the chassis faces ``yaw`` [rad]."""
        begin, end = np.append(self.through[0], self.facing), np.append(self.through[-1], yaw)
        world = self.world
        ease = footprint(world.robot, world.settings.height)
        return replace(self, way=guide(world.ground.dem, begin, end, ease, self.through))

    def choices(self, seed: int, apart: float = APART) -> NDArray[np.int64]:
        """Footfalls that each leg reaches from each pose of the way, (n, legs).

        They are those that a walk with this seed would be planned with, and that the foot comes to from where it
        stands: the chassis stays while a leg swings, so from one to the next only where it reaches both from one part
        of the way, or from parts that are at most ``apart`` [m] of each other.
        """
        settings = replace(self.world.settings, seed=seed)
        low, high = _corners(self.through)
        places = footfalls(self.world.robot, self.dem, low, high, settings)
        begin_low, begin_high = reach_of(self.world, self.way, self.begin)
        counts = []
        for leg, reach in enumerate(reaches(self.world, self.way, places)):
            foot = self.begin.contacts[leg, :2]
            own = steps_onto(leg, reach, places, foot, settings)
            xy = np.vstack([foot, places.contacts[own, :2]])
            low, high = np.append(begin_low[leg], reach.low[own]), np.append(begin_high[leg], reach.high[own])
            own = own[joined(xy, low, high, settings.longest, apart)[1:]]
            counts.append(_counts(reach, own, self.way.ways))
        return np.column_stack(counts)


def way_ahead(robot: Robot, dem: Dem, state: RobotState, through: Array, settings: WalkSettings) -> WayAhead | None:
    """The way ahead of a rover that goes on and faces as it does now.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        through: places of the chassis on its way, (n, 2) in site [m].
        settings: of the walk.

    Returns:
        The way; None where no ground at all is known.
    """
    T_site_base = state.T_site_base
    low, high = _corners(through)
    whole = without_holes_between(dem, low - BESIDE, high + BESIDE, np.zeros((0, 3)))
    if whole is None:
        return None
    world = World(robot, Nearby(whole.dem, whole.filled), settings, T_site_base)
    facing = heading(T_site_base)
    ease = footprint(robot, settings.height)
    way = guide(whole.dem, np.append(through[0], facing), np.append(through[-1], facing), ease, through)
    begin = stance_of(robot, dem, np.array(state.posture), np.array(T_site_base))
    return WayAhead(world, dem, way, through, begin, facing)


def _corners(through: Array) -> tuple[Array, Array]:
    """Between which footfalls are drawn."""
    return through.min(axis=0) - BESIDE, through.max(axis=0) + BESIDE


def _counts(reach: FootfallReach, own: NDArray[np.int64], ways: Array) -> NDArray[np.int64]:
    """How many of its own footfalls a leg reaches from so far along the way, (m,) [m]."""
    return ((reach.low[own] <= ways[:, None]) & (ways[:, None] <= reach.high[own])).sum(axis=1)
