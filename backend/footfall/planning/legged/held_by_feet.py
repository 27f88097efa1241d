"""What feet of a robot that others described hold: the outlines that ATHLETE's wheels have, by the same functions."""

from collections.abc import Sequence

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.frames import apply
from footfall.maps.support_outlines import Support, support_on
from footfall.planning.legged.footing import rest
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

UP = np.array([0.0, 0.0, 1.0])


def held_by_feet(
    robot: LeggedRobot,
    dem: Dem | None,
    state: RobotState,
    legs: Sequence[int],
    balance: BalanceSettings | None = None,
) -> Support:
    """What the feet of some legs hold.

    A foot touches where a ball, disc or point comes to rest under it; where nobody saw that ground it is taken as level
    there.

    Args:
        robot: the robot.
        dem: the ground, in site; None: each foot touches at its lowest point, and the equilibrium region is not known.
        state: of the robot.
        legs: numbers of the legs that stand.
        balance: friction and the sides of its cones count; None: as delivered.

    Returns:
        Contacts, support polygons and equilibrium regions.
    """
    soles = apply(state.T_site_base, placed(robot, state.posture).soles)
    points = soles - robot.radii[:, None] * UP
    if dem is None:
        return support_on(legs, points[list(legs)], None)
    normals, assumed = np.tile(UP, (len(points), 1)), []
    for leg in legs:
        found = rest(dem, soles[leg, 0], soles[leg, 1], float(robot.radii[leg]))
        if np.isfinite(found.normal).all():
            points[leg], normals[leg] = found.contact, found.normal
        else:
            assumed.append(leg)
    return support_on(legs, points[list(legs)], normals[list(legs)], balance, tuple(assumed))
