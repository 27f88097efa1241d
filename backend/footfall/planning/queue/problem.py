"""Steps and moves of the chassis that were planned one after another, to be commanded together."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.product import Product
from footfall.core.value import Provenance, Value, value
from footfall.planning.answers import Check, Status, require_answer
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.motion import Motion
from footfall.planning.step.problem import StepPlan


@value
class QueuedPlan(Value):
    """One entry of a queue: a step or a move of the chassis.

    answer: digest of the result that has it. checks: what that was checked for.
    """

    answer: str
    step: StepPlan | None
    move: BodyMovePlan | None
    checks: tuple[Check, ...]

    def check(self) -> None:
        """Raises InvalidInput unless it is a step or a move, and one of them."""
        if (self.step is None) == (self.move is None):
            raise InvalidInput("an entry of a queue is a step or a move of the chassis")

    @property
    def plan(self) -> StepPlan | BodyMovePlan:
        """The step, or the move."""
        if self.step is not None:
            return self.step
        if self.move is None:
            raise InvalidInput("an entry of a queue is a step or a move of the chassis")
        return self.move

    @property
    def leg(self) -> int | None:
        """Whose foot it moves; None where the chassis moves."""
        return None if self.step is None else self.step.leg

    @property
    def balance(self) -> float | None:
        """The least margin of balance that it was checked for [m]; None where none has a size."""
        sizes = [one.margin for one in self.checks if "balance" in one.name and np.isfinite(one.margin)]
        return min(sizes, default=None)


@value
class PlanQueue(Product):
    """Steps and moves of the chassis; each begins exactly where the one before ends."""

    entries: tuple[QueuedPlan, ...]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput without entries."""
        if not self.entries:
            raise InvalidInput("a queue has at least one entry")

    @property
    def motion(self) -> Motion:
        """What moves, row by row, over all entries; the row in which one ends and the next begins is there once."""
        motions = [one.plan.motion for one in self.entries]
        first = motions[0]
        return Motion(
            np.concatenate([first.waypoints, *(one.waypoints[1:] for one in motions[1:])]),
            np.concatenate([first.Ts_site_base, *(one.Ts_site_base[1:] for one in motions[1:])]),
            np.concatenate([first.stays, *(one.stays[1:] for one in motions[1:])]),
            (*first.phases, *(phase for one in motions[1:] for phase in one.phases[1:])),
        )

    @property
    def waypoints(self) -> NDArray[np.float64]:
        """Postures (n, legs × 6) [rad], as of :attr:`motion`."""
        return self.motion.waypoints

    @property
    def legs(self) -> tuple[int, ...]:
        """Whose feet its steps move, in their order."""
        return tuple(one.leg for one in self.entries if one.leg is not None)

    def foot_moves(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the entries, 0…, that belong to one foot move: moves of the chassis, and the step after them."""
        found: list[tuple[int, ...]] = []
        now: tuple[int, ...] = ()
        for number, entry in enumerate(self.entries):
            now = (*now, number)
            if entry.step is not None:
                found.append(now)
                now = ()
        return (*found, now) if now else tuple(found)


@value
class QueueResult(Value):
    """The answer to one request to put a plan at the end of a queue.

    reason: says what does not fit, by how much, and what to try. plan: the queue with it, with status FOUND, and only
    then. checks: of each the least over all entries.
    """

    status: Status
    plan: PlanQueue | None
    reason: str
    checks: tuple[Check, ...]
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where a queue comes without the status for it, or is missing."""
        require_answer(self.status, self.plan)


def entries_in_words(numbers: tuple[int, ...]) -> str:
    """Entries of a queue by their numbers, 0…, for a person, who counts from 1."""
    if len(numbers) == 1:
        return f"entry {numbers[0] + 1}"
    return f"entries {numbers[0] + 1}–{numbers[-1] + 1}"
