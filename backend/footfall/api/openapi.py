"""The OpenAPI document: every operation with all the problems that it may answer with, told by its shape.

Which refusals a request can meet follows from what it has: a path that names something (404), a body (413, 415), a
version that it changes (412, 428). Writing them at each route would say the same seventy times, and miss some.
"""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute

from footfall.planning.step.problem import PLANNERS

PROBLEM_JSON = "application/problem+json"

# status → name of the response among the components, when it comes
_PROBLEMS = {
    400: ("NotReadable", "The request can't be read at all: a form that is no form, for instance."),
    401: ("NotKnown", "Nobody is logged in, or the token is of nobody."),
    403: ("NotAllowed", "The request came from another site or host, or the role does not allow it."),
    404: ("NotFound", "What the path or the body names does not exist."),
    405: ("NoSuchMethod", "The path takes other methods: `Allow` lists them."),
    409: ("Conflict", "The request does not fit the present state; the detail says what would have to change."),
    412: ("Changed", "The thing has changed since it was read."),
    408: ("TooSlow", "Nothing more of the body came."),
    413: ("TooLarge", "The body, or what it unpacks to, is larger than the limits that `GET info` lists."),
    415: ("WrongMedia", "The body is of a media type that this operation does not take."),
    422: (
        "NotUsable",
        "The request is not well-formed (`validation`), or can't be used; it says why.",
    ),
    428: ("SayWhichVersion", "The request must name the version that it changes, with `If-Match`."),
    429: ("TooMany", "This client asks too often; `Retry-After` [s] says when to ask again."),
    431: ("HeadersTooLarge", "The headers of the request are too large."),
    500: ("Unexpected", "The server met an error that it did not expect; its log says more."),
    503: ("Busy", "Too many jobs wait, a worker died, or the disk is full; `Retry-After` [s] where waiting helps."),
}
_ALWAYS = (401, 403, 409, 429, 431, 500, 503)
_BODY = (400, 408, 413, 415, 422)
_WAITS = (429, 503)

_DOCUMENT = {
    "type": "object",
    "title": "Problem",
    "description": "A problem document (RFC 9457). Further members carry the data that was refused.",
    "required": ["type", "title", "status", "detail"],
    "properties": {
        "type": {"type": "string", "description": "stable name of the kind of problem", "pattern": "^/problems/"},
        "title": {"type": "string"},
        "status": {"type": "integer", "minimum": 400, "maximum": 599},
        "detail": {"type": "string", "description": "what was wrong, and what would be right"},
    },
    "example": {
        "type": "/problems/invalid-input",
        "title": "The request can't be used",
        "status": 422,
        "detail": f"planner is one of {', '.join(PLANNERS)}",
        "planner": "rrt",
    },
}


def operation_id(route: APIRoute) -> str:
    """Short and stable: the part of the interface and the name of what it does."""
    return f"{route.tags[0]}_{route.name}" if route.tags else route.name


def describe(app: FastAPI) -> None:
    """Make ``app`` serve the completed document."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(
                title=app.title, version=app.version, description=app.description, routes=app.routes, tags=[]
            )
            app.openapi_schema = _completed(made)
        return app.openapi_schema

    app.openapi = document


def _completed(made: dict[str, Any]) -> dict[str, Any]:
    components = made.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    for unused in ("HTTPValidationError", "ValidationError"):
        schemas.pop(unused, None)
    schemas["Problem"] = _DOCUMENT
    components["responses"] = {name: _response(status, text) for status, (name, text) in _PROBLEMS.items()}
    _hoist(made, schemas)
    for path, operations in made["paths"].items():
        for method, operation in operations.items():
            answers = operation["responses"]
            for parameter in operation.get("parameters", ()):
                # its absence has an answer of its own, so no route may refuse it earlier
                parameter["required"] = parameter.get("required", False) or parameter["name"].lower() == "if-match"
            for status in _statuses(path, method, operation):
                answers[str(status)] = {"$ref": f"#/components/responses/{_PROBLEMS[status][0]}"}
            if method == "get" and "{digest}" in path and "200" in answers:
                answers["304"] = {"description": "`If-None-Match` names the ETag of this product, which never changes."}
            operation["responses"] = dict(sorted(answers.items()))
    return made


def _hoist(made: dict[str, Any], schemas: dict[str, Any]) -> None:
    """Schemas of forms carry what they refer to; it belongs among the components."""
    for operations in made["paths"].values():
        for operation in operations.values():
            for content in operation.get("requestBody", {}).get("content", {}).values():
                for name, one in content["schema"].pop("$defs", {}).items():
                    schemas.setdefault(name, one)


def _statuses(path: str, method: str, operation: dict[str, Any]) -> list[int]:
    found = set(_ALWAYS) | {int(status) for status in operation["responses"] if status[0] in "45"}
    given = {(one["in"], one["name"].lower()) for one in operation.get("parameters", ())}
    if given:
        found.add(422)
    if "{" in path:
        found |= {404}
    if "requestBody" in operation:
        found |= set(_BODY)
    if method != "get":
        found |= {404, 422}
    if ("header", "if-match") in given:
        found |= {412, 428}
    return sorted(found & set(_PROBLEMS))


def _response(status: int, text: str) -> dict[str, Any]:
    content = {PROBLEM_JSON: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    made: dict[str, Any] = {"description": text, "content": content}
    if status in _WAITS:
        about = {"description": "seconds to wait", "schema": {"type": "integer", "minimum": 1}}
        made["headers"] = {"Retry-After": about}
    return made
