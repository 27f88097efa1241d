"""Values as JSON for people and scripts: plain numbers and lists, unknown as null, never NaN."""

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from footfall.core.surrogates import spelled_out
from footfall.core.value import Value


def jsonable(item: Any, arrays: bool = True) -> Any:
    """Return ``item`` in terms of JSON.

    Floats that are not finite become null; text is such that UTF-8 can hold it, whatever an older log has. Values
    become objects with their ``digest``; with ``arrays=False`` an array becomes ``{"dtype", "shape"}``, for summaries
    of what is too large to list.
    """
    if item is None or isinstance(item, (bool, int)):
        return item
    if isinstance(item, str):
        return spelled_out(item)
    if isinstance(item, float):
        return item if math.isfinite(item) else None
    if isinstance(item, Enum):
        return jsonable(item.value, arrays)
    if isinstance(item, np.generic):
        return jsonable(item.item(), arrays)
    if isinstance(item, np.ndarray):
        return _array(item) if arrays else {"dtype": str(item.dtype), "shape": list(item.shape)}
    if isinstance(item, Value):
        body = {f.name: jsonable(getattr(item, f.name), arrays) for f in fields(item)}  # type: ignore[arg-type]
        return {**body, "digest": item.digest}
    if is_dataclass(item) and not isinstance(item, type):
        return {f.name: jsonable(getattr(item, f.name), arrays) for f in fields(item)}
    if isinstance(item, Mapping):
        return {spelled_out(str(name)): jsonable(one, arrays) for name, one in item.items()}
    if isinstance(item, (list, tuple, set, frozenset)):
        return [jsonable(one, arrays) for one in item]
    if isinstance(item, bytes):
        return item.decode("utf-8", "replace")
    return spelled_out(str(item))


def _array(array: np.ndarray) -> Any:
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array.tolist()
    listed = array.astype(object)
    listed[~np.isfinite(array)] = None
    return listed.tolist()


def dumps(item: Any) -> str:
    """JSON text of anything :func:`jsonable` takes."""
    return json.dumps(jsonable(item), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
