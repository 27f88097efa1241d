"""What planning answers: how it ended, and what was checked."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value, value_enum


@value_enum
class Status(Enum):
    """How planning ended. Only FOUND comes with a plan."""

    FOUND = "found"
    NO_PATH = "no_path"
    TIME_LIMIT = "time_limit"
    START_INVALID = "start_invalid"
    GOAL_INVALID = "goal_invalid"
    OFF_MAP = "off_map"
    UNKNOWN_GROUND = "unknown_ground"


def require_answer(status: Status, found: object, called: str = "a plan") -> None:
    """Raises InvalidInput unless what was found is there with status FOUND, and only then."""
    if (status is Status.FOUND) != (found is not None):
        raise InvalidInput(f"{called} comes with status FOUND, and only then")


@value
class Check(Value):
    """One thing that was checked. margin: positive = held by that much; NaN where it has no size.

    where: where the margin is least (waypoint, phase, pair of links…), for a person.
    """

    name: str
    holds: bool
    margin: float
    unit: str
    where: str


def least_of(checks: Iterable[Check]) -> tuple[Check, ...]:
    """Of each check, by its name, the one with the least margin."""
    least: dict[str, Check] = {}
    for check in checks:
        known = least.get(check.name)
        if known is None or not known.margin <= check.margin:
            least[check.name] = check
    return tuple(least.values())


@dataclass(frozen=True)
class No:
    """A refusal on the way to an answer: how planning ends, why and what to try, and what was checked."""

    status: Status
    reason: str
    checks: tuple[Check, ...] = ()
