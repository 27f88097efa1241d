"""Logging in and out, who one is, and for admins who else there is and what was done to accounts.

Accounts are made and changed on the command line (``footfall accounts``), by who owns the file.
"""

from typing import Annotated, TypedDict

from anyio import CapacityLimiter, to_thread
from fastapi import Query, Request, Response
from pydantic import Field

from footfall.api.access import client_of
from footfall.api.auth.who import ENDS, Who, cookie_name
from footfall.api.bodies.settings_models import Strictly
from footfall.api.door.front import Front
from footfall.api.door.problems import Problem
from footfall.api.routing import Routes
from footfall.core.errors import Conflict
from footfall.session.access.accounts import LOGIN_LASTS, Accounts, AccountsUnreadable, LoginRefused
from footfall.session.access.identity import Identity

router = Routes(tags=["accounts"])

OPEN = "no login: anyone on this computer can command"
"""What the page says where the server recognises nobody."""

# Hashing takes 64 MiB and a core each: a flood of logins has to wait in line, not the others.
_hashing = CapacityLimiter(2)


class LoginOrder(Strictly):
    """Name and password of an account."""

    name: Annotated[str, Field(max_length=200, examples=["ada"])]
    password: Annotated[str, Field(max_length=1024, examples=["correct horse battery staple"])]


class Me(TypedDict):
    """Who asks."""

    name: str
    role: Annotated[
        str, Field(description="viewer, planner, commander or admin; each may do all that those before may")
    ]
    accounts: Annotated[bool, Field(description="false: nobody has to log in, everybody may do everything")]
    notice: str
    ends: Annotated[float | None, Field(description="when this login or token ends [s since 1970]")]


class AccountListed(TypedDict):
    """An account; of its password nothing."""

    name: str
    role: str
    created: float


class TokenListed(TypedDict):
    """A token; of its secret nothing."""

    name: str
    account: Annotated[str | None, Field(description="whose it is; null: a rover's")]
    role: Annotated[str | None, Field(description="the most that it may do; null: as much as its account")]
    created: float
    expires: float


class Everybody(TypedDict):
    """Who may come in."""

    accounts: list[AccountListed]
    tokens: list[TokenListed]


class Entry(TypedDict):
    """One entry of the record."""

    seq: int
    time: float
    who: str
    act: str
    what: str
    client: Annotated[str, Field(description="address, or `command line`")]


class Record(TypedDict):
    """A part of the record, oldest first."""

    entries: list[Entry]


@router.post("/login")
async def log_in(order: LoginOrder, request: Request, response: Response) -> Me:
    """Log in with a password; the answer sets the cookie that later requests of the page carry."""
    accounts, front = accounts_of(request), front_of(request)
    client = client_of(request)
    replaced = request.cookies.get(cookie_name(front))
    try:
        made = await to_thread.run_sync(accounts.log_in, order.name, order.password, client, replaced, limiter=_hashing)
    except LoginRefused as refused:
        raise Problem(
            refused.kind, 429 if refused.retry_after else 401, refused.message, **refused.details
        ) from refused
    except AccountsUnreadable as err:
        text = f"the accounts can't be read or written ({err}); see to the server's disk, or its database"
        raise Problem("accounts-unreadable", 503, text) from err
    set_login(response, front, made.secret)
    return _me(made.identity, made.ends)


@router.post("/logout", status_code=204)
def log_out(request: Request, who: Who) -> Response:
    """End this login; its cookie opens nothing from now on."""
    front, answer = front_of(request), Response(status_code=204)
    secret = request.cookies.get(cookie_name(front))
    if secret is not None:
        accounts_of(request).log_out(secret, who)
    set_login(answer, front, "")
    return answer


@router.get("/me")
def me(request: Request, who: Who) -> Me:
    """Who I am to this server, and what I may do."""
    return _me(who, request.scope[ENDS])


@router.get("/accounts")
def everybody(request: Request) -> Everybody:
    """Every account and token."""
    accounts = accounts_of(request)
    return {
        "accounts": [{"name": one.name, "role": one.role, "created": one.created} for one in accounts.everyone()],
        "tokens": [
            {
                "name": one.name or "",
                "account": one.account,
                "role": one.role,
                "created": one.created,
                "expires": one.expires,
            }
            for one in accounts.tokens()
        ],
    }


@router.get("/audit")
def audit(
    request: Request,
    after: Annotated[int, Query(ge=-1, le=2**53, description="entries after this number")] = -1,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Record:
    """Logins, refusals and changes of accounts: who did what, when and from where."""
    return {
        "entries": [
            {"seq": one.seq, "time": one.time, "who": one.who, "act": one.act, "what": one.what, "client": one.client}
            for one in accounts_of(request).audit(after, limit)
        ]
    }


def accounts_of(request: Request) -> Accounts:
    """Who may come in. Raises Conflict where everybody may."""
    found: Accounts | None = request.app.state.accounts
    if found is None:
        raise Conflict(f"this server has {OPEN}")
    return found


def front_of(request: Request) -> Front:
    """How the server is reached."""
    return request.app.state.front


def _me(who: Identity, ends: float | None) -> Me:
    some = ends is not None
    return {"name": who.name, "role": who.role.value, "accounts": some, "notice": "" if some else OPEN, "ends": ends}


def set_login(response: Response, front: Front, secret: str) -> None:
    """Have the browser carry a login from now on; "": none any more."""
    response.set_cookie(
        cookie_name(front),
        secret,
        max_age=int(LOGIN_LASTS) if secret else 0,
        path="/",
        secure=front.secure,
        httponly=True,
        samesite="strict",
    )
