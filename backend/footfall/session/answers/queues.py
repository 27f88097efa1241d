"""What is told of a queue of steps and moves of the chassis."""

from typing import TypedDict

from footfall.session.answers.notes import DigestText


class QueuedAnswer(TypedDict):
    """One entry. number: from 1. what: for a person. plan: the step or move that was queued. leg: whose foot, null: the
    chassis moves.

    duration: of commands that take the rover as rigid [s]. margin: the least of balance [m], null where none has a
    size. before: the queue without it and all after it, to which `PUT queues/current` shortens; null: the empty one.
    """

    number: int
    what: str
    plan: DigestText
    leg: int | None
    duration: float
    margin: float | None
    before: DigestText | None


class QueueAnswer(TypedDict):
    """The queue. goes_on: whether it is planned from its end. carried_out: whether the rover did all of it."""

    digest: DigestText
    entries: list[QueuedAnswer]
    goes_on: bool
    carried_out: bool
