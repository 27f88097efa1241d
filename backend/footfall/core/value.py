"""Frozen values: what flows from telemetry to exports, and how it is named by content.

A *value* is a frozen, slotted dataclass. Its arrays are read-only copies, it holds no handle, path
or lock, and its ``digest`` names its content: equal content has an equal digest in every process.
The software version stands in the provenance and is left out of the digest, so that a later version
can show that it still computes the same product.

The same flat form serves digests and files: :func:`flatten` turns a value into a JSON-ready
structure and a list of arrays, :func:`unflatten` is its inverse.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any, TypeVar, dataclass_transform

import numpy as np

from footfall.core.errors import InvalidInput

SOFTWARE_VERSION = "0.1.0"

_registry: dict[str, type] = {}
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
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, item in state.items():
            object.__setattr__(self, name, _freeze(item))

    def __post_init__(self) -> None:
        for f in fields(self):  # type: ignore[arg-type]
            object.__setattr__(self, f.name, _freeze(getattr(self, f.name)))
        self.check()


@dataclass_transform(frozen_default=True, eq_default=False)
def value(cls: _T) -> _T:
    """Make ``cls`` (a subclass of :class:`Value`) a frozen value and register its name for files."""
    made = dataclass(frozen=True, slots=True, eq=False, repr=False)(cls)
    made.__repr__ = _repr
    # dataclass(slots=True) installs list-based pickling that skips the freezing of arrays
    made.__getstate__ = Value.__getstate__
    made.__setstate__ = Value.__setstate__
    _register(made)
    return made


def value_enum(cls: _T) -> _T:
    """Register an Enum so that values may carry its members."""
    _register(cls)
    return cls


def _register(cls: type) -> None:
    if cls.__name__ in _registry:
        raise TypeError(f"two values are called {cls.__name__}")
    _registry[cls.__name__] = cls


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

    def __getitem__(self, name: str) -> Any:
        return self._items[name]

    def __iter__(self) -> Any:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"FrozenMapping({', '.join(self._items)})"


def _freeze(item: Any) -> Any:
    if isinstance(item, np.ndarray):
        if item.flags.writeable or not item.flags.c_contiguous:
            item = np.array(item, order="C")
            item.setflags(write=False)
        return item
    if isinstance(item, FrozenMapping):
        return item
    if isinstance(item, Mapping):
        return FrozenMapping(item)
    if isinstance(item, (list, tuple)):
        return tuple(_freeze(one) for one in item)
    if isinstance(item, np.generic):
        return item.item()
    return item


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


def flatten(item: Any) -> tuple[Any, list[np.ndarray]]:
    """Return a JSON-ready structure and the arrays that it refers to by index.

    Raises InvalidInput for anything that is not a value, array, mapping, sequence or plain scalar.
    """
    arrays: list[np.ndarray] = []
    return _flatten(item, arrays), arrays


def _flatten(item: Any, arrays: list[np.ndarray]) -> Any:
    if item is None or isinstance(item, (bool, str)):
        return item
    if isinstance(item, Enum):
        return {"enum": type(item).__name__, "of": item.value}
    if isinstance(item, int):
        return item
    if isinstance(item, float):
        return item if math.isfinite(item) else {"float": repr(item)}
    if isinstance(item, np.ndarray):
        arrays.append(item)
        return {"array": len(arrays) - 1}
    if isinstance(item, Value):
        body = {f.name: _flatten(getattr(item, f.name), arrays) for f in fields(item)}  # type: ignore[arg-type]
        return {"value": type(item).__name__, "of": body}
    if isinstance(item, Mapping):
        return {"map": [[name, _flatten(one, arrays)] for name, one in item.items()]}
    if isinstance(item, (list, tuple)):
        return [_flatten(one, arrays) for one in item]
    raise InvalidInput(f"a {type(item).__name__} can't be part of a value")


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
        return cls(**body)
    except (KeyError, IndexError, TypeError, ValueError) as err:
        raise InvalidInput(f"this is not a flat value of FootFall: {err}") from err


def digest(item: Any) -> str:
    """Content name of anything :func:`flatten` takes: 32 hexadecimal characters of SHA-256."""
    structure, arrays = flatten(item)
    sha = hashlib.sha256()
    sha.update(json.dumps(_without_software(structure), sort_keys=True).encode())
    for array in arrays:
        sha.update(f"{array.dtype.str}{array.shape}".encode())
        if array.dtype.kind == "f" and np.isnan(array).any():
            # NaN payloads differ between instructions; one NaN stands for all
            array = np.where(np.isnan(array), np.array(np.nan, array.dtype), array)
        sha.update(np.ascontiguousarray(array).tobytes())
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
