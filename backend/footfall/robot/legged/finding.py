"""What a check of a robot's description found, in three grades."""

from enum import Enum

from footfall.core.value import Value, value, value_enum


@value_enum
class Grade(Enum):
    """GOOD: as it should be. DOUBTFUL: can be used, look at it. UNUSABLE: must be changed first."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    UNUSABLE = "can't be used"


SIGNS = {Grade.GOOD: "●", Grade.DOUBTFUL: "▲", Grade.UNUSABLE: "✕"}


@value
class Finding(Value):
    """check: what was looked at; where: name of the link, joint or leg, empty for the whole robot; text: in words."""

    grade: Grade
    check_name: str
    where: str
    text: str


def good(check: str, text: str, where: str = "") -> Finding:
    """A finding that speaks for the robot."""
    return Finding(Grade.GOOD, check, where, text)


def doubtful(check: str, where: str, text: str) -> Finding:
    """A finding that somebody should look at; the robot can be used."""
    return Finding(Grade.DOUBTFUL, check, where, text)


def unusable(check: str, where: str, text: str) -> Finding:
    """A finding with which the robot can't be used."""
    return Finding(Grade.UNUSABLE, check, where, text)
