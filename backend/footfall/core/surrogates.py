r"""Lone surrogates: halves of a character that JSON may spell (``\ud800``) and that no UTF-8 text can hold.

They are refused where text comes in, and written out as what they were where text goes out: what an earlier version
took in can still be read.
"""

import re
from typing import Any

_LONE = re.compile("[\ud800-\udfff]")


def has_lone_surrogate(text: str) -> bool:
    """Whether ``text`` can't be written as UTF-8."""
    return not text.isascii() and _LONE.search(text) is not None


def lone_surrogate_in(item: Any) -> str | None:
    """The beginning of a text with one in plain JSON, spelled out; None where there is none. Names of members count."""
    left = [item]
    while left:
        one = left.pop()
        if isinstance(one, str):
            if has_lone_surrogate(one):
                return spelled_out(one[:60])
        elif isinstance(one, dict):
            left += [*one, *one.values()]
        elif isinstance(one, list):
            left += one
    return None


def spelled_out(text: str) -> str:
    r"""``text`` with ``\ud800`` in six letters for each lone surrogate."""
    return _LONE.sub(lambda found: f"\\u{ord(found[0]):04x}", text) if has_lone_surrogate(text) else text


def all_spelled_out(item: Any) -> Any:
    """Plain JSON with every text, and every name, spelled out."""
    if isinstance(item, str):
        return spelled_out(item)
    if isinstance(item, dict):
        return {spelled_out(name): all_spelled_out(one) for name, one in item.items()}
    if isinstance(item, list):
        return [all_spelled_out(one) for one in item]
    return item
