"""A legged robot on its terrain: what stances, steps and walks are planned with."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.at_ease import Ease, at_ease
from footfall.planning.legged.footing import Rest, rest
from footfall.planning.legged.problem import LeggedSettings, LeggedState
from footfall.planning.legged.whole_check import Feet, WholeCheck
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import chassis_pose
from footfall.terrain.dem import Dem
from footfall.terrain.ground.unseen import filled

ASIDE = 0.12
"""How far from its place at ease a footfall may be, as a share of the longest leg."""
RINGS, AROUND = 3, 8
SLOPE_COST = 0.15
"""How much farther off, as a share of the leg, a footfall may be for each radian that its ground is less steep."""


class Ground:
    """A robot, its stance at ease, and the terrain it walks on: bodies are checked over ground without holes."""

    def __init__(self, robot: LeggedRobot, dem: Dem, settings: LeggedSettings) -> None:
        self.robot, self.dem, self.settings = robot, dem, settings
        self.ease: Ease = at_ease(robot)
        self.check = WholeCheck(robot, whole(dem), settings, self.ease.apart)

    def footfalls(self, leg: int, x: float, y: float) -> Iterator[Rest]:
        """Rests of a foot on ground that is known and not too steep, the best first.

        Near and level come first: SLOPE_COST.
        """
        found = []
        for ring in range(RINGS + 1):
            for k in range(AROUND if ring else 1):
                off = ring / RINGS * ASIDE * self.robot.length
                angle = 2 * np.pi * k / AROUND
                one = rest(self.dem, x + off * np.cos(angle), y + off * np.sin(angle), float(self.robot.radii[leg]))
                slope = float(np.arccos(np.clip(one.normal[2], -1.0, 1.0)))
                if np.isfinite(one.normal).all() and slope <= self.settings.steepest:
                    found.append((off + SLOPE_COST * self.robot.length * slope, ring, k, one))
        yield from (one for *_, one in sorted(found, key=lambda each: each[:3]))

    def pose_over(self, soles: Array, x: float, y: float, yaw: float, lean: float, rise: float) -> Array:
        """T_site_base (4, 4) at (x, y) with a heading, over feet that stand at soles (legs, 3).

        lean: which share of the slope of the plane through the feet the chassis takes on; rise: of the height at ease.
        """
        ends = soles.copy()
        ends[:, 2] -= self.robot.radii
        middle = ends.mean(axis=0)
        about = np.column_stack([ends[:, :2] - middle[:2], np.ones(len(ends))])
        a, b, c = np.linalg.lstsq(about, ends[:, 2], rcond=None)[0]
        height = a * (x - middle[0]) + b * (y - middle[1]) + c
        up = np.array([-lean * a, -lean * b, 1.0])
        return chassis_pose(x, y, height + rise * self.ease.height(self.robot), yaw, up)

    def home(self, leg: int, x: float, y: float, yaw: float) -> Array:
        """Where a foot is at ease under a chassis at (x, y) with a heading, (2,) in site [m]."""
        return apply(chassis_pose(x, y, 0.0, yaw), self.ease.soles[leg])[:2]

    def state(self, q: Array, T_site_base: Array, soles: Array, contacts: Array, normals: Array) -> LeggedState:
        """The robot standing so."""
        return LeggedState(self.robot.name, q, T_site_base, soles, contacts, normals)


@lru_cache(maxsize=2)
def whole(dem: Dem) -> Dem:
    """The ground with its holes filled, as :mod:`footfall.terrain.ground.unseen` says; itself where it has none.

    Args:
        dem: the ground, in site.

    Returns:
        The same cells, each with a height.
    """
    if np.isfinite(dem.heights).all():
        return dem
    return Dem(filled(dem.heights), dem.geometry, dem.name, dem.provenance)


def all_standing(state: LeggedState) -> Feet:
    """Every foot of a state on the ground."""
    return Feet(range(len(state.soles)), state.contacts, state.normals)
