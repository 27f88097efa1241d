"""Commands and sequences of them: what the rover is told, with what it is predicted to do."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.value import Provenance, Value, value


@value
class Command(Value):
    """One command.

    name: "LEG_MOVE" (drive one leg's joints in a straight joint-space line to ``joints``) or "WAIT".
    leg: which leg; None for WAIT.
    joints: target angles of that leg, (6,) [rad]; None for WAIT.
    duration: seconds from its start to its end.
    phase: "lift", "swing", "lower", or "" where an operator wrote it.
    """

    name: str
    leg: int | None
    joints: NDArray[np.float64] | None
    duration: float
    phase: str = ""


@value
class RuleResult(Value):
    """One rule checked on one row. row: index of the command, −1 for the whole sequence."""

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
    def duration(self) -> float:
        """Sum of the durations [s]."""
        return float(sum(command.duration for command in self.commands))
