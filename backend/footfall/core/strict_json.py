"""JSON from outside: no member given twice, no text that UTF-8 can't hold, neither too deep nor too many parts."""

import json
import re
from collections.abc import Callable, Sequence
from typing import Any

from footfall.core.json_object import JsonObject
from footfall.core.surrogates import has_lone_surrogate, spelled_out

MOST_DEEP = 64
"""Lists and objects within each other."""
MOST_PARTS = 1_000_000
"""Members, elements, lists and objects of one text: each takes sixty times as much memory as the text that says it."""

_TEXT = re.compile(r'"(?:[^"\\]|\\.)*+"?')


class NotStrict(json.JSONDecodeError):
    """It is JSON, but of a kind that is refused; where in the text is not known."""

    def __init__(self, message: str) -> None:
        super().__init__(message, "", 0)

    def __str__(self) -> str:
        return self.msg


def read_json(text: bytes | str, constant: Callable[[str], Any] | None = None, most: int = MOST_PARTS) -> Any:
    """``constant`` is given what stands for NaN and infinities, as ``parse_constant`` of ``json.loads``.

    most: parts that it may have; more are refused before any is made.
    Raises json.JSONDecodeError, of these NotStrict; UnicodeDecodeError as ``json.loads``.
    """
    if isinstance(text, bytes):
        text = text.decode(json.detect_encoding(text), "surrogatepass")
    # what stands in texts is counted only where it matters: taking them out takes long
    if _parts(text) > most and _parts(_TEXT.sub("", text)) > most:
        raise NotStrict(f"it has more than {most} members and elements; send less at once")
    try:
        found = json.loads(text, parse_constant=constant, object_pairs_hook=_members)
    except RecursionError:
        raise NotStrict(_TOO_DEEP) from None
    _require_flat_and_whole(found)
    return found


_TOO_DEEP = f"lists and objects stand within each other more than {MOST_DEEP} deep"


def _parts(text: str) -> int:
    return text.count(",") + text.count("[") + text.count("{")


def _members(pairs: Sequence[tuple[str, Any]]) -> JsonObject:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise NotStrict(f"the member {spelled_out(_twice(pairs)[:60])!r} is given twice")
    return found


def _twice(pairs: Sequence[tuple[str, Any]]) -> str:
    seen: set[str] = set()
    for name, _ in pairs:
        if name in seen:
            return name
        seen.add(name)
    return ""


def _require_flat_and_whole(found: Any) -> None:
    left = [(found, 0)]
    while left:
        one, deep = left.pop()
        if isinstance(one, str):
            if has_lone_surrogate(one):
                raise NotStrict(f"a text has a lone surrogate, half a character: {spelled_out(one[:60])}")
        elif isinstance(one, (dict, list)):
            if deep >= MOST_DEEP:
                raise NotStrict(_TOO_DEEP)
            left += [(part, deep + 1) for part in one]
            if isinstance(one, dict):
                left += [(part, deep + 1) for part in one.values()]
