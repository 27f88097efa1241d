"""How often one client may ask, and how much its headers may say. Stop passes always."""

import math
import time
from collections import OrderedDict
from collections.abc import Callable

from starlette.types import ASGIApp, Receive, Scope, Send

from footfall.api.access import BASE, STOP
from footfall.api.door.limits import Limits
from footfall.api.door.problems import problem

MOST_CLIENTS = 10_000
"""Clients that are remembered; one that was forgotten begins with a full bucket."""


class Buckets:
    """A bucket of tokens for each client: every request takes one, and they come back at a rate (token bucket)."""

    def __init__(self, rate: float, burst: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._burst, self._clock = rate, burst, clock
        self._filled: OrderedDict[str, tuple[float, float]] = OrderedDict()  # client → tokens, when that was

    def take(self, client: str) -> float:
        """Take a token: 0.0, or the time until there is one [s]."""
        now = self._clock()
        tokens, since = self._filled.pop(client, (float(self._burst), now))
        tokens = min(self._burst, tokens + (now - since) * self._rate)
        wait = 0.0 if tokens >= 1 else (1 - tokens) / self._rate
        self._filled[client] = (tokens if wait else tokens - 1, now)
        if len(self._filled) > MOST_CLIENTS:
            self._filled.popitem(last=False)
        return wait


class Pace:
    """ASGI middleware that refuses what comes too often (429) and headers that are too large (431).

    Only the interface counts: the files of the page are small, many at once, and kept by the browser.
    """

    def __init__(self, app: ASGIApp, limits: Limits) -> None:
        self.app = app
        self.limits = limits
        self._buckets = Buckets(limits.requests_per_second, limits.request_burst)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] == STOP or not scope["path"].startswith(BASE):
            return await self.app(scope, receive, send)
        size, limit = sum(len(name) + len(text) for name, text in scope["headers"]), self.limits.header_bytes
        if size > limit:
            text = f"the headers have {size} bytes; at most {limit} are taken"
            return await problem("headers-too-large", 431, text, {"limit": limit})(scope, receive, send)
        # behind a proxy that says who asks, the server has put that address here
        wait = self._buckets.take((scope.get("client") or ("",))[0])
        if wait:
            members = {"requests_per_second": self.limits.requests_per_second, "burst": self.limits.request_burst}
            refused = problem("too-many-requests", 429, f"too many requests; wait {wait:.2g} s", members)
            refused.headers["Retry-After"] = str(max(1, math.ceil(wait)))
            return await refused(scope, receive, send)
        return await self.app(scope, receive, send)
