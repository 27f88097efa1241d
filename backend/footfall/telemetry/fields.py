"""Strict reading of JSON objects from outside: every field present, of its type, finite; nothing beside them."""

import math
from collections.abc import Mapping
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTelemetry
from footfall.core.strict_json import read_json

FAULTS = (
    "not-json",
    "not-finite",
    "unknown-message",
    "not-for-ground",
    "wrong-version",
    "wrong-robot",
    "wrong-legs",
    "wrong-field",
    "no-hello",
    "time-backwards",
    "number-jump",
    "too-large",
    "images",
    "refused-by-rover",
    "outdated-command",
    "contradiction",
    "other",
)
"""Kinds of what may be wrong on the rover link, as ``fault`` in an error's details; see docs/rover-link.md."""

MESSAGE_PARTS = 20_000
"""Members and elements of one message: telemetry of six legs has two hundred, that of nine image pairs a thousand."""
MAX_TEXT = 2000
"""Longest accepted text field [characters]."""


def parse_object(text: str | bytes, *, finite: bool = True, most: int = MESSAGE_PARTS) -> dict[str, object]:
    """A JSON object. Raises InvalidTelemetry for other JSON, names given twice, lone surrogates, NaN and infinities.

    finite: False lets those through, for :class:`Fields` to refuse where they are read.
    most: members and elements that it may have; more are refused before any is made.
    """
    try:
        parsed = read_json(text, _no_constant if finite else float, most)
    except ValueError as err:
        raise InvalidTelemetry(f"a message is one JSON object; this is not JSON: {err}", fault="not-json") from err
    if not isinstance(parsed, dict):
        raise InvalidTelemetry(f"a message is one JSON object, not a {type(parsed).__name__}", fault="not-json")
    return parsed


def _no_constant(name: str) -> NoReturn:
    raise InvalidTelemetry(
        f"{name} is no number of the rover link; numbers are finite", number=name, fault="not-finite"
    )


class Fields:
    """The fields of one message, taken one by one; :meth:`end` refuses what is left over."""

    def __init__(self, body: Mapping[str, object], message: str) -> None:
        self._left = dict(body)
        self._message = message

    def _take(self, name: str) -> object:
        if name not in self._left:
            raise InvalidTelemetry(f"{self._message}: {name} is missing", field=name)
        return self._left.pop(name)

    def has(self, name: str) -> bool:
        """Whether a field that may be left out is there and was not taken yet."""
        return name in self._left

    def _null(self, name: str) -> bool:
        """Whether the field is there and null, which takes it."""
        null = self._left.get(name, 0) is None
        if null:
            del self._left[name]
        return null

    def _refuse(self, name: str, wanted: str, got: object) -> InvalidTelemetry:
        shown = repr(got)
        shown = shown if len(shown) <= 60 else shown[:57] + "..."
        return InvalidTelemetry(f"{self._message}: {name} must be {wanted}, not {shown}", field=name)

    def text(self, name: str, longest: int = MAX_TEXT, empty: bool = False) -> str:
        """Takes a text of 1 to ``longest`` characters, or of none where it may be ``empty``.

        Raises InvalidTelemetry for anything else.
        """
        got = self._take(name)
        if not isinstance(got, str) or len(got) > longest or not (got or empty):
            raise self._refuse(name, f"a text of {0 if empty else 1} to {longest} characters", got)
        return got

    def identifier(self, name: str = "id") -> str:
        """Takes a text of 1 to 64 characters, as ids are."""
        return self.text(name, longest=64)

    def choice(self, name: str, choices: tuple[str, ...]) -> str:
        """Takes one of the texts that there are to choose from; raises InvalidTelemetry for any other."""
        got = self._take(name)
        if not isinstance(got, str) or got not in choices:
            raise self._refuse(name, f"one of {', '.join(choices)}", got)
        return got

    def whole(self, name: str, least: int = 0) -> int:
        """Takes a whole number from ``least`` to 2⁵³ − 1; raises InvalidTelemetry for others, true and false too."""
        got = self._take(name)
        if not isinstance(got, int) or isinstance(got, bool) or not least <= got < 2**53:
            raise self._refuse(name, f"a whole number from {least}", got)
        return got

    def whole_or_null(self, name: str) -> int | None:
        """Takes a whole number from 0, or null as None."""
        if self._null(name):
            return None
        return self.whole(name)

    def number(self, name: str) -> float:
        """Takes a finite number; raises InvalidTelemetry for others, true and false included."""
        return self._number(name, self._take(name))

    def _number(self, name: str, got: object) -> float:
        if isinstance(got, bool) or not isinstance(got, (int, float)):
            raise self._refuse(name, "a number", got)
        try:
            number = float(got)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            refusal = self._refuse(name, "a finite number", got)
            refusal.details["fault"] = "not-finite"
            raise refusal
        return number

    def array(self, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Nested lists of numbers of exactly ``shape``."""
        flat: list[float] = []
        self._collect(name, self._take(name), shape, flat)
        return np.array(flat, float).reshape(shape)

    def angles(self, name: str, legs: int | None) -> NDArray[np.float64]:
        """Six numbers for each leg, (legs × 6,); any number of legs where ``legs`` is None."""
        got = self._left.get(name)
        count = len(got) if isinstance(got, list) else 0
        if legs is None and (count == 0 or count % 6):
            raise self._refuse(name, "a list of six numbers for each leg", self._take(name))
        if legs is not None and count and count % 6 == 0 and count != 6 * legs:
            raise InvalidTelemetry(
                f"{self._message}: {name} needs {6 * legs} numbers, not {count} of them: "
                f"the rover has {legs} legs, not {count // 6}",
                field=name,
                fault="wrong-legs",
            )
        return self.array(name, (count if legs is None else 6 * legs,))

    def number_or_null(self, name: str) -> float | None:
        """Takes a finite number, or null as None."""
        if self._null(name):
            return None
        return self.number(name)

    def angles_or_null(self, name: str, legs: int | None) -> NDArray[np.float64] | None:
        """Takes six numbers for each leg, (legs × 6,), or null as None; see :meth:`angles`."""
        if self._null(name):
            return None
        return self.angles(name, legs)

    def array_or_null(self, name: str, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
        """Takes nested lists of numbers of exactly ``shape``, or null as None."""
        if self._null(name):
            return None
        return self.array(name, shape)

    def _collect(self, name: str, got: object, shape: tuple[int, ...], flat: list[float]) -> None:
        if not shape:
            flat.append(self._number(name, got))
            return
        if not isinstance(got, list) or len(got) != shape[0]:
            count = f"{len(got)} of them" if isinstance(got, list) else repr(type(got).__name__)
            wanted = "numbers" if len(shape) == 1 else "rows"
            raise InvalidTelemetry(f"{self._message}: {name} needs {shape[0]} {wanted}, not {count}", field=name)
        for one in got:
            self._collect(name, one, shape[1:], flat)

    def texts(self, name: str, empty: bool = False, wanted: str = "a list of names") -> tuple[str, ...]:
        """Takes a list of names, each of 1 to 64 characters, at least one unless it may be ``empty``."""
        got = self._take(name)
        named = isinstance(got, list) and all(isinstance(one, str) and 0 < len(one) <= 64 for one in got)
        if not isinstance(got, list) or not named or not (got or empty):
            raise self._refuse(name, wanted, got)
        return tuple(got)

    def texts_or_null(self, name: str) -> tuple[str, ...] | None:
        """Takes a list of names, at least one, each of 1 to 64 characters, or null as None."""
        return None if self._null(name) else self.texts(name, wanted="null or a list of names")

    def objects(self, name: str) -> list[dict[str, object]]:
        """Takes a list of objects, maybe empty, as they came: what is in them is for the caller to check."""
        got = self._take(name)
        if not isinstance(got, list) or not all(isinstance(one, dict) for one in got):
            raise self._refuse(name, "a list of objects", got)
        return got

    def inner(self, name: str) -> dict[str, object]:
        """Takes an object as it came: what is in it is for the caller to check."""
        got = self._take(name)
        if not isinstance(got, dict):
            raise self._refuse(name, "an object", got)
        return got

    def end(self) -> None:
        """Raises InvalidTelemetry where fields are left that the message does not have."""
        if self._left:
            unknown = sorted(self._left)
            raise InvalidTelemetry(f"{self._message}: unknown fields {', '.join(unknown)}", fields=unknown)
