"""Settings values as request models, and back: what a value declares is all that a request may say."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, create_model

from footfall.core.value import Value, fields_of

_V = TypeVar("_V", bound=Value)


def _whole(item: Any) -> Any:
    """JSON has one kind of number: 7.0 is a whole one."""
    return int(item) if isinstance(item, float) and item.is_integer() else item


FromNumber = BeforeValidator(_whole)
"""After the bounds of a whole number: then the schema tells them."""
Whole = Annotated[int, FromNumber]


class Strictly(BaseModel):
    """Base of every request."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


@cache
def settings_model(settings: type[Value]) -> type[Strictly]:
    """A request model with the fields, types and defaults of a settings value, which stays their only source.

    A field that is a settings value itself, or many of them, becomes a model of its own.
    """
    hints = get_type_hints(settings)
    members: dict[str, Any] = {}
    for f in fields(settings):  # type: ignore[arg-type]
        hint = hints[f.name]
        default = ... if f.default is MISSING else f.default
        if isinstance(f.default, Value):
            default = Field(default_factory=settings_model(hint))
        elif f.default_factory is not MISSING:
            default = Field(default_factory=f.default_factory)
        members[f.name] = (_accepting_lists(hint), default)
    doc = (settings.__doc__ or "").strip()
    return create_model(settings.__name__, __base__=Strictly, __doc__=doc, **members)


def _accepting_lists(hint: Any) -> Any:
    if isinstance(hint, type) and issubclass(hint, Value):
        return settings_model(hint)
    if hint is int:
        return Whole
    # JSON has no arrays of numpy
    if get_origin(hint) is np.ndarray:
        return list[float]
    if (one := _each_of(hint)) is not None:
        return list[settings_model(one)]
    # JSON has no tuples; only the container is relaxed, its numbers stay strict
    if get_origin(hint) is tuple:
        return Annotated[hint, Strict(False)]
    if get_origin(hint) is Mapping:
        name, one = get_args(hint)
        return dict[name, _accepting_lists(one)]
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(_accepting_lists(one) for one in get_args(hint))]  # noqa: UP007
    return hint


def _each_of(hint: Any) -> type[Value] | None:
    """The class of the values in a tuple of them; None where it is none."""
    first = next(iter(get_args(hint)), None) if get_origin(hint) is tuple else None
    return first if isinstance(first, type) and issubclass(first, Value) else None


def settings_value(settings: type[_V], given: BaseModel | None) -> _V | None:
    """The settings value that a request holds, or None where it holds none. Raises what the value's check does."""
    if given is None:
        return None
    hints = get_type_hints(settings)
    members: dict[str, Any] = {}
    for name in type(given).model_fields:
        member = getattr(given, name)
        if isinstance(member, BaseModel):
            member = settings_value(hints[name], member)
        elif (one := _each_of(hints[name])) is not None:
            member = tuple(settings_value(one, each) for each in member)
        elif isinstance(member, list):
            member = np.array(member, np.float64) if _holds_array(hints[name]) else tuple(member)
        members[name] = member
    return settings(**members)


def changed(delivered: _V, given: BaseModel | None) -> _V:
    """Settings as delivered with what a request says of them in its place; of settings within them likewise.

    Raises what the value's check does.
    """
    if given is None:
        return delivered
    said = settings_value(type(delivered), given)
    members: dict[str, Any] = {}
    for name in given.model_fields_set:
        inner = getattr(delivered, name)
        members[name] = changed(inner, getattr(given, name)) if isinstance(inner, Value) else getattr(said, name)
    return type(delivered)(**{**fields_of(delivered), **members})


def _holds_array(hint: Any) -> bool:
    return get_origin(hint) is np.ndarray or any(_holds_array(one) for one in get_args(hint))
