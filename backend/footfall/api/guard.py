"""Who may ask: only pages that this server served, and programs on this computer.

There is no authentication yet, so the server listens on loopback only. Two doors remain open to a
web page of somebody else in the operator's browser: requests across origins (WebSockets are never held
back by the browser) and DNS rebinding. The first shows in the ``Origin`` header, the second in ``Host``.
"""

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from footfall.api.problems import problem

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")

# Nobody else may frame the page and lay a button of theirs over "Send", or read images across origins.
_PROTECTION = (
    (b"x-frame-options", b"SAMEORIGIN"),
    (b"content-security-policy", b"frame-ancestors 'self'"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"x-content-type-options", b"nosniff"),
)


def is_loopback_name(name: str | None) -> bool:
    """Whether a host name or address means this computer."""
    return name in LOOPBACK_NAMES


def refusal(headers: Headers) -> tuple[str, str] | None:
    """Return (problem kind, reason) for a request to be refused, or None."""
    host = headers.get("host", "")
    if not is_loopback_name(_hostname(f"//{host}")):
        return "foreign-host", f"this server answers to {', '.join(LOOPBACK_NAMES)} only, not to {host!r}"
    origin = headers.get("origin")
    if origin is None:
        return None
    # The page and the request must share scheme, name and port: the browser's own rule.
    if origin.lower() != f"http://{host}".lower():
        return "foreign-origin", f"a page of {origin!r} may not use this server; open http://{host} instead"
    return None


def _hostname(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


class _TooLarge(HTTPException):
    """The request's body went on past the limit; routes let it pass as what it is."""

    def __init__(self, limit: int) -> None:
        super().__init__(413, f"a request holds at most {limit} bytes")


class Guard:
    """ASGI middleware that refuses foreign hosts and origins, and bodies that are too large."""

    def __init__(self, app: ASGIApp, max_body: int) -> None:
        self.app = app
        self.max_body = max_body

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        headers = Headers(scope=scope)
        refused = refusal(headers)
        if scope["type"] == "websocket":
            if refused is None:
                return await self.app(scope, receive, send)
            return await WebSocket(scope, receive, send).close(code=1008, reason=refused[0])
        if refused is not None:
            return await problem(refused[0], 403, refused[1])(scope, receive, send)
        too_large = problem(
            "too-large", 413, f"a request holds at most {self.max_body} bytes", {"limit": self.max_body}
        )
        length = headers.get("content-length", "0")
        if length.isdecimal() and int(length) > self.max_body:
            return await too_large(scope, receive, send)
        received, started = 0, False

        async def receive_counted() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > self.max_body:
                raise _TooLarge(self.max_body)
            return message

        async def send_guarded(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                message = {**message, "headers": [*message["headers"], *_PROTECTION]}
            await send(message)

        try:
            return await self.app(scope, receive_counted, send_guarded)
        except _TooLarge:
            if started:
                raise
            return await too_large(scope, receive, send_guarded)
