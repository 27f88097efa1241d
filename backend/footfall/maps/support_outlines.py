"""How steadily a rover stands: what its wheels hold, and by how much its centre of mass lies inside.

Three outlines, seen along z, each asking more or other than the one before:

plain           hull of the wheels that stand (geometric)
conservative    what is left of it if any one leg is lost (geometric)
friction        the equilibrium region: where contact forces inside the friction cones of the real ground balance the
                weight, see :mod:`footfall.balance.region`
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.region import EquilibriumRegion, equilibrium_region, region_margins
from footfall.balance.support import conservative_polygon, margins, support_polygon
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.maps.standing import contacts
from footfall.robot.ik import contact_point
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

OUTLINES = ("plain", "conservative", "friction")
LEAST_SHARE = 0.01
"""Of the rover's weight; a wheel that bears less stands on nothing."""
TOLERANCE = 1e-3
"""How far the region may lie inside the true one [m]: less than a line on the ground is wide."""


@dataclass(frozen=True)
class Support:
    """What some wheels hold.

    legs: of those wheels; points: (k, 3) where they touch, site [m]. corners: outline → (m, 2) [m], fewer than three
    where it has no area; none of "friction" where it is not known. region: None where it is not known, and then
    ``unknown`` says why. assumed: legs under which nobody saw the ground: it is taken as level there.
    """

    legs: tuple[int, ...]
    points: Array
    corners: Mapping[str, Array]
    region: EquilibriumRegion | None
    unknown: str
    assumed: tuple[int, ...]

    def margins(self, coms_xy: ArrayLike) -> dict[str, Array]:
        """Outline → signed distances (n,) [m] of centres of mass (n, 2), positive inside.

        −inf where the wheels hold nothing, NaN where that is not known.
        """
        coms = np.asarray(coms_xy, float)
        friction = np.full(len(coms), np.nan) if self.region is None else region_margins(self.region, coms)
        return {
            "plain": margins(self.points, coms),
            "conservative": margins(self.points, coms, conservative=True),
            "friction": friction,
        }

    @property
    def why(self) -> dict[str, str]:
        """Outline → what there is to say of it beside its margin: why there is none, or what it rests on."""
        found = {}
        for name, least in (("plain", 3), ("conservative", 5)):
            if len(self.corners[name]) < 3:
                found[name] = f"{len(self.legs)} wheels leave no area; it takes {least}"
        if self.region is None:
            found["friction"] = self.unknown
        elif self.region.reason:
            found["friction"] = self.region.reason
        elif self.assumed:
            under = f"leg {', '.join(map(str, self.assumed))}" if len(self.assumed) < len(self.legs) else "the wheels"
            found["friction"] = f"ground under {under} not seen, taken as level"
        return found


def bearing(robot: Robot | LeggedRobot, state: RobotState) -> list[int]:
    """Legs whose wheels bear a share of the rover; all of them where no force is known."""
    up = state.wheel_forces[:, 2]
    least = LEAST_SHARE * float(up.sum())
    return [leg for leg in robot.legs if up[leg] > least] if least > 0 else list(robot.legs)


def support_of(
    robot: Robot,
    dem: Dem | None,
    posture: ArrayLike,
    T_site_base: Array,
    legs: Sequence[int],
    balance: BalanceSettings | None = None,
) -> Support:
    """What the wheels of some legs hold in a posture.

    Args:
        robot: the rover.
        dem: the ground, in site; None: each wheel touches at its lowest point, and the equilibrium region is not known.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs that stand.
        balance: friction and the sides of its cones count; None: as delivered.

    Returns:
        Contacts, support polygons and equilibrium regions.
    """
    if dem is None:
        found = [contact_point(robot, posture, leg, T_site_base) for leg in legs]
        return support_on(legs, np.array(found).reshape(-1, 3), None)
    feet = contacts(robot, dem, posture, T_site_base, legs)
    assumed = tuple(leg for leg, seen in zip(legs, feet.seen, strict=True) if not seen)
    return support_on(legs, feet.points, feet.normals, balance, assumed)


def support_on(
    legs: Sequence[int],
    points: Array,
    normals: Array | None,
    balance: BalanceSettings | None = None,
    assumed: tuple[int, ...] = (),
) -> Support:
    """What feet hold that touch the ground at known places.

    Args:
        legs: numbers of the legs that stand, k of them.
        points: where they touch, (k, 3) in site [m].
        normals: of the ground there, (k, 3); None: there is no terrain, and the equilibrium region is not known.
        balance: friction and the sides of its cones count; None: as delivered.
        assumed: legs under which nobody saw the ground.

    Returns:
        Contacts, support polygons and equilibrium regions.
    """
    balance = balance or BalanceSettings()
    region, unknown = None, "there is no terrain: the slope under the wheels is not known"
    if normals is not None:
        try:
            region = equilibrium_region(points, normals, balance.friction, balance.sides, TOLERANCE)
            unknown = ""
        except InvalidInput as error:
            unknown = str(error)
    corners = {"plain": support_polygon(points), "conservative": conservative_polygon(points)}
    if region is not None:
        corners["friction"] = region.corners
    return Support(tuple(legs), points, corners, region, unknown, assumed)
