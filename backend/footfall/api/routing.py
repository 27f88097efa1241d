"""A router whose routes may return values: they are turned into JSON in one place, and described from their types."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, get_type_hints

from fastapi import APIRouter, Response

from footfall.api.bodies.answer_models import answer_model
from footfall.api.bodies.jsonable import jsonable
from footfall.api.door.json_bodies import StrictRoute

BINARY = {"type": "string", "contentMediaType": "application/octet-stream"}
_TOLD: dict[str, dict[str, str]] = {"application/json": {"type": "object"}}


class Routes(APIRouter):
    """Like APIRouter, but results go through :func:`jsonable`; what a route returns is told by its return type.

    JSON bodies are read by :mod:`footfall.api.door.json_bodies`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(route_class=StrictRoute, **options)

    def add_api_route(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        if not inspect.isasyncgenfunction(endpoint):
            returned = get_type_hints(endpoint, include_extras=True).get("return", Any)
            if not (isinstance(returned, type) and issubclass(returned, Response)):
                described = {options.get("status_code") or 200: {"model": answer_model(returned)}}
                options["responses"] = _joined(described, options.get("responses") or {})
            endpoint = _plain(endpoint)
            options["response_model"] = None
        super().add_api_route(path, endpoint, **options)


def _joined(described: dict[Any, Any], given: dict[Any, Any]) -> dict[Any, Any]:
    return {status: {**described.get(status, {}), **given.get(status, {})} for status in [*described, *given]}


def files(*media: str, status: int = 200) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of a route that answers with a file of one of these media types."""
    return {status: {"content": {one: {"schema": _TOLD.get(one, BINARY)} for one in media}}}


def _plain(endpoint: Callable[..., Any]) -> Callable[..., Any]:
    def convert(result: Any) -> Any:
        return result if isinstance(result, Response) else jsonable(result)

    if inspect.iscoroutinefunction(endpoint):

        @wraps(endpoint)
        async def asynchronous(*args: Any, **named: Any) -> Any:
            return convert(await endpoint(*args, **named))

        return asynchronous

    @wraps(endpoint)
    def synchronous(*args: Any, **named: Any) -> Any:
        return convert(endpoint(*args, **named))

    return synchronous
