"""Mass and centre of mass with another payload than the robot's description carries."""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.settings import BalanceSettings
from footfall.robot.model import Robot

Array = NDArray[np.float64]

ON_DECK = (0.0, 0.0, 0.3)
"""Centre of a payload that stands on the deck, in base [m]."""


def loaded(robot: Robot, coms_base: Array, settings: BalanceSettings) -> tuple[float, Array]:
    """Mass [kg] and centres of mass in base, (…, 3) [m], with the payload of the settings instead of the robot's.

    coms_base: those of the robot as its description has it.
    """
    if settings.payload_mass is None:
        return robot.mass, coms_base
    own = robot.description.payload
    place = own.position if own is not None else np.array(ON_DECK)
    moment = robot.mass * coms_base
    mass = robot.mass
    if own is not None:
        moment, mass = moment - own.mass * own.position, mass - own.mass
    if settings.payload_position is not None:
        place = settings.payload_position
    mass += settings.payload_mass
    return mass, (moment + settings.payload_mass * place) / mass
