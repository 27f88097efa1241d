"""The values of one session: on disk, and the latest of them in memory."""

from collections import OrderedDict
from collections.abc import Mapping
from threading import Lock
from typing import Any, TypeVar

import numpy as np

from footfall.core.errors import NotFound
from footfall.core.value import Value, fields_of
from footfall.session.storage.store import SessionStore
from footfall.telemetry.images import Snapshot
from footfall.telemetry.photographs import Photographs

_V = TypeVar("_V", bound=Value)

CACHED_VALUES = 24
CACHED_BYTES = 512 << 20
"""Of the arrays of all of them; beyond that the oldest go, but for the ..."""
CACHED_ANYWAY = 4
"""... latest: ground, maps, plan and state of even the largest map are worked with in turn."""
CACHED_PIXELS = 100_000_000
"""Of the images among them; beyond that the oldest images go."""


class ValueStore:
    """Puts and gets values by digest. Thread-safe; never holds its lock while reading or writing files."""

    def __init__(self, store: SessionStore) -> None:
        self._store = store
        self._guard = Lock()
        self._values: OrderedDict[str, Value] = OrderedDict()
        self._bytes: dict[str, int] = {}

    def put(self, value: Value) -> str:
        """Store a value; returns its digest."""
        digest = self._store.put(value)
        self._keep(value)
        return digest

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle where the stored file is damaged."""
        with self._guard:
            if digest in self._values:
                self._values.move_to_end(digest)
                return self._values[digest]
        value = self._store.get(digest)
        self._keep(value)
        return value

    def typed(self, cls: type[_V], digest: str) -> _V:
        """As :meth:`get`; NotFound also where it is another kind of value."""
        value = self.get(digest)
        if not isinstance(value, cls):
            raise NotFound(f"{digest} is a {type(value).__name__}, not a {cls.__name__}", digest=digest)
        return value

    def _let_go(self, digest: str) -> None:
        del self._values[digest], self._bytes[digest]

    def _keep(self, value: Value) -> None:
        size = _bytes_in(value)
        with self._guard:
            self._values[value.digest] = value
            self._values.move_to_end(value.digest)
            self._bytes[value.digest] = size
            while len(self._values) > CACHED_VALUES or (
                len(self._values) > CACHED_ANYWAY and sum(self._bytes.values()) > CACHED_BYTES
            ):
                self._let_go(next(iter(self._values)))
            pixels = 0
            for digest, kept in reversed(list(self._values.items())):
                if isinstance(kept, (Snapshot, Photographs)):
                    pixels += kept.pixels
                    if pixels > CACHED_PIXELS:
                        self._let_go(digest)


def _bytes_in(item: Any) -> int:
    """Of the arrays in a value, however deep."""
    if isinstance(item, np.ndarray):
        return item.nbytes
    if isinstance(item, Value):
        return sum(map(_bytes_in, fields_of(item).values()))
    if isinstance(item, Mapping):
        return sum(map(_bytes_in, item.values()))
    return sum(map(_bytes_in, item)) if isinstance(item, tuple) else 0
