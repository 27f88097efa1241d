"""Login with the accounts of an organisation: to its provider and back; off unless ``oidc.toml`` names one."""

import logging
from typing import Annotated, TypedDict

from fastapi import Query, Request, Response
from pydantic import Field
from starlette.responses import HTMLResponse, RedirectResponse

from footfall.api.access import BASE, client_of
from footfall.api.auth.oidc import LASTS, SignOn, SignOnFailed
from footfall.api.auth.who import cookie_name
from footfall.api.door.front import Front
from footfall.api.routes.accounts import accounts_of, front_of, set_login
from footfall.api.routing import Routes
from footfall.core.errors import Conflict, FootFallError
from footfall.session.access.accounts import AccountsUnreadable

router = Routes(tags=["accounts"])
_log = logging.getLogger(__name__)

# A cookie that is for this server's own pages alone (SameSite=Strict) does not go along while the browser still comes
# from the provider: this page of our own leads on.
_HOME = '<!doctype html><meta http-equiv="refresh" content="0;url=/"><title>FootFall</title><a href="/">FootFall</a>'


class Ways(TypedDict):
    """How one may log in."""

    provider: Annotated[str | None, Field(description="issuer of the organisation's accounts; null: local ones only")]


@router.get("/login/ways")
def ways(request: Request) -> Ways:
    """Whether there is another way than name and password."""
    found = _sign_on(request)
    return {"provider": None if found is None else found.settings.issuer}


@router.get(
    "/login/oidc",
    status_code=303,
    response_class=RedirectResponse,
    responses={303: {"description": "to the provider, or back with a reason"}},
)
def leave(request: Request) -> Response:
    """Go to the organisation's provider to log in there."""
    sign_on, front = _required(request), front_of(request)
    base = front.public or f"{request.url.scheme}://{request.url.netloc}"
    try:
        address, state = sign_on.begin(f"{base}{BASE}/login/oidc/back")
    except SignOnFailed as err:
        return _failed(front, err)
    answer = RedirectResponse(address, 303)
    _set_state(answer, front, state)
    return answer


@router.get(
    "/login/oidc/back",
    response_class=HTMLResponse,
    responses={303: {"description": "to the login page, with a reason"}},
)
def come_back(
    request: Request,
    state: Annotated[str, Query(max_length=200)] = "",
    code: Annotated[str, Query(max_length=4096)] = "",
    error: Annotated[str, Query(max_length=200)] = "",
) -> Response:
    """Where the provider sends the browser: it is logged in, or the login page says why not."""
    sign_on, accounts, front = _required(request), accounts_of(request), front_of(request)
    client = client_of(request)
    try:
        if not state or request.cookies.get(_state_name(front)) != state:
            raise SignOnFailed("expired", "this browser did not begin the login that it ends")
        if error or not code:
            raise SignOnFailed("refused", f"the provider refused: {error or 'it gave no code'}")
        person = sign_on.end(state, code)
        replaced = request.cookies.get(cookie_name(front))
        made = accounts.log_in_known(person.issuer, person.subject, person.name, person.role, client, replaced)
    except SignOnFailed as err:
        return _failed(front, err)
    except AccountsUnreadable as err:
        return _failed(front, SignOnFailed("unreadable", f"the accounts can't be read or written: {err}"))
    except FootFallError as err:
        return _failed(front, SignOnFailed("taken", err.message))
    answer = HTMLResponse(_HOME)
    _set_state(answer, front, "")
    set_login(answer, front, made.secret)
    return answer


def _failed(front: Front, err: SignOnFailed) -> Response:
    _log.warning("a login with the provider failed (%s): %s", err.kind, err.message)
    answer = RedirectResponse(f"/login.html?sign-on={err.kind}", 303)
    _set_state(answer, front, "")
    return answer


def _sign_on(request: Request) -> SignOn | None:
    return request.app.state.sign_on


def _required(request: Request) -> SignOn:
    found = _sign_on(request)
    if found is None:
        raise Conflict("this server knows no provider to log in with; log in with name and password")
    if request.app.state.accounts is None:
        raise Conflict("this server asks nobody to log in")
    return found


def _state_name(front: Front) -> str:
    return f"{cookie_name(front)}-sign-on"


def _set_state(response: Response, front: Front, state: str) -> None:
    # lax: it has to come along when the provider sends the browser back
    age = int(LASTS) if state else 0
    name = _state_name(front)
    response.set_cookie(name, state, max_age=age, path="/", secure=front.secure, httponly=True, samesite="lax")
