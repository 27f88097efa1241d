"""Finds out who sends a request, before anything of it is read: by token, by cookie, or not at all."""

import contextlib
import time
from http.cookies import CookieError, SimpleCookie

from anyio import to_thread
from starlette.datastructures import Headers
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from footfall.api.access import BASE
from footfall.api.auth.who import ENDS, IDENTITY, ROVER, cookie_name
from footfall.api.door.front import Front
from footfall.api.door.problems import problem
from footfall.session.access.accounts import Accounts, AccountsUnreadable, Pass
from footfall.session.access.identity import LOCAL, Identity, Role

PAGE_FILES = ("/login.html", "/icon.svg", "/css/", "/js/", "/vendor/")
"""What everybody may read: the page's own files, which hold no secret."""
_HOME = ("/", "/index.html")
_HEALTH = ("/health/live", "/health/ready")
_LOGINS = tuple(f"{BASE}/login{way}" for way in ("", "/ways", "/oidc", "/oidc/back"))
_STOPS = (f"{BASE}/stop", f"{BASE}/stop/line")
LOOK_AGAIN = 1.0
"""How often an open stream or WebSocket is asked whether its login or token still stands [s]."""


class Identify:
    """ASGI middleware. accounts: None where everybody who reaches the server may do everything."""

    def __init__(self, app: ASGIApp, accounts: Accounts | None, front: Front) -> None:
        self.app = app
        self._accounts = accounts
        self._cookie = cookie_name(front)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        client = scope["client"][0] if scope.get("client") else ""
        if self._accounts is None:
            scope.update({IDENTITY: Identity(LOCAL.name, LOCAL.role, client), ROVER: None, ENDS: None})
            return await self.app(scope, receive, send)
        ticket = _Ticket(self._accounts, Headers(scope=scope), self._cookie, client)
        try:
            found = ticket.look()
        except AccountsUnreadable:
            found = ticket.remembered() if scope["path"] in _STOPS else None
            if found is None:
                text = "the accounts can't be read, so nobody is recognised; see to the server's disk, or its database"
                return await _turn_away(scope, receive, send, 503, "accounts-unreadable", text)
        if found is None and ticket.token is not None:
            with contextlib.suppress(*AccountsUnreadable):  # on a full disk it goes unrecorded
                await to_thread.run_sync(self._accounts.token_refused, client)
        scope.update({IDENTITY: None, ROVER: None, ENDS: None})
        if found is not None:
            scope.update({IDENTITY: found.identity, ROVER: found.rover, ENDS: found.ends})
            return await self.app(scope, *_watched(scope, receive, send, ticket, found))
        if scope["path"] in _LOGINS or scope["path"] in _HEALTH or scope["path"].startswith(PAGE_FILES):
            return await self.app(scope, receive, send)
        if scope["path"] in _HOME and scope["type"] == "http":
            return await RedirectResponse("/login.html", 303)(scope, receive, send)
        text = "log in, or send a token" if ticket.token is None else "the token is of nobody, was revoked or has ended"
        return await _turn_away(scope, receive, send, 401, "login-required", text)


class _Ticket:
    """What a request shows to be let in."""

    def __init__(self, accounts: Accounts, headers: Headers, cookie: str, client: str) -> None:
        self._accounts = accounts
        self._client = client
        kind, _, text = headers.get("authorization", "").partition(" ")
        self.token = text.strip() if kind.lower() == "bearer" else None
        self.cookie = _cookie(headers.get("cookie", ""), cookie)

    def look(self) -> Pass | None:
        if self.token is not None:
            return self._accounts.by_token(self.token, self._client)
        return None if self.cookie is None else self._accounts.by_cookie(self.cookie, self._client)

    def remembered(self) -> Pass | None:
        secret = self.token or self.cookie
        return None if secret is None else self._accounts.remembered(secret)

    def stands(self, before: Pass) -> bool:
        """Whether it still opens the door, and to the same role."""
        try:
            now = self.look()
        except AccountsUnreadable:
            now = self.remembered()
        return now is not None and _role(now) is _role(before)


def _cookie(header: str, name: str) -> str | None:
    jar = SimpleCookie()
    try:
        jar.load(header)
    except CookieError:
        return None
    return jar[name].value if name in jar else None


def _role(found: Pass) -> Role | None:
    return None if found.identity is None else found.identity.role


def _watched(scope: Scope, receive: Receive, send: Send, ticket: _Ticket, found: Pass) -> tuple[Receive, Send]:
    """``receive`` and ``send`` that end a stream or WebSocket once its ticket no longer opens what it did."""
    looked, over = time.monotonic(), False

    async def ended() -> bool:
        nonlocal looked, over
        if over or time.monotonic() - looked < LOOK_AGAIN:
            return over
        looked = time.monotonic()
        over = not ticket.stands(found)
        if over and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": "the login or token has ended"})
        elif over:
            await send({"type": "http.response.body", "body": b"", "more_body": False})
        return over

    async def receive_watched() -> Message:
        message = await receive()
        if scope["type"] == "websocket" and message["type"] == "websocket.receive" and await ended():
            return {"type": "websocket.disconnect", "code": 1008}
        return message

    async def send_watched(message: Message) -> None:
        streams = message["type"] == "http.response.body" and message.get("more_body", False)
        if not (streams or message["type"] == "websocket.send"):
            if not over:
                await send(message)
        elif not await ended():
            await send(message)
        elif scope["type"] == "websocket":
            raise OSError("the login or token has ended")

    return receive_watched, send_watched


async def _turn_away(scope: Scope, receive: Receive, send: Send, status: int, kind: str, text: str) -> None:
    if scope["type"] == "websocket":
        return await WebSocket(scope, receive, send).close(1008, kind)
    answer = problem(kind, status, text)
    if status == 401:
        answer.headers["WWW-Authenticate"] = 'Bearer realm="FootFall"'
    return await answer(scope, receive, send)
