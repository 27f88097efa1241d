"""A rover standing still to begin a walk: level where that can be, else leaning with the ground."""

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.forces import distribute
from footfall.balance.tether import Tether
from footfall.balance.torques import holding_torques, torque_check
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.maps.standing import contacts
from footfall.planning.body.stand import stand as stand_level
from footfall.planning.scene.under_links import ground_near_links
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.rappel import AROUND
from footfall.planning.walk.slope_frame import slope_between
from footfall.planning.walk.stance_search import LEANS, TURNED, WITHIN, search_stance
from footfall.robot.kinematics import center_of_mass
from footfall.robot.meshes.collision import posture_collisions
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

AT_EASE = "stand"
"""The posture that a search may depart from; whoever asks for another wants that one."""


def stand(
    robot: Robot,
    dem: Dem,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    posture: str = AT_EASE,
    tether: Tether | None = None,
) -> RobotState:
    """Stand a rover at (x, y) with heading yaw, its chassis level where that can be.

    The level stance is that of :func:`footfall.planning.body.stand.stand`. Where there is none, and the posture is
    "stand", a search of some seconds sets the feet anywhere near; the chassis then is within 0.15 m and 0.15 rad of
    what was asked, and leans at most 0.6 rad to each side. A walk may begin in what it finds. On a tether the search
    alone is asked, and leaning is counted from the slope.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, of the chassis' origin in site [m].
        y: north, of the chassis' origin in site [m].
        yaw: heading of the chassis in site [rad].
        posture: name of the posture that the stance is to come near; of no account on a tether.
        tether: that the rover hangs on; None: none.

    Returns:
        The state of the rover at rest, at time 0.

    Raises:
        InvalidInput: both find nothing: the ground under a wheel is unknown, a leg can't reach it, the rover would
            collide, or no contact forces hold it.
        NotFound: the robot has no posture of that name.
    """
    if tether is not None:
        return hanging(robot, dem, x, y, yaw, tether)
    try:
        return stand_level(robot, dem, x, y, yaw, posture)
    except InvalidInput as refused:
        # what makes no sense, or is unknown, no search finds
        if posture != AT_EASE or "unknown_under" in refused.details or not np.isfinite([x, y, yaw]).all():
            raise
        found = search_stance(robot, dem, x, y, yaw)
        state = None if found is None else _judged(robot, dem, *found)
        if state is None:
            message = (
                f"{refused.message}; nor was a stance found with the chassis up to {WITHIN:g} m and {TURNED:g} rad "
                f"from there and leaning up to {LEANS:g} rad"
            )
            raise InvalidInput(message, **refused.details) from None
        return state


def hanging(robot: Robot, dem: Dem, x: float, y: float, yaw: float, tether: Tether) -> RobotState:
    """Stand a rover on a tether.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, in site [m].
        y: north, in site [m].
        yaw: heading in site [rad].
        tether: that it hangs on.

    Returns:
        The state of the rover at rest.

    Raises:
        InvalidInput: no stance is found, or it is not free or not held.
    """
    here = np.array([x, y])
    found = search_stance(robot, dem, x, y, yaw, Hung(slope_between(dem, here, here, AROUND, tether.anchor), tether))
    if found is None:
        raise InvalidInput(f"{robot.name} can't stand at ({x:g}, {y:g}) on its tether: no stance was found", x=x, y=y)
    q, T_site_base = found
    hits = posture_collisions(robot, q, T_site_base, ground_near_links(robot, dem, q, T_site_base))
    feet = contacts(robot, dem, q, T_site_base, robot.legs)
    held = torque_check(robot, q, T_site_base, robot.legs, feet.normals, BalanceSettings(), tether)
    if hits or not held.holds:
        why = f"{hits[0].link_a} and {hits[0].link_b} would be too near" if hits else "nothing holds it"
        raise InvalidInput(f"{robot.name} can't stand at ({x:g}, {y:g}) on its tether: {why}", x=x, y=y)
    return RobotState(robot.name, 0.0, q, T_site_base, held.forces, held.torques, "idle")


def _judged(robot: Robot, dem: Dem, q: Array, T_site_base: Array) -> RobotState | None:
    """The state with forces and torques; None where the exact meshes collide or no forces hold it."""
    if posture_collisions(robot, q, T_site_base, ground_near_links(robot, dem, q, T_site_base)):
        return None
    feet = contacts(robot, dem, q, T_site_base, robot.legs)
    com = apply(T_site_base, center_of_mass(robot, q))
    forces = distribute(feet.points, feet.normals, com, robot.mass)
    if forces is None:
        return None
    torques = holding_torques(robot, q, T_site_base, robot.legs, feet.points, forces)
    return RobotState(robot.name, 0.0, q, T_site_base, forces, torques, "idle")
