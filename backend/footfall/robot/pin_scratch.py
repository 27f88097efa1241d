"""Work space of pin for a robot's whole model, kept between calls.

Making one anew takes longer than most of what it is needed for. Whoever needs one takes it out of the list of those
that nobody uses just now, so two threads never share one.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary

from footfall.robot.model import Robot

_spare: WeakKeyDictionary[Robot, list[Any]] = WeakKeyDictionary()


@contextmanager
def pin_scratch(robot: Robot) -> Iterator[Any]:
    """A pin.Data of ``robot.model``; what it holds is of some other call."""
    spare = _spare.setdefault(robot, [])
    data = spare.pop() if spare else robot.model.createData()
    yield data
    spare.append(data)
