"""Who acts on the rover: the identity of the request, and which of its pages or programs it comes from."""

from typing import Annotated

from fastapi import Depends, Header
from starlette.requests import HTTPConnection

from footfall.api.auth.who import LONGEST_PAGE_NAME, PAGE_HEADER, PAGE_NAME, identity_of, paged
from footfall.session.access.identity import Identity

Page = Annotated[
    str,
    Header(
        alias=PAGE_HEADER,
        description="which page or program asks: a name of its own choice, the same in each of its requests. Whoever "
        "holds the conn holds it as one of them; programs of one account that send none count as one.",
        max_length=LONGEST_PAGE_NAME,
        pattern=PAGE_NAME,
    ),
]


def actor(connection: HTTPConnection, page: Page = "") -> Identity:
    """The identity of the request, told apart by page."""
    return paged(identity_of(connection), page)


Actor = Annotated[Identity, Depends(actor)]
