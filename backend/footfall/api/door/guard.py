"""Which requests are heard at all: those for this server's own names, from its own pages or from programs.

Two doors are open to a web page of somebody else in the operator's browser: requests across origins (WebSockets are
never held back by the browser) and DNS rebinding. The first shows in ``Origin``, the second in ``Host``. Where a
browser sends a login's cookie along, it also has to say that one of our own pages asks.
"""

import asyncio
import time
from collections.abc import Callable
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from footfall.api.access import STOP
from footfall.api.door.body_limits import body_limit
from footfall.api.door.front import LOOPBACK_NAMES, Front, is_loopback_name
from footfall.api.door.headers import protected
from footfall.api.door.problems import problem

_READING = ("GET", "HEAD", "OPTIONS")
_OF_PROXIES = frozenset(
    {
        "forwarded", "via", "x-real-ip", "x-client-ip", "x-cluster-client-ip", "x-original-forwarded-for",
        "x-original-host", "x-envoy-external-address", "x-appengine-user-ip", "x-azure-clientip", "client-ip",
        "true-client-ip", "cf-connecting-ip", "cf-ray", "fastly-client-ip", "fly-client-ip",
    }
)  # fmt: skip
"""Headers by which proxies tell that they passed a request on, besides ``X-Forwarded-…``."""


def refusal(scope: Scope, front: Front) -> tuple[str, str] | None:
    """Return (problem kind, reason) for a request or WebSocket to be refused, or None."""
    headers = Headers(scope=scope)
    host, origin = headers.get("host", "").lower(), headers.get("origin")
    here = is_loopback_name(_hostname(f"//{host}"))
    if not here and host not in front.hosts:
        names = ", ".join([*LOOPBACK_NAMES, *front.hosts])
        return "foreign-host", f"this server answers to {names} only, not to {host!r}"
    passed_on = next((name for name in headers if name.startswith("x-forwarded-") or name in _OF_PROXIES), None)
    if passed_on is not None and not front.proxied:
        return "forwarded", f"a proxy passed this on ({passed_on}); `footfall serve --behind-tls-proxy` allows that"
    if origin is not None:
        # The page and the request must share scheme, name and port: the browser's own rule.
        own = f"{'https' if scope['scheme'] in ('https', 'wss') else 'http'}://{host}"
        if origin.lower() in (own, front.public):
            return None
        return "foreign-origin", f"a page of {origin!r} may not use this server; open {front.public or own} instead"
    if scope["type"] == "http" and scope["method"] in _READING:
        return None
    site = headers.get("sec-fetch-site")
    if site not in (None, "same-origin", "none"):
        return "foreign-origin", "a page of another site may not use this server"
    if "cookie" in headers and "authorization" not in headers and site != "same-origin":
        text = "with a login's cookie, a request must say which page sends it (Origin); programs use a token instead"
        return "foreign-origin", text
    return None


def _is_ambiguous(scope: Scope) -> bool:
    """Whether a proxy may see another end of this request's body than we do, and so another next request."""
    headers = Headers(scope=scope)
    if "transfer-encoding" not in headers:
        return False
    return "content-length" in headers or scope.get("http_version") == "1.0"  # which knows no transfer encoding


def _hostname(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


PATIENCE = 30.0
"""A body of which nothing comes for so long is given up [s]: who sends one holds a connection, and work begun."""
SLOWEST = 4 << 10
"""Who has been waited for longer than PATIENCE in all has to have sent so many bytes for each second of it."""


class _BodyRefused(HTTPException):
    """What is wrong shows while the body is read; routes let it pass as what it is."""


class Guard:
    """ASGI middleware that refuses foreign hosts and origins, and bodies that are too large or never come.

    max_body: largest anywhere [bytes]; most addresses take less. clock: for how long bodies take [s].
    """

    def __init__(self, app: ASGIApp, max_body: int, front: Front, clock: Callable[[], float] = time.monotonic) -> None:
        self.app = app
        self._clock = clock
        self.max_body = max_body
        self.front = front

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        refused = refusal(scope, self.front)
        if scope["type"] == "websocket":
            if refused is None:
                return await self.app(scope, receive, send)
            return await WebSocket(scope, receive, send).close(code=1008, reason=refused[0])
        received, waited, started, whole = 0, 0.0, False, False
        limit, ambiguous = body_limit(scope["path"], self.max_body), _is_ambiguous(scope)

        async def send_guarded(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = protected(scope["path"], message["headers"], self.front.public is not None)
                if ambiguous:  # RFC 9112, 6.1: nothing that follows on this connection is believed
                    headers = [*headers, (b"connection", b"close")]
                message = {**message, "headers": headers}
            await send(message)

        if refused is not None:
            return await problem(refused[0], 403, refused[1])(scope, receive, send_guarded)
        too_large = problem(
            "too-large", 413, f"a request to this address holds at most {limit} bytes", {"limit": limit}
        )
        if scope["path"] == STOP:
            # a stop reads no more of its body than it wants, and is not refused for the rest
            return await self.app(scope, receive, send_guarded)
        if ambiguous:
            text = "the request tells the length of its body in two ways; send Content-Length or Transfer-Encoding"
            return await problem("malformed", 400, text)(scope, receive, send_guarded)
        length = Headers(scope=scope).get("content-length", "0")
        if length.isdecimal() and (len(length) > 18 or int(length) > limit):
            return await too_large(scope, receive, send_guarded)

        async def receive_counted() -> Message:
            nonlocal received, waited, whole
            if whole:  # what comes now is that the client has gone
                return await receive()
            began = self._clock()
            try:
                async with asyncio.timeout(PATIENCE):
                    message = await receive()
            except TimeoutError:
                raise _BodyRefused(408, f"nothing more of the body came within {PATIENCE:g} s") from None
            received += len(message.get("body", b""))
            waited += self._clock() - began
            whole = not message.get("more_body", False)
            if received > limit:
                raise _BodyRefused(413, f"a request to this address holds at most {limit} bytes")
            if not whole and waited > PATIENCE and received < waited * SLOWEST:
                raise _BodyRefused(408, f"in {waited:z.0f} s {received} bytes of the body came; send it faster")
            return message

        try:
            return await self.app(scope, receive_counted, send_guarded)
        except _BodyRefused as refused:
            if started:
                raise
            answer = too_large if refused.status_code == 413 else problem("too-slow", 408, refused.detail)
            return await answer(scope, receive, send_guarded)
