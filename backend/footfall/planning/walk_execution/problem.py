"""What is sent to the rover for a walk, foot move by foot move, and what is expected of it."""

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.product import Product
from footfall.core.value import Provenance, Value, value
from footfall.planning.answers import Check, Status
from footfall.planning.execution.problem import BodyExecution, Execution, Predicted, require_execution


@value
class FootMoveExecution(Value):
    """One foot move of a walk: the chassis goes over all feet, then one foot is moved.

    number: of the foot move in the walk, 0…m; m is the chassis' way after the last. body: None where the chassis stays;
    step: None after the last.
    """

    number: int
    body: BodyExecution | None
    step: Execution | None

    def check(self) -> None:
        """Raises InvalidInput where it moves nothing."""
        if self.body is None and self.step is None:
            raise InvalidInput(f"foot move {self.number} moves nothing")

    @property
    def parts(self) -> tuple[Predicted, ...]:
        """One or two, in their order."""
        return tuple(part for part in (self.body, self.step) if part is not None)

    @property
    def seconds(self) -> float:
        """How long it takes [s]."""
        return sum(part.seconds for part in self.parts)


@value
class WalkExecution(Product):
    """Executions of neighbouring foot moves of a walk; each part starts from the rest that the one before ends in."""

    moves: tuple[FootMoveExecution, ...]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput unless its foot moves, one or more, are neighbours in order."""
        numbers = [move.number for move in self.moves]
        if not numbers or np.any(np.diff(numbers) != 1):
            raise InvalidInput("an execution of a walk is of neighbouring foot moves, one or more", numbers=numbers)

    @property
    def parts(self) -> tuple[Predicted, ...]:
        """All of its moves and steps, in their order."""
        return tuple(part for move in self.moves for part in move.parts)

    @property
    def seconds(self) -> float:
        """How long it takes [s]."""
        return sum(move.seconds for move in self.moves)


@value
class WalkExecutionResult(Value):
    """The answer to one request to execute a walk.

    ``reason`` says at which foot move which check failed, by how much, where and what to try. execution: with status
    FOUND all that was asked for; else the foot moves before the one that fails, None where that is the first.
    failed_at: the number of that foot move, None with FOUND. checks: with FOUND of each check the least over all parts;
    else those of the part that fails.
    """

    status: Status
    execution: WalkExecution | None
    reason: str
    checks: tuple[Check, ...]
    provenance: Provenance
    failed_at: int | None = None

    def check(self) -> None:
        """Raises InvalidInput unless status FOUND has an execution, and any other the foot move that fails."""
        if (self.status is Status.FOUND) != (self.failed_at is None):
            raise InvalidInput("a foot move fails where the status is not FOUND, and only then")
        require_execution(self.status, self.execution)
