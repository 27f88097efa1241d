"""An object of JSON whose members are others' to say: of files, messages and logs, or details of an error."""

from typing import Any

JsonObject = dict[str, Any]
"""Name → text, number, truth value, null, list or object. Where the members are known, a class names them instead."""
