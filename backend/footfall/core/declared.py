"""Whether what a value holds is what its fields declare: for values that were made of what others wrote."""

from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from footfall.core.value import Value

_ALSO: dict[Any, tuple[type, ...]] = {float: (int, float)}


def misfit(item: Value) -> str | None:
    """The first field, with its path, that holds something else than it declares; None where there is none.

    Values, tuples, mappings and plain scalars are looked into; arrays and others are not.
    """
    for name, declared in _declared(type(item)).items():
        if (where := _misfit(getattr(item, name), declared, name)) is not None:
            return where
    return None


@lru_cache(maxsize=256)
def _declared(kind: type[Value]) -> dict[str, object]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}  # type: ignore[arg-type]


def _misfit(item: Any, declared: Any, where: str) -> str | None:
    origin, among = get_origin(declared), get_args(declared)
    if origin in (Union, UnionType):
        found = [_misfit(item, one, where) for one in among]
        # of several ways in which it does not fit, the one that leads farthest says most
        return None if None in found else max((one for one in found if one is not None), key=len)
    if origin is tuple:
        return _misfit_of_tuple(item, among, where)
    if origin is Mapping:
        if not isinstance(item, Mapping):
            return where
        return _first(_misfit(one, among[1], f"{where}[{name!r}]") for name, one in item.items())
    if declared is Any or not isinstance(declared, type):
        return None
    if declared in (str, int, float, bool, NoneType):
        return None if type(item) in _ALSO.get(declared, (declared,)) else where
    if not isinstance(item, declared):
        return where
    if isinstance(item, Value) and (inside := misfit(item)) is not None:
        return f"{where}.{inside}"
    return None


def _misfit_of_tuple(item: Any, among: tuple[Any, ...], where: str) -> str | None:
    """among: what each element is declared as, or one kind and ``...`` where there are any number of it."""
    if not isinstance(item, tuple):
        return where
    several = len(among) == 2 and among[1] is ...
    if not several and len(item) != len(among):
        return where
    kinds = among[:1] * len(item) if several else among
    return _first(_misfit(one, kind, f"{where}[{i}]") for i, (one, kind) in enumerate(zip(item, kinds, strict=True)))


def _first(found: Any) -> str | None:
    return next((one for one in found if one is not None), None)
