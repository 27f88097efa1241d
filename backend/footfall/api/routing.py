"""A router whose routes may return values: they are turned into JSON in one place."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any

from fastapi import APIRouter, Response

from footfall.api.jsonable import jsonable


class Routes(APIRouter):
    """Like APIRouter, but results go through :func:`jsonable` and not through response models."""

    def add_api_route(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        if not inspect.isasyncgenfunction(endpoint):
            endpoint = _plain(endpoint)
            options["response_model"] = None
        super().add_api_route(path, endpoint, **options)


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
