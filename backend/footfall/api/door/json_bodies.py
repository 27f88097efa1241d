"""JSON bodies of requests, read by :mod:`footfall.core.strict_json`; large ones apart from the event loop.

What is wrong is told as FastAPI tells of any body that is no JSON (:mod:`footfall.api.door.problems`).
"""

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from anyio import CapacityLimiter, to_thread
from fastapi import Request, Response
from fastapi.routing import APIRoute

from footfall.api.door.body_limits import JSON_BYTES, JSON_PARTS
from footfall.api.door.problems import Problem
from footfall.core.strict_json import read_json

AT_ONCE = 16 << 10
"""A body of up to so much is read on the event loop, in a millisecond [bytes]."""

# one after the other: who reads JSON holds the interpreter, and many at a time would hold up a stop
_reading = CapacityLimiter(1)


async def read_apart(text: bytes) -> Any:
    """JSON of a body. Raises as :func:`~footfall.core.strict_json.read_json`."""
    if len(text) <= AT_ONCE:
        return read_json(text, most=JSON_PARTS)
    return await to_thread.run_sync(partial(read_json, text, most=JSON_PARTS), limiter=_reading)


async def small_body(request: Request) -> bytes:
    """The body of a request that may also carry files, where it carries none. Raises Problem where it is too large."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > JSON_BYTES:
            text = f"JSON for this address has at most {JSON_BYTES} bytes; files come in a form"
            raise Problem("too-large", 413, text, limit=JSON_BYTES)
    return body


class _Strict(Request):
    async def json(self) -> Any:
        if not hasattr(self, "_json"):
            self._json = await read_apart(await self.body())
        return self._json


class StrictRoute(APIRoute):
    """A route whose JSON body is read by :func:`read_apart`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """See fastapi.routing.APIRoute."""
        answer = super().get_route_handler()

        async def strictly(request: Request) -> Response:
            return await answer(_Strict(request.scope, request.receive))

        return strictly
