"""Long lists in pages: ``limit`` items after ``cursor``, and the address of the next page."""

from collections.abc import Callable, Sequence
from typing import Annotated, TypeVar

from fastapi import Query, Request

from footfall.api.door.limits import PAGE_ITEMS
from footfall.core.errors import InvalidInput

_T = TypeVar("_T")

Limit = Annotated[int, Query(ge=1, le=PAGE_ITEMS, description="most items of the answer")]
Cursor = Annotated[
    str | None, Query(max_length=200, description="go on after this item; taken from `next` of the page before")
]


def page(
    items: Sequence[_T], name: Callable[[_T], str], limit: int, cursor: str | None, request: Request
) -> tuple[list[_T], str | None]:
    """At most ``limit`` items after the one called ``cursor``, and the address of what follows them.

    Raises InvalidInput where the list has no such item (any more).
    """
    start = 0
    if cursor is not None:
        names = [name(one) for one in items]
        if cursor not in names:
            raise InvalidInput("the list has no such item any more; begin again without a cursor", cursor=cursor)
        start = names.index(cursor) + 1
    found = list(items[start : start + limit])
    if start + limit >= len(items):
        return found, None
    return found, next_page(request, limit=limit, cursor=name(found[-1]))


def next_page(request: Request, **query: object) -> str:
    """The address of the request with other members of its query."""
    url = request.url.include_query_params(**query)
    return f"{url.path}?{url.query}"
