"""JSON from outside: no member given twice, no text that UTF-8 can't hold."""

import json
from collections.abc import Callable
from typing import Any

from footfall.core.surrogates import lone_surrogate_in, spelled_out


class NotStrict(json.JSONDecodeError):
    """It is JSON, but of a kind that is refused; where in the text is not known."""

    def __init__(self, told: str) -> None:
        super().__init__(told, "", 0)

    def __str__(self) -> str:
        return self.msg


def read_json(text: bytes | str, constant: Callable[[str], Any] | None = None) -> Any:
    """``constant`` is given what stands for NaN and infinities, as ``parse_constant`` of ``json.loads``.

    Raises json.JSONDecodeError, of these two NotStrict; UnicodeDecodeError and RecursionError as ``json.loads``.
    """
    found = json.loads(text, parse_constant=constant, object_pairs_hook=_members)
    halved = lone_surrogate_in(found)
    if halved is not None:
        raise NotStrict(f"a text has a lone surrogate, half a character: {halved}")
    return found


def _members(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise NotStrict(f"the member {spelled_out(twice[:60])!r} is given twice")
    return found
