"""The queue of steps and moves of the chassis: what is put at its end, and taken from there."""

from collections.abc import Mapping
from typing import Any

from footfall.planning.answers import Status
from footfall.session.log.records import ProductRecord


def queues_behind(products: Mapping[str, ProductRecord], queue: str | None) -> tuple[str | None, ...]:
    """A queue, that with an entry less, and so on to None, the empty one."""
    found: list[str | None] = [queue]
    while (digest := found[-1]) is not None:
        found.append(products[digest].parents.get("queue"))
    return tuple(found)


def joined(queue: str | None, payload: Mapping[str, Any], digest: str) -> str | None:
    """The queue after an answer: that, where the plan follows the queue; else it stays as it is."""
    return digest if payload["status"] == Status.FOUND.value else queue


def shortened(products: Mapping[str, ProductRecord], queue: str | None, left: str | None) -> str | None:
    """What is left. Raises ValueError where the queue was never that, or is it already."""
    if left not in queues_behind(products, queue)[1:]:
        raise ValueError("it shortens a queue to one that was not before")
    return left
