"""The rover in physics carries what its commands were planned with."""

import numpy as np

from footfall.balance.payload import carried
from footfall.robot.description import BOX, ON_DECK, with_payload
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.sequence.sequence_settings import SequenceSettings

LEAST_BOX = 0.1
"""Sides of a payload's box, at least [m]."""


def laden(robot: Robot, sequence: Sequence) -> Robot:
    """The rover with the payload that a sequence was made and checked with.

    A box whose centre is off that of the usual one is smaller, so that it is nowhere outside it: what has to stay clear
    of legs when a walk is planned is the usual one.

    Args:
        robot: as its description has it.
        sequence: what it is to do.

    Returns:
        The rover; itself where the sequence says nothing of a payload.
    """
    made_with = sequence.provenance.settings
    if not isinstance(made_with, SequenceSettings) or made_with.balance.payload_mass is None:
        return robot
    load = carried(robot, made_with.balance)
    mass, at = (0.0, np.zeros(3)) if load is None else load
    usual = robot.description.payload
    box, middle = (np.array(BOX), np.array(ON_DECK)) if usual is None else (usual.size, usual.position)
    size = np.maximum(box - 2.0 * np.abs(at - middle), LEAST_BOX)
    return Robot(with_payload(robot.description, mass, size, at))
