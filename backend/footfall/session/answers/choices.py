"""What is told of what was chosen, and of what is in hand."""

from typing import Annotated, Literal, TypedDict

from footfall.session.answers.commands import HolderAnswer
from footfall.session.answers.notes import OneOf, Says

What = Literal["footfall", "point", "chassis"]
"""What can be held in hand."""


class Elsewhere(TypedDict):
    """The middle of a cell, site frame [m], and how far away it is [m]."""

    x: float
    y: float
    away: float


class FootfallChosen(TypedDict):
    """Where a leg is to stand, site frame [m]."""

    leg: int
    x: float
    y: float


class FootfallAnswer(TypedDict):
    """What is known of the ground at a chosen footfall and, if it is not acceptable, why.

    slope [rad]. margin [m]: the one that decides. nearest: where it is not acceptable, the nearest place that is.
    """

    leg: int
    x: float
    y: float
    z: float | None
    known: bool
    normal: list[float] | None
    slope: float | None
    footing: str | None
    margin: float | None
    maps_current: bool
    acceptable: bool | None
    reasons: list[str]
    nearest: Elsewhere | None


class PointsAnswer(TypedDict):
    """Points that the wheel's centre of a leg is to pass, site frame [m]."""

    leg: int
    points: list[list[float]]


class ChoiceAnswer(TypedDict):
    """A choice that can be taken back or made again: `choice` is the number of its event, `by` who made it."""

    choice: int
    kind: Annotated[str, OneOf(lambda: ("footfall", "points", "plan", "queue", "edit", "stiffness"))]
    leg: int | None
    by: str


class Undoable(TypedDict):
    """What would be taken back, and made again; null: nothing."""

    undo: ChoiceAnswer | None
    redo: ChoiceAnswer | None


class ReadOutAnswer(TypedDict):
    """What is told of a place. good: null where nothing is known for or against; brief: what it is, in few words; text:
    where it is too, and how far that is from where it was; reasons: what is against it; lines: of every layer.
    """

    good: bool | None
    brief: str
    text: str
    reasons: list[str]
    lines: list[str]


class HeldAnswer(TypedDict):
    """What is in hand, whose, and what is told of the place where it is. `moved`: not where it was taken up."""

    what: What
    index: int
    leg: int | None
    place: list[float]
    moved: bool
    by: HolderAnswer
    read: ReadOutAnswer
    refused: Annotated[str, Says("why it could not be chosen where it was let go")]
