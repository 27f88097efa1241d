"""Mass and centre of mass with another payload than the robot's description carries."""

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.arrays import Array
from footfall.robot.description import ON_DECK
from footfall.robot.model import Robot


def carried(robot: Robot, settings: BalanceSettings) -> tuple[float, Array] | None:
    """Mass [kg] of what the rover carries by the settings, and its centre in base, (3,) [m]; None: nothing."""
    own = robot.description.payload
    if settings.payload_mass is None:
        return None if own is None else (own.mass, own.position)
    if settings.payload_position is not None:
        return settings.payload_mass, settings.payload_position
    return settings.payload_mass, own.position if own is not None else np.array(ON_DECK)


def loaded(robot: Robot, coms_base: Array, settings: BalanceSettings) -> tuple[float, Array]:
    """Mass and centres of mass with the payload of the settings instead of the robot's.

    Args:
        robot: the rover.
        coms_base: (…, 3) of the robot as its description has it, in base [m].
        settings: whose payload counts.

    Returns:
        Mass [kg] and centres of mass (…, 3) in base [m].
    """
    load, own = carried(robot, settings), robot.description.payload
    if settings.payload_mass is None or load is None:
        return robot.mass, coms_base
    moment, mass = robot.mass * coms_base, robot.mass
    if own is not None:
        moment, mass = moment - own.mass * own.position, mass - own.mass
    mass += load[0]
    return mass, (moment + load[0] * load[1]) / mass
