"""How stable the rover would stand with one leg moved to each reachable cell."""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins_for_candidates
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.maps.reach import Reach
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.surface import normal_at

Array = NDArray[np.float64]


def standing_contacts(robot: Robot, dem: Dem, state: RobotState, legs: list[int]) -> Array:
    """Where the wheels of some legs touch the ground, in site, (k, 3) [m].

    Each is the lowest rim point along the ground's normal under its wheel, or along z where the ground
    there is unknown. Every one of these legs is taken to stand.
    """
    centers = apply(state.T_site_base, wheel_centers(robot, state.posture)[legs])
    normals = normal_at(dem, centers[:, 0], centers[:, 1], robot.wheel_radius)
    normals[~np.isfinite(normals).all(axis=1)] = (0.0, 0.0, 1.0)
    points = [
        contact_point(robot, state.posture, leg, state.T_site_base, normal)
        for leg, normal in zip(legs, normals, strict=True)
    ]
    return np.array(points)


def stability(robot: Robot, dem: Dem, state: RobotState, leg: int, reached: Reach, conservative: bool) -> Array:
    """Absolute stability margin [m] for each cell of ``reached``, (n,); NaN where the leg has no solution.

    The polygon is that of the other wheels' contacts and the cell, seen from above; the centre of mass is
    that of the present posture with the leg at the cell, in the solution nearest to its present angles.
    Raises InvalidInput where fewer than three other legs could carry the rover meanwhile.
    """
    others = [other for other in robot.legs if other != leg]
    if len(others) < 3:
        raise InvalidInput(f"{robot.name} stands on {len(others)} legs while leg {leg} moves; it needs three")
    fixed = standing_contacts(robot, dem, state, others)
    coms = apply(state.T_site_base, centers_of_mass(robot, state.posture, leg, reached.postures))
    return margins_for_candidates(fixed, reached.contacts[:, :2], coms[:, :2], conservative)
