"""The identity that every request carries in its scope, as routes read it, and the cookie of a login."""

import re
from dataclasses import replace
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from footfall.api.door.front import Front
from footfall.session.access.identity import Identity

IDENTITY = "footfall.identity"
"""Name in the scope of HTTP requests and WebSockets alike: an Identity, or None on the few paths open to anybody."""
ROVER = "footfall.rover"
"""Name in the scope: that of the rover token that was shown, else None."""
ENDS = "footfall.ends"
"""Name in the scope: when the login or token ends [s since 1970], None where nobody has to log in."""

PAGE_HEADER = "FootFall-Page"
PAGE_NAME = r"^[A-Za-z0-9_-]*$"
LONGEST_PAGE_NAME = 64


def paged(identity: Identity, page: str) -> Identity:
    """The identity as one of its pages or programs; what is no name of a page is none."""
    fits = len(page) <= LONGEST_PAGE_NAME and re.fullmatch(PAGE_NAME.strip("^$"), page)
    return replace(identity, page=page) if fits else identity


def identity_of(connection: HTTPConnection) -> Identity:
    """Who asks. Only for routes that need a role: there is always somebody."""
    return connection.scope[IDENTITY]


async def _who(connection: HTTPConnection) -> Identity:
    return identity_of(connection)


Who = Annotated[Identity, Depends(_who)]


def cookie_name(front: Front) -> str:
    """With TLS, one that browsers take from this very host only."""
    return "__Host-footfall" if front.secure else "footfall"
