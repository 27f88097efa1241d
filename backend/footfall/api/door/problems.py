"""Errors as RFC 9457 problem documents, with a ``type`` that stays the same from release to release."""

import errno
import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import iter_route_contexts
from starlette.exceptions import HTTPException
from starlette.routing import compile_path

from footfall.api.bodies.jsonable import dumps
from footfall.core.errors import (
    Busy,
    Cancelled,
    CommandRefused,
    Conflict,
    FootFallError,
    InvalidInput,
    NotFound,
    NotRecorded,
    WorkerLost,
)
from footfall.session.storage.interface import StoreRefused

_log = logging.getLogger(__name__)

# The most derived class that fits decides.
_STATUS: Mapping[type[FootFallError], int] = {
    Busy: 503,
    CommandRefused: 409,
    Conflict: 409,
    NotFound: 404,
    InvalidInput: 422,
    Cancelled: 409,
    WorkerLost: 503,
    NotRecorded: 503,
    FootFallError: 500,
}

_TITLES = {
    "error": "Something went wrong",
    "invalid-input": "The request can't be used",
    "invalid-terrain": "The terrain can't be used",
    "invalid-images": "The images can't be used",
    "invalid-robot": "The robot description can't be used",
    "invalid-telemetry": "The telemetry can't be used",
    "invalid-sequence": "The sequence breaks a rule",
    "invalid-bundle": "The session bundle can't be used",
    "not-found": "There is no such thing",
    "conflict": "The request does not fit the present state",
    "command-refused": "The command gate refused",
    "cancelled": "The work was stopped",
    "worker-lost": "A worker process died",
    "not-recorded": "The store can't take it now",
    "validation": "The request is not well-formed",
    "busy": "Too much is waiting",
    "too-many-requests": "Too many requests",
    "headers-too-large": "The headers are too large",
    "malformed": "The request can't be read",
    "wrong-media": "The body is of another media type",
    "foreign-origin": "The request came from another site",
    "foreign-host": "The request was meant for another host",
    "too-large": "The request is too large",
    "too-slow": "The request did not come to its end",
    "precondition-failed": "The thing has changed since you read it",
    "precondition-required": "The request must say which version it changes",
    "idempotency-key-reused": "The key was used for another request",
}


_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MOST_ERRORS = 20
"""Of one request that are listed; the detail says how many there are."""


class Json(JSONResponse):
    """JSON as the routes write it: numbers that are not finite as null."""

    def render(self, content: Any) -> bytes:
        return dumps(content).encode()


class Problem(FootFallError):
    """An error that only the REST interface knows, with its status."""

    def __init__(self, kind: str, status: int, message: str, **details: Any) -> None:
        super().__init__(message, **details)
        self.kind = kind
        self.status = status


def problem(kind: str, status: int, detail: str, members: Mapping[str, Any] | None = None) -> Json:
    """The response for one problem; ``members`` are extension members of the document."""
    title = _TITLES.get(kind) or HTTPStatus(status).phrase
    document = {"type": f"/problems/{kind}", "title": title, "status": status, "detail": detail}
    extra = {name: item for name, item in (members or {}).items() if name not in document}
    return Json({**document, **extra}, status_code=status, media_type="application/problem+json")


def status_of(error: FootFallError) -> int:
    """HTTP status for an error."""
    if isinstance(error, Problem):
        return error.status
    if isinstance(error, NotRecorded) and error.details.get("no_room"):
        return HTTPStatus.INSUFFICIENT_STORAGE
    return next(_STATUS[cls] for cls in type(error).__mro__ if cls in _STATUS)


def add_problem_responses(app: FastAPI) -> None:
    """Answer every error of ``app`` with a problem document."""

    @app.exception_handler(FootFallError)
    async def known(request: Request, error: FootFallError) -> Json:
        if isinstance(error, CommandRefused):
            request.app.state.metrics.refused(error)
        answer = problem(error.kind, status_of(error), error.message, error.details)
        if isinstance(error, Busy):
            answer.headers["Retry-After"] = str(error.details["retry_after"])
        return answer

    @app.exception_handler(StoreRefused)
    async def not_recorded(request: Request, error: StoreRefused) -> Json:
        _log.error("at %s %s: %s", request.method, request.url.path, error)
        return await known(request, error.not_recorded)

    @app.exception_handler(OSError)
    async def no_room(request: Request, error: OSError) -> Json:
        if error.errno not in _NO_ROOM:
            return await unexpected(request, error)
        text = f"there is no room on the server's disk, so it was not done: {error.strerror}; make room and ask again"
        _log.error("at %s %s: %s", request.method, request.url.path, error)
        return problem("not-recorded", HTTPStatus.INSUFFICIENT_STORAGE, text, {"no_room": True})

    @app.exception_handler(RequestValidationError)
    async def malformed(request: Request, error: RequestValidationError) -> Json:
        media = request.headers.get("content-type", "")
        if error.body is not None and media and not _is_json(media):
            return problem(
                "wrong-media", 415, f"this takes application/json, not {media[:100]}", {"given": media[:100]}
            )
        found = error.errors()
        errors = [
            {
                "where": ".".join(str(part) for part in one["loc"]),
                "what": one["ctx"]["error"] if one["type"] == "json_invalid" else one["msg"],
                "got": _shortened(one.get("input")),
            }
            for one in found[:MOST_ERRORS]
        ]
        first = errors[0]
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        return problem("validation", 422, f"{first['where']}: {first['what']}{more}", {"errors": errors})

    @app.exception_handler(HTTPException)
    async def by_status(request: Request, error: HTTPException) -> Json:
        kinds = {
            400: "malformed",
            404: "not-found",
            405: "method-not-allowed",
            408: "too-slow",
            413: "too-large",
            503: "busy",
        }
        kind = kinds.get(error.status_code, f"http-{error.status_code}")
        detail = str(error.detail)
        if error.status_code == 404:
            detail = f"there is nothing at {request.url.path}"
        elif error.status_code == 405:
            detail = f"{request.url.path} does not take {request.method}"
        answer = problem(kind, error.status_code, detail)
        answer.headers.update(error.headers or {})
        if error.status_code == 405:
            # the framework names the methods of one of the routes at this path
            answer.headers["Allow"] = ", ".join(sorted(_methods_at(request)))
        return answer

    @app.exception_handler(Exception)
    async def unexpected(request: Request, error: Exception) -> Json:
        _log.error("unexpected error at %s %s", request.method, request.url.path, exc_info=error)
        return problem("error", 500, "the server met an error that it did not expect; its log says more")


def _methods_at(request: Request) -> set[str]:
    found: set[str] = set()
    for route in iter_route_contexts(request.app.routes):
        if route.methods and route.path and compile_path(route.path)[0].match(request.url.path):
            found |= route.methods
    return found


def _is_json(media: str) -> bool:
    kind = media.split(";")[0].strip().lower()
    return kind == "application/json" or (kind.startswith("application/") and kind.endswith("+json"))


def _shortened(item: Any) -> Any:
    if isinstance(item, (bool, int, float)) or item is None:
        return item
    if isinstance(item, (dict, list)) and len(item) > MOST_ERRORS:
        return f"{'an object' if isinstance(item, dict) else 'a list'} of {len(item)}"
    text = item if isinstance(item, str) else str(item)
    return text if len(text) <= 200 else text[:197] + "..."
