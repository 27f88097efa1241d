"""Who acts on the rover: the identity of the request, and which of its pages or programs it comes from."""

from dataclasses import replace
from typing import Annotated

from fastapi import Depends, Header
from starlette.requests import HTTPConnection

from footfall.api.auth.who import identity_of
from footfall.session.identity import Identity

Page = Annotated[
    str,
    Header(
        alias="FootFall-Page",
        description="which page or program asks: a name of its own choice, the same in each of its requests. Whoever "
        "holds the conn holds it as one of them; programs of one account that send none count as one.",
        max_length=64,
        pattern=r"^[A-Za-z0-9_-]*$",
    ),
]


def actor(connection: HTTPConnection, page: Page = "") -> Identity:
    """The identity of the request, told apart by page."""
    return replace(identity_of(connection), page=page)


Actor = Annotated[Identity, Depends(actor)]
