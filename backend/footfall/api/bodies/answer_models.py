"""What answers hold, told from the types of the values that are answered with, for the OpenAPI document alone.

An answer is never passed through these models: :func:`~footfall.api.bodies.jsonable.jsonable` writes it, and these say
what that makes of each type. A test holds every answer of the server against them.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, NotRequired, Union, get_args, get_origin, get_type_hints, is_typeddict

import numpy as np
from pydantic import BaseModel, Field, WithJsonSchema, create_model

from footfall.core.value import Value
from footfall.session.answers.notes import Each, OneOf, Says

Numbers = Annotated[
    Any,
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": ["number", "boolean", "string", "array", "null"]},
            "description": "an array as nested lists, the last axis innermost; null is unknown",
        }
    ),
]
Plain = Annotated[
    Any, WithJsonSchema({"type": ["object", "array", "string", "number", "boolean", "null"], "description": "any JSON"})
]


def answer_model(hint: Any, floats: Any = float) -> Any:
    """The type that describes ``hint`` as JSON.

    floats: what a float becomes. Those of values may be unknown, which is null; those of answers made by hand say so.
    """
    origin = get_origin(hint)
    if origin is Annotated:
        inner, *notes = get_args(hint)
        if isinstance(notes[0], OneOf):
            return Literal[tuple(notes[0].names())]
        described = (Field(description=note.text) if isinstance(note, Says) else note for note in notes)
        return Annotated[answer_model(inner, floats), *described]
    if origin is np.ndarray or hint is np.ndarray:
        return Numbers
    if origin in (Union, UnionType):
        return Union[tuple(answer_model(one, floats) for one in get_args(hint))]  # noqa: UP007
    if origin is tuple or origin is list:
        return _listed(get_args(hint), floats)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, answer_model(get_args(hint)[1], floats)]
    if isinstance(hint, type):
        return _of_class(hint, floats)
    return Plain if hint is Any else hint


def _listed(items: tuple[Any, ...], floats: Any) -> Any:
    kinds = tuple(answer_model(one, floats) for one in items if one is not Ellipsis)
    return list[Union[kinds]] if kinds else list[Any]  # noqa: UP007


def _of_class(hint: type, floats: Any) -> Any:
    if hint is float:
        return floats
    if is_typeddict(hint) or is_dataclass(hint):
        return _model(hint)
    if issubclass(hint, Enum):
        return Literal[tuple(one.value for one in hint)]
    if hint is Value:
        return Annotated[dict[str, Any], Field(description="the fields of a value, and its digest")]
    return Plain if hint is object else hint


@cache
def _model(answer: type) -> type[BaseModel]:
    """A model with the members of a value, a dataclass or a TypedDict."""
    hints = get_type_hints(answer, include_extras=True)
    members: dict[str, Any]
    if is_typeddict(answer):
        members = {name: _member(hint) for named, hint in hints.items() for name in _names_of(named, hint)}
        return create_model(answer.__name__, __doc__=answer.__doc__, **members)
    members = {f.name: (answer_model(hints[f.name], float | None), ...) for f in fields(answer)}
    if issubclass(answer, Value):
        members["digest"] = (Annotated[str, Field(description="name of the content")], ...)
    # requests have settings of the same name
    return create_model(f"{answer.__name__}Value", __doc__=answer.__doc__, **members)


def _names_of(name: str, hint: Any) -> Iterable[str]:
    note = hint.__metadata__[0] if get_origin(hint) is Annotated else None
    return note.names() if isinstance(note, Each) else (name,)


def _member(hint: Any) -> tuple[Any, Any]:
    if get_origin(hint) is Annotated and isinstance(hint.__metadata__[0], Each):
        return _member(hint.__origin__)
    if get_origin(hint) is NotRequired:
        return answer_model(get_args(hint)[0]), Field(default_factory=dict)
    return answer_model(hint), ...
