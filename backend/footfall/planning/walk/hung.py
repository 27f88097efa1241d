"""A rover on a tether as the planner of walks sees it: the slope's frame, the tether in it, and where it is to go."""

import math
from dataclasses import dataclass, replace

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.planning.walk.footfalls import Footfalls, forbidden_to
from footfall.planning.walk.legs_kernel import pose_of
from footfall.planning.walk.problem import Blocked, Place, WalkGoal
from footfall.planning.walk.slope_frame import SlopeFrame
from footfall.terrain.ground.surface import height_at


@dataclass(frozen=True, eq=False)
class Hung:
    """frame: of the slope; tether: in site; goal: in site, None where the rover only stands."""

    frame: SlopeFrame
    tether: Tether
    goal: WalkGoal | None = None

    def balance(self, level: BalanceSettings) -> BalanceSettings:
        """The same with gravity as it is in the slope's frame."""
        return replace(level, slope=self.frame.steep, uphill=self.frame.uphill)

    def is_at_goal(self, vector: Array) -> bool:
        """Whether a chassis at ``vector`` (6,) in the slope's frame is where it is to be in site."""
        T, goal = np.eye(4), self.goal
        pose_of(vector, T[:3])
        T = self.frame.poses_to_site(T)
        if goal is None or math.hypot(T[0, 3] - goal.x, T[1, 3] - goal.y) > goal.within:
            return False
        off = 0.0 if goal.yaw is None else math.atan2(T[1, 0], T[0, 0]) - goal.yaw
        return abs(math.remainder(off, 2 * math.pi)) <= goal.turned

    def heading(self, yaw: float) -> float:
        """A heading in site as one in the slope's frame [rad]: that whose projection it is."""
        off = yaw - self.frame.downhill
        return self.frame.downhill + math.atan2(math.cos(self.frame.steep) * math.sin(off), math.cos(off))

    def places(self, places: Footfalls, radius: float, forbidden: tuple[Place, ...] = ()) -> Footfalls:
        """Footfalls of the slope's frame, on the site's very ground; without those where that is unknown or forbidden.

        forbidden: in site, seen from above: along the slope such ground reaches farther.
        """
        contacts, normals = self.frame.seated(places.contacts, radius)
        seen = self.frame.to_site(contacts)[:, :2]
        good = np.isfinite(contacts).all(axis=1) & np.isfinite(normals).all(axis=1)
        good &= ~forbidden_to(None, seen, forbidden)
        contacts, normals, tree = contacts[good], normals[good], type(places.tree)
        index = tree(contacts[:, :2].reshape(-1, 2))
        return Footfalls(contacts, normals, places.pinned[good], places.costs[good], index, seen[good])

    def blocked(self, blocked: tuple[Blocked, ...]) -> tuple[Blocked, ...]:
        """What stopped a search, at its places in site."""
        found = []
        for one in blocked:
            x, y = self.in_site(one.x, one.y)
            found.append(replace(one, x=x, y=y))
        return tuple(found)

    def in_site(self, x: float, y: float) -> tuple[float, float]:
        """A place on the ground of the slope's frame, x and y in site [m]; NaN where that ground is unknown."""
        at = self.frame.to_site(np.array([x, y, float(height_at(self.frame.ground, x, y))]))
        return float(at[0]), float(at[1])
