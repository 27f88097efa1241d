"""Work space of pin for a robot's whole model, and for ATHLETE's legs, kept between calls.

Making one anew takes longer than most of what it is needed for. Whoever needs one takes it out of the list of those
that nobody uses just now, so two threads never share one.
"""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any
from weakref import WeakKeyDictionary

import pinocchio as pin

from footfall.robot.model import Robot

_spare: WeakKeyDictionary[object, dict[int | None, list[Any]]] = WeakKeyDictionary()


def pin_scratch(robot: Robot, leg: int | None = None) -> AbstractContextManager[Any]:
    """A pin.Data of ``robot.model``, or of the model of one leg; what it holds is of some other call."""
    return scratch_of(robot, robot.model if leg is None else robot.leg_models[leg], leg)


@contextmanager
def scratch_of(robot: object, model: pin.Model, leg: int | None = None) -> Iterator[Any]:
    """A pin.Data of a model of any robot: of the whole one, or of ``leg``. What it holds is of some other call."""
    spare = _spare.setdefault(robot, {}).setdefault(leg, [])
    data = spare.pop() if spare else model.createData()
    yield data
    spare.append(data)
