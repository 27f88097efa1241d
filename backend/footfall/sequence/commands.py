"""Commands and sequences of them: what the rover is told, with what it is predicted to do."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance, Value, value
from footfall.robot.description import JOINTS

COMMAND_NAMES = ("LEG_MOVE", "WAIT")

LEG_JOINTS = tuple(name for name, _ in JOINTS)
"""The six joints of a leg, in the order of a command's ``joints``."""


@value
class Command(Value):
    """One command.

    name: "LEG_MOVE" (drive one leg's joints in a straight joint-space line to ``joints``) or "WAIT".
    leg: which leg; None for WAIT.
    joints: target angles of that leg, (6,) [rad]; None for WAIT.
    duration: seconds from its start to its end.
    phase: "lift", "swing", "lower", or "" where an operator wrote it.

    Raises InvalidSequence where a field has the wrong type. Numbers that break a rule are accepted
    here, so that an operator sees which rule they break.
    """

    name: str
    leg: int | None
    joints: NDArray[np.float64] | None
    duration: float
    phase: str = ""

    def check(self) -> None:
        if not isinstance(self.name, str) or not isinstance(self.phase, str):
            raise InvalidSequence("the name and the phase of a command are texts")
        if self.leg is not None and (not isinstance(self.leg, int) or isinstance(self.leg, bool)):
            raise InvalidSequence("the leg of a command is a whole number, or None", leg=repr(self.leg))
        if self.joints is not None and not (
            isinstance(self.joints, np.ndarray) and self.joints.dtype == np.float64 and self.joints.ndim == 1
        ):
            raise InvalidSequence("the joints of a command are a flat float64 array [rad], or None")
        if not isinstance(self.duration, (int, float)) or isinstance(self.duration, bool):
            raise InvalidSequence("the duration of a command is a number of seconds", duration=repr(self.duration))


@value
class RuleResult(Value):
    """One rule checked on one row. row: index of the command, −1 for the whole sequence.

    margin: positive = held by that much, in ``unit``; NaN where the rule has no size.
    """

    rule: str
    row: int
    holds: bool
    margin: float
    unit: str
    text: str


@value
class Sequence(Value):
    """Commands in order, the posture they start from, and the posture predicted after each.

    start: (legs × 6,) [rad]; predicted: (len(commands), legs × 6) [rad]; T_site_base: (4, 4).
    rules: every rule's result; a sequence may be exported and sent only when all hold.
    """

    robot: str
    commands: tuple[Command, ...]
    start: NDArray[np.float64]
    predicted: NDArray[np.float64]
    T_site_base: NDArray[np.float64]
    rules: tuple[RuleResult, ...]
    provenance: Provenance

    @property
    def valid(self) -> bool:
        """Whether every rule holds."""
        return all(rule.holds for rule in self.rules)

    @property
    def failures(self) -> tuple[RuleResult, ...]:
        """The rules that don't hold, in row order."""
        return tuple(rule for rule in self.rules if not rule.holds)

    @property
    def duration(self) -> float:
        """Sum of the durations [s]."""
        return float(sum(command.duration for command in self.commands))
