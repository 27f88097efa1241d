"""Where a parser gave up on a file from outside, in our words: its own say how it is built, not what to put right."""

import json
import re
from xml.etree.ElementTree import ParseError

from footfall.core.strict_json import NotStrict

_LINE = re.compile(r"line (\d+), column (\d+)")


class Unreadable(ValueError):
    """What is wrong with a file, in our words; other errors from within a reader are in those of a parser."""


def not_utf8(err: UnicodeDecodeError) -> str:
    """Where a text is not UTF-8, and what would be right."""
    line = err.object.count(b"\n", 0, err.start) + 1
    return f"byte {err.start}, in line {line}, is not of UTF-8; save it as UTF-8"


def place_of(err: BaseException) -> str:
    """What to put after "it is no JSON" and the like: ", at line 3, column 5"; "" where the error does not say."""
    match err:
        case NotStrict() | Unreadable():
            return f": {err}"
        case json.JSONDecodeError():
            return f", at line {err.lineno}, column {err.colno}"
        case UnicodeDecodeError():
            return f": {not_utf8(err)}"
        case RecursionError():
            return ": it is nested too deeply"
        case ParseError():
            return f", at line {err.position[0]}, column {err.position[1] + 1}"
    # of TOML, only the text says where
    found = _LINE.search(str(err))
    return "" if found is None else f", at line {found[1]}, column {found[2]}"
