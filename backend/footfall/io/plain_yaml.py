"""The plain part of YAML that calibration files are written in, read strictly.

Nested mappings by indentation (spaces), lists in brackets over any number of lines, lists of scalars with leading
dashes, quoted and plain text, numbers, true, false, null, comments and one ``---`` at the start. Anything else
(anchors, tags, braces, block text, several documents, repeated keys) is refused with its line, never guessed at.
"""

import re

from footfall.core.errors import InvalidInput

_KEY = re.compile(r"""(?P<key>"[^"]*"|'[^']*'|[A-Za-z_][\w./ -]*?)\s*:(?:\s+(?P<rest>.*))?$""")
# not 0500, which is 500 to some readers and octal to others
_NUMBER = re.compile(r"[-+]?(?!0\d+$)(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$", re.ASCII)
_SPECIAL = {"true": True, "false": False, "null": None, "~": None, ".nan": float("nan"), "nan": float("nan")}
_INFINITE = re.compile(r"([-+]?)\.?inf$", re.IGNORECASE)
_DEEPEST = 20


class _Line:
    def __init__(self, number: int, text: str) -> None:
        self.number = number
        self.indent = len(text) - len(text.lstrip(" "))
        self.text = text.strip()


def parse_yaml(text: str) -> dict[str, object]:
    """The mapping that the text is. Raises InvalidInput naming the line."""
    return _parsed(list(enumerate(text.splitlines(), start=1)))


def parse_messages(text: str) -> list[dict[str, object]]:
    """The mappings that ``---`` parts, as ``ros2 topic echo`` prints it behind each message."""
    parts: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(text.splitlines(), start=1):
        if line.rstrip() == "---":
            parts.append([])
        else:
            parts[-1].append((number, line))
    said = [part for part in parts if any(_without_comment(line).strip() for _, line in part)]
    return [_parsed(part) for part in said or parts[:1]]


def _parsed(numbered: list[tuple[int, str]]) -> dict[str, object]:
    lines = _joined(numbered)
    if not lines:
        raise InvalidInput("the file is empty")
    found, after = _mapping(lines, 0, lines[0].indent, 0)
    if after < len(lines):
        raise _refusal(lines[after], "is not indented like what it follows")
    return found


def _refusal(line: _Line, why: str) -> InvalidInput:
    return InvalidInput(f"line {line.number} {why}: {line.text[:60]!r}", line=line.number)


def _joined(numbered: list[tuple[int, str]]) -> list[_Line]:
    """Lines without comments and blank ones; a list in brackets that goes on over lines becomes one line."""
    out: list[_Line] = []
    open_line: _Line | None = None
    for number, raw in numbered:
        line = _Line(number, _without_comment(raw))
        if not line.text or (line.text == "---" and not out):
            continue
        if "\t" in raw[: len(raw) - len(raw.lstrip())]:
            raise _refusal(line, "is indented with a tab; use spaces")
        if line.text.startswith(("%", "---", "...")):
            raise _refusal(line, "begins a directive or another document, which is not read")
        if open_line is not None:
            open_line.text += " " + line.text
        else:
            out.append(line)
            open_line = line
        if _depth(open_line.text) <= 0:
            open_line = None
    if open_line is not None:
        raise _refusal(open_line, "opens a list that never ends")
    return out


def _without_comment(raw: str) -> str:
    quote = ""
    for i, sign in enumerate(raw):
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        elif sign == "#" and (i == 0 or raw[i - 1] in " \t"):
            return raw[:i]
    return raw


def _depth(text: str) -> int:
    bare = re.sub(r"\"[^\"]*\"|'[^']*'", "", text)
    return bare.count("[") - bare.count("]")


def _mapping(lines: list[_Line], i: int, indent: int, depth: int) -> tuple[dict[str, object], int]:
    if depth > _DEEPEST:
        raise _refusal(lines[i], "is nested too deeply")
    out: dict[str, object] = {}
    while i < len(lines) and lines[i].indent == indent and not _is_item(lines[i]):
        line = lines[i]
        match = _KEY.match(line.text)
        if match is None:
            raise _refusal(line, "is not of the form `key: value`")
        key, rest = match["key"].strip("\"'"), match["rest"]
        if key in out:
            raise _refusal(line, f"gives {key!r} a second time")
        i += 1
        if rest:
            out[key] = _inline(rest, line)
        elif i < len(lines) and _is_item(lines[i]) and lines[i].indent >= indent:
            out[key], i = _items(lines, i)
        elif i < len(lines) and lines[i].indent > indent:
            out[key], i = _mapping(lines, i, lines[i].indent, depth + 1)
        else:
            out[key] = None
    if i < len(lines) and lines[i].indent > indent:
        raise _refusal(lines[i], "is not indented like what it follows")
    return out, i


def _is_item(line: _Line) -> bool:
    return line.text == "-" or line.text.startswith("- ")


def _items(lines: list[_Line], i: int) -> tuple[list[object], int]:
    out, indent = [], lines[i].indent
    while i < len(lines) and lines[i].indent == indent and _is_item(lines[i]):
        text = lines[i].text[1:].strip()
        if not text or _is_item(_Line(0, text)) or (_KEY.match(text) and text[0] not in "\"'"):
            raise _refusal(lines[i], "is no single value; lists hold numbers and text only")
        out.append(_inline(text, lines[i]))
        i += 1
    return out, i


def _inline(text: str, line: _Line) -> object:
    if not text.startswith("["):
        return _scalar(text, line)
    stack: list[list[object]] = [[]]
    before = "["
    for token in re.findall(r"\"[^\"]*\"|'[^']*'|[\[\],]|[^\[\],\s][^\[\],]*", text):
        if token == "[":
            if len(stack) > _DEEPEST:
                raise _refusal(line, "is nested too deeply")
            stack.append([])
        elif token == "]":
            closed = stack.pop()
            if not stack:
                raise _refusal(line, "closes a list that was not opened")
            stack[-1].append(closed)
        elif token != ",":
            stack[-1].append(_scalar(token.strip(), line))
        elif before in ("[", ","):
            raise _refusal(line, "has nothing between two commas, or before the first")
        before = token
    if len(stack) != 1 or len(stack[0]) != 1:
        raise _refusal(line, "is no list in brackets")
    return stack[0][0]


def _scalar(text: str, line: _Line) -> object:
    if text[0] in "\"'":
        if len(text) < 2 or text[-1] != text[0] or text[0] in text[1:-1]:
            raise _refusal(line, "has an odd quotation mark")
        return text[1:-1]
    if text[0] in "{&*!|>%@`":
        raise _refusal(line, f"uses {text[0]!r}, which is not read here")
    if _NUMBER.match(text):
        return float(text) if any(sign in text for sign in ".eE") else int(text)
    infinite = _INFINITE.match(text)
    if infinite:
        return float(f"{infinite[1]}inf")
    return _SPECIAL.get(text.lower(), text)
