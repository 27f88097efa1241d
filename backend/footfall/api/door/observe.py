"""Every request seen from outside: it gets an id, which stands in all log lines of it, and is counted and timed."""

import logging
import re
import time
import uuid
from typing import Any

import structlog
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from footfall.api.routes.metrics import Metrics

REQUEST_ID = "x-request-id"
OTHER = "(page)"
"""Label of what no route of the interface answered: files of the page, and addresses where nothing is."""
_ID = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_SESSION = re.compile(r"/sessions/([A-Za-z0-9][A-Za-z0-9_-]{0,63})(?:/|$)")
_log = logging.getLogger(__name__)


class Observe:
    """ASGI middleware, the outermost. A request's own X-Request-ID is kept where it is one; the answer carries it."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self.app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        given = Headers(scope=scope).get(REQUEST_ID, "")
        bound = {"request": given if _ID.fullmatch(given) else uuid.uuid4().hex[:12]}
        if found := _SESSION.search(scope["path"]):
            bound["session"] = found[1]
        with structlog.contextvars.bound_contextvars(**bound):
            if scope["type"] == "websocket":
                return await self.app(scope, receive, send)
            return await self._request(scope, receive, send, bound["request"])

    async def _request(self, scope: Scope, receive: Receive, send: Send, request: str) -> None:
        began, status = time.perf_counter(), 500

        async def send_marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message = {**message, "headers": [*message["headers"], (REQUEST_ID.encode(), request.encode())]}
            await send(message)

        try:
            await self.app(scope, receive, send_marked)
        finally:
            self._note(scope, status, time.perf_counter() - began)

    def _note(self, scope: Scope, status: int, seconds: float) -> None:
        route: Any = scope.get("route")
        template, method = getattr(route, "path", OTHER), scope["method"]
        self._metrics.answered(method, template, status, seconds)
        quiet = method in ("GET", "HEAD") and status < 400
        about = {"method": method, "route": template, "status": status, "seconds": round(seconds, 4)}
        # the query is left out: it may hold what is nobody's business
        _log.log(logging.DEBUG if quiet else logging.INFO, "%s %s %d", method, scope["path"], status, extra=about)
