"""Frozen values: what flows from telemetry to exports, and how it is named by content.

A *value* is a frozen, slotted dataclass. Its arrays are read-only copies, it holds no handle, path
or lock, and its ``digest`` names its content: equal content has an equal digest in every process.
So 1 in a field of type ``float`` is kept as 1.0 and an integer array in a field of float64 as float64;
the order of a mapping is part of its content.
The software version stands in the provenance and is left out of the digest, so that a later version
can show that it still computes the same product.

The same flat form serves digests and files: :func:`flatten` turns a value into a JSON-ready
structure and a list of arrays, :func:`unflatten` is its inverse.
"""

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import Field, dataclass, field, fields
from enum import Enum
from functools import lru_cache
from types import UnionType
from typing import Any, TypeVar, Union, dataclass_transform, get_args, get_origin, overload

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput

SOFTWARE_VERSION = "0.1.0"

LATER: Mapping[str, Any] = {"later": True}
"""Metadata of a field that came after values without it were stored, ``field(default=None, metadata=LATER)``: while it
has its default it is no part of the flat form, so that content which says nothing new keeps its digest."""


def before(meaning: Any) -> Mapping[str, Any]:
    """Metadata of a field that came later and whose default is not what values without it meant: ``meaning`` is that.

    While the field equals ``meaning`` it is no part of the flat form; a flat form without it is read as ``meaning``:
    ``reserve: float = field(default=0.05, metadata=before(0.0))``.
    """
    return {"later": True, "before": meaning}


_registry: dict[str, type] = {}
_names: dict[type, str] = {}
_T = TypeVar("_T", bound=type)


class Value:
    """Base of every frozen value; see the module docstring."""

    __slots__ = ("_digest",)

    @property
    def digest(self) -> str:
        """Content name: 32 hexadecimal characters of SHA-256 over the flat form."""
        try:
            return self._digest
        except AttributeError:
            object.__setattr__(self, "_digest", digest(self))
            return self._digest

    def check(self) -> None:
        """Raise :class:`InvalidInput` where the fields don't fit together (override)."""

    def __getstate__(self) -> dict[str, Any]:
        state = fields_of(self)
        if hasattr(self, "_digest"):
            # also a digest given from outside, of a file that an earlier version wrote, goes along
            state["_digest"] = self._digest
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, item in state.items():
            object.__setattr__(self, name, _freeze(item))

    def __post_init__(self) -> None:
        no_arrays: list[str] = []
        for name, declared in _declared(type(self)):
            given = getattr(self, name)
            item = _freeze(_as_declared(given, declared))
            if item is not given:
                object.__setattr__(self, name, item)
            if _lacks_array(item, declared):
                no_arrays.append(name)
        if not no_arrays:
            self.check()
            return
        with suppress(AttributeError, IndexError, TypeError, ValueError):
            self.check()  # may have a refusal of its own
        raise InvalidInput(f"{', '.join(no_arrays)} of {type(self).__name__} must be an array", fields=no_arrays)


@overload
def value(cls: _T) -> _T: ...
@overload
def value(*, stored_as: str) -> Callable[[_T], _T]: ...
@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field, Field))
def value(cls: Any = None, *, stored_as: str = "") -> Any:
    """Make ``cls`` (a subclass of :class:`Value`) a frozen value and register its name for files and digests.

    stored_as: that name, where the class is called otherwise by now; what was stored keeps its digest.
    """
    if cls is None:
        return lambda renamed: _frozen(renamed, stored_as)
    return _frozen(cls, stored_as)


def _frozen(cls: _T, stored_as: str) -> _T:
    made = dataclass(frozen=True, slots=True, eq=False, repr=False)(cls)
    made.__repr__ = _repr
    # dataclass(slots=True) installs list-based pickling that skips the freezing of arrays
    made.__getstate__ = Value.__getstate__
    made.__setstate__ = Value.__setstate__
    _register(made, stored_as or made.__name__)
    return made


def value_enum(cls: _T) -> _T:
    """Register an Enum so that values may carry its members."""
    _register(cls, cls.__name__)
    return cls


def stored_name(cls: type) -> str:
    """What values of a class, or members of an Enum, are called in files and digests."""
    return _names[cls]


def _register(cls: type, name: str) -> None:
    if name in _registry:
        raise TypeError(f"two values are called {name}")
    _registry[name] = cls
    _names[cls] = name


def _repr(self: Any) -> str:
    parts = []
    for f in fields(self):
        item = getattr(self, f.name)
        text = f"<{item.dtype} {item.shape}>" if isinstance(item, np.ndarray) else repr(item)
        parts.append(f"{f.name}={text if len(text) < 80 else text[:77] + '...'}")
    return f"{type(self).__name__}({', '.join(parts)})"


class FrozenMapping(Mapping[str, Any]):
    """A read-only mapping from names to items, in insertion order."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, Any]) -> None:
        self._items = {str(name): _freeze(item) for name, item in items.items()}
        if len(self._items) != len(items):
            raise InvalidInput("two names of a mapping read the same", names=list(self._items))

    def __reduce__(self) -> tuple[Any, ...]:
        # built anew: the default would leave the arrays that numpy unpickled writeable
        return FrozenMapping, (self._items,)

    def __getitem__(self, name: str) -> Any:
        return self._items[name]

    def __iter__(self) -> Any:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"FrozenMapping({', '.join(self._items)})"


@lru_cache(maxsize=1024)
def _declared(cls: Any) -> tuple[tuple[str, Any], ...]:
    """Name and type of each field; to ask the dataclass each time takes as long as all else."""
    return tuple((f.name, f.type) for f in fields(cls))


@lru_cache(maxsize=1024)
def _kinds(declared: Any) -> tuple[Any, ...]:
    """The alternatives of a field's type."""
    return get_args(declared) if get_origin(declared) in (Union, UnionType) else (declared,)


@lru_cache(maxsize=1024)
def _wants_array(declared: Any) -> bool:
    return any(get_origin(kind) is np.ndarray for kind in _kinds(declared))


def _as_declared(item: Any, declared: Any) -> Any:
    """``item`` in the one form that a float or float64 field has, whatever equal form it was given in."""
    if type(item) is int and float in _kinds(declared):
        return float(item)
    if isinstance(item, np.ndarray) and item.dtype.kind in "iuf" and Array in _kinds(declared):
        return item.astype(np.float64, copy=False) if np.can_cast(item.dtype, np.float64) else item
    return item


def _lacks_array(item: Any, declared: Any) -> bool:
    if not _wants_array(declared) or isinstance(item, np.ndarray):
        return False
    return not (item is None and type(None) in _kinds(declared))


_HASHED_AT_ONCE = 1 << 17
"""Elements: a copy of each part is made, so not of a whole map."""

_PLAIN = frozenset({str, int, float, bool, type(None)})


def _freeze(item: Any) -> Any:
    if type(item) in _PLAIN or isinstance(item, Value):
        return item
    if isinstance(item, np.ndarray):
        if _can_change(item) or not item.flags.c_contiguous or not item.dtype.isnative:
            item = np.array(item, dtype=item.dtype.newbyteorder("="), order="C")
            item.setflags(write=False)
        return item
    if isinstance(item, FrozenMapping):
        return item
    if isinstance(item, Mapping):
        return FrozenMapping(item)
    if isinstance(item, (list, tuple)):
        # a log's fold makes a state of each event, with all notes of those before it
        if type(item) is tuple and all(map(_is_frozen, set(map(type, item)))):
            return item
        return tuple(_freeze(one) for one in item)
    if isinstance(item, np.generic):
        return item.item()
    return item


def _is_frozen(kind: type) -> bool:
    """Whether items of a class are as :func:`_freeze` leaves them, whatever they hold."""
    return kind in _PLAIN or issubclass(kind, Value)


def _can_change(array: np.ndarray) -> bool:
    """Whether anything could still write to the memory: a read-only view of another's array does not do."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return True
        owner = owner.base
    return not (owner is None or isinstance(owner, bytes))


@value
class Provenance(Value):
    """Where a product came from.

    parents: name → digest of each value it was computed from.
    settings: the settings value it was computed with, or None.
    seed: of the random generator, or None where nothing was random.
    software: version that computed it; not part of the digest.
    """

    parents: Mapping[str, str]
    settings: Value | None = None
    seed: int | None = None
    software: str = SOFTWARE_VERSION


def fields_of(item: Value) -> dict[str, Any]:
    """The fields of a value by name, as they are."""
    return {field.name: getattr(item, field.name) for field in fields(item)}  # type: ignore[arg-type]


def flatten(item: Any) -> tuple[Any, list[np.ndarray]]:
    """Return a JSON-ready structure and the arrays that it refers to by index.

    Raises InvalidInput for anything that is not a value, array of numbers or text, mapping, sequence, registered
    Enum or plain scalar.
    """
    arrays: list[np.ndarray] = []
    return _flatten(item, arrays), arrays


def _flatten(item: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(item, Enum):
        if type(item) not in _names:
            raise InvalidInput(f"the Enum {type(item).__name__} needs @value_enum to be part of a value")
        return {"enum": _names[type(item)], "of": item.value}
    if item is None or isinstance(item, (bool, str, int)):
        return item
    if isinstance(item, float):
        return item if math.isfinite(item) else {"float": repr(item)}
    if isinstance(item, np.ndarray):
        if item.dtype.hasobject:
            raise InvalidInput("an array of Python objects can't be part of a value")
        arrays.append(item)
        return {"array": len(arrays) - 1}
    if isinstance(item, Value):
        body = {f.name: _flatten(getattr(item, f.name), arrays) for f in fields(item) if not _says_nothing_new(item, f)}  # type: ignore[arg-type]
        return {"value": _names[type(item)], "of": body}
    if isinstance(item, Mapping):
        return {"map": [[name, _flatten(one, arrays)] for name, one in item.items()]}
    if isinstance(item, (list, tuple)):
        return [_flatten(one, arrays) for one in item]
    raise InvalidInput(f"a {type(item).__name__} can't be part of a value")


def _says_nothing_new(item: Value, field: Field[Any]) -> bool:
    one = getattr(item, field.name)
    if "before" in field.metadata:
        meaning = field.metadata["before"]
        return type(one) is type(meaning) and repr(one) == repr(meaning)
    return "later" in field.metadata and _same(one, field.default)


def _same(one: Any, default: Any) -> bool:
    # a number that was read from a file is another object; the words for -0.0 are not those for 0.0
    return one is default or (
        type(one) is type(default) and isinstance(one, (int, float)) and repr(one) == repr(default)
    )


def unflatten(structure: Any, arrays: list[np.ndarray]) -> Any:
    """Inverse of :func:`flatten`. Raises InvalidInput for unknown names or missing arrays."""
    if isinstance(structure, list):
        return tuple(unflatten(one, arrays) for one in structure)
    if not isinstance(structure, dict):
        return structure
    try:
        if "array" in structure:
            return arrays[structure["array"]]
        if "float" in structure:
            return float(structure["float"])
        if "map" in structure:
            return FrozenMapping({name: unflatten(one, arrays) for name, one in structure["map"]})
        if "enum" in structure:
            return _registry[structure["enum"]](structure["of"])
        cls = _registry[structure["value"]]
        body = {name: unflatten(one, arrays) for name, one in structure["of"].items()}
        meant = {f.name: f.metadata["before"] for f in fields(cls) if "before" in f.metadata}
        return cls(**(meant | body))
    except (AttributeError, LookupError, OverflowError, TypeError, ValueError) as err:
        raise InvalidInput(f"this is not a flat value of FootFall: {err}") from err


def digest(item: Any) -> str:
    """Content name of anything :func:`flatten` takes: 32 hexadecimal characters of SHA-256."""
    return digest_flat(*flatten(item))


def digest_flat(structure: Any, arrays: list[np.ndarray]) -> str:
    """Content name of a flat form: what :func:`digest` gives for the value it was made from."""
    sha = hashlib.sha256()
    sha.update(json.dumps(_without_software(structure), sort_keys=True).encode())
    for array in arrays:
        array = array.astype(array.dtype.newbyteorder("<"), copy=False)
        sha.update(f"{array.dtype.str}{array.shape}".encode())
        flat = array.reshape(-1)
        for begin in range(0, flat.size, _HASHED_AT_ONCE):
            part = flat[begin : begin + _HASHED_AT_ONCE]
            if part.dtype.kind == "f" and np.isnan(part).any():
                # NaN payloads differ between instructions; one NaN stands for all
                part = np.where(np.isnan(part), np.array(np.nan, part.dtype), part)
            sha.update(part.tobytes())
    return sha.hexdigest()[:32]


def _without_software(structure: Any) -> Any:
    if isinstance(structure, list):
        return [_without_software(one) for one in structure]
    if isinstance(structure, dict):
        if structure.get("value") == "Provenance":
            body = {name: one for name, one in structure["of"].items() if name != "software"}
            return {"value": "Provenance", "of": _without_software(body)}
        return {name: _without_software(one) for name, one in structure.items()}
    return structure
