"""Typed reading of a parsed description file; every refusal names the entry."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidRobot


class Table:
    """One table of the file; ``where`` is its dotted name."""

    def __init__(self, raw: Any, where: str) -> None:
        if not isinstance(raw, Mapping):
            raise InvalidRobot(f"{where or 'the robot description'} must be a table")
        self._raw = raw
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._raw

    def __iter__(self) -> Iterator[str]:
        return iter(self._raw)

    def only(self, keys: str) -> None:
        """Refuse entries other than the space-separated ``keys``: a misspelt one would be ignored."""
        unknown = [key for key in self._raw if key not in keys.split()]
        if unknown:
            place = self.where or "the robot description"
            raise InvalidRobot(f"{place} has no entry {unknown[0]!r}; it has {keys.replace(' ', ', ')}")

    def table(self, key: str) -> "Table":
        """A table inside this one."""
        return Table(self._get(key), self._name(key))

    def tables(self, key: str) -> list["Table"]:
        """The tables of a list; raises InvalidRobot where it is none."""
        items = self._get(key)
        if not isinstance(items, list):
            raise InvalidRobot(f"{self._name(key)} must be a list of tables")
        return [Table(item, f"{self._name(key)}[{i}]") for i, item in enumerate(items)]

    def text(self, key: str) -> str:
        """A text that is not empty; raises InvalidRobot for anything else."""
        item = self._get(key)
        if not isinstance(item, str) or not item:
            raise InvalidRobot(f"{self._name(key)} must be a text")
        return item

    def texts(self, key: str) -> tuple[str, ...]:
        """The texts of a list, maybe none; raises InvalidRobot for anything else."""
        items = self._get(key)
        if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
            raise InvalidRobot(f"{self._name(key)} must be a list of texts")
        return tuple(items)

    def integer(self, key: str) -> int:
        """A whole number; raises InvalidRobot for anything else, true and false included."""
        item = self._get(key)
        if not isinstance(item, int) or isinstance(item, bool):
            raise InvalidRobot(f"{self._name(key)} must be a whole number")
        return item

    def number(self, key: str) -> float:
        """A number, as it is in the file: units are the reader's."""
        return self._number(self._get(key), key)

    def numbers(self, key: str, count: int | None = None) -> NDArray[np.float64]:
        """The numbers of a list, ``count`` of them unless that is None; raises InvalidRobot for anything else."""
        items = self._get(key)
        if not isinstance(items, list) or (count is not None and len(items) != count):
            raise InvalidRobot(f"{self._name(key)} must be a list of {count or 'some'} numbers")
        return np.array([self._number(item, key) for item in items], float)

    def corners(self, key: str) -> NDArray[np.float64]:
        """Three or more points, (n, 3)."""
        items = self._get(key)
        if not isinstance(items, list) or len(items) < 3 or not all(isinstance(i, list) and len(i) == 3 for i in items):
            raise InvalidRobot(f"{self._name(key)} must be a list of three or more points of three numbers")
        return np.array([[self._number(item, key) for item in corner] for corner in items], float)

    def pairs(self, key: str) -> tuple[tuple[str, str], ...]:
        """Pairs of texts; raises InvalidRobot for anything else."""
        items = self._get(key)
        whole = isinstance(items, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in items)
        if not whole or not all(isinstance(item, str) for pair in items for item in pair):
            raise InvalidRobot(f"{self._name(key)} must be a list of pairs of texts")
        return tuple((pair[0], pair[1]) for pair in items)

    def _number(self, item: Any, key: str) -> float:
        if isinstance(item, bool) or not isinstance(item, (int, float)) or not math.isfinite(item):
            raise InvalidRobot(f"{self._name(key)} must be a finite number")
        return float(item)

    def _get(self, key: str) -> Any:
        if key not in self._raw:
            raise InvalidRobot(f"the robot description lacks {self._name(key)}")
        return self._raw[key]

    def _name(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key
