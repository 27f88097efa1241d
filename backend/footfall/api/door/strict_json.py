"""JSON bodies as the routes take them: no member given twice, no text that UTF-8 can't hold.

What is wrong is told as FastAPI tells of any body that is no JSON (:mod:`footfall.api.door.problems`).
"""

import json
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from footfall.core.surrogates import lone_surrogate_in, spelled_out


def read_json(body: bytes | str) -> Any:
    """Raises json.JSONDecodeError, saying what is wrong; UnicodeDecodeError and RecursionError as ``json.loads``."""
    found = json.loads(body, object_pairs_hook=_members)
    halved = lone_surrogate_in(found)
    if halved is not None:
        raise json.JSONDecodeError(f"a text has a lone surrogate, half a character: {halved}", "", 0)
    return found


def _members(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise json.JSONDecodeError(f"the member {spelled_out(twice[:60])!r} is given twice", "", 0)
    return found


class _Strict(Request):
    async def json(self) -> Any:
        if not hasattr(self, "_json"):
            self._json = read_json(await self.body())
        return self._json


class StrictRoute(APIRoute):
    """A route whose JSON body is read by :func:`read_json`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """See fastapi.routing.APIRoute."""
        answer = super().get_route_handler()

        async def strictly(request: Request) -> Response:
            return await answer(_Strict(request.scope, request.receive))

        return strictly
