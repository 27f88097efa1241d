"""A legged robot standing still on its terrain, to begin a walk."""

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.planning.legged.chassis_poses import over_all_feet
from footfall.planning.legged.footing import Rest
from footfall.planning.legged.problem import LeggedSettings, LeggedState
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.whole_check import Refusal
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem


def stand(
    robot: LeggedRobot,
    dem: Dem,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    settings: LeggedSettings | None = None,
) -> LeggedState:
    """Stand a robot with its chassis near (x, y) with heading yaw, each foot near its place at ease.

    Args:
        robot: the robot.
        dem: the ground, in site.
        x: east, of the chassis' origin in site [m].
        y: north, of the chassis' origin in site [m].
        yaw: heading of the chassis in site [rad].
        settings: with what the stance is checked; None: as delivered.

    Returns:
        The state of the robot at rest.

    Raises:
        InvalidInput: there is no such stance; the message says what refused it and by how much.
    """
    return stand_on(Ground(robot, dem, settings or LeggedSettings()), x, y, yaw)


def stand_on(ground: Ground, x: float, y: float, yaw: float) -> LeggedState:
    """As :func:`stand`, on a ground that is made ready.

    Args:
        ground: robot, terrain and settings.
        x: east, of the chassis in site [m].
        y: north, of the chassis in site [m].
        yaw: heading of the chassis in site [rad].

    Returns:
        The state of the robot at rest.

    Raises:
        InvalidInput: there is no such stance; the message says what refused it and by how much.
    """
    if not np.isfinite([x, y, yaw]).all():
        raise InvalidInput("a place to stand needs finite x, y [m] and yaw [rad]")
    robot = ground.robot
    rests: list[Rest] = []
    for leg in robot.legs:
        found = next(ground.footfalls(leg, *ground.home(leg, x, y, yaw)), None)
        if found is None:
            at = ground.home(leg, x, y, yaw)
            raise InvalidInput(
                f"{robot.name} can't stand at ({x:g}, {y:g}): near ({at[0]:z.2f}, {at[1]:z.2f}) m under leg "
                f"{robot.leg_names[leg]} no ground is known that is less steep than {ground.settings.steepest:g} rad",
                leg=leg,
            )
        rests.append(found)
    soles, contacts, normals = (np.array([one[part] for one in rests]) for part in range(3))
    refusal: Refusal | None = None
    for q, T_site_base, answer in over_all_feet(ground, soles, contacts, normals, x, y, yaw):
        if not isinstance(answer, Refusal):
            return ground.state(q, T_site_base, soles, contacts, normals)
        refusal = refusal or answer
    nearest = "nothing was tried" if refusal is None else f"{refusal.name} {refusal.margin:+.4g}, {refusal.where}"
    raise InvalidInput(f"{robot.name} can't stand at ({x:g}, {y:g}): {nearest}", x=x, y=y, yaw=yaw)
