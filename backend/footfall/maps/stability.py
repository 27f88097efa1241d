"""How stable the rover would stand with one leg moved to each reachable cell."""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins_for_candidates
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.maps.reach import Reach
from footfall.maps.standing import contacts, standing
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]


def stability(robot: Robot, dem: Dem, state: RobotState, leg: int, reached: Reach, conservative: bool) -> Array:
    """Absolute stability margin [m] for each cell of ``reached``, (n,); NaN where the leg has no solution.

    The polygon is that of the other standing wheels' contacts and the cell, seen from above; a wheel known to be in
    the air carries nothing. The centre of mass is
    that of the present posture with the leg at the cell, in the solution nearest to its present angles.
    Raises InvalidInput where fewer than three other legs could carry the rover meanwhile.
    """
    others = [other for other in robot.legs if other != leg]
    if len(others) < 3:
        raise InvalidInput(f"{robot.name} stands on {len(others)} legs while leg {leg} moves; it needs three")
    down = standing(robot, dem, state.posture, state.T_site_base, others)
    fixed = contacts(robot, dem, state.posture, state.T_site_base, down).points
    coms = apply(state.T_site_base, centers_of_mass(robot, state.posture, leg, reached.postures))
    return margins_for_candidates(fixed, reached.contacts[:, :2], coms[:, :2], conservative)
