"""F Prime text sequences of our commands, as ``io.exports.as_fprime`` writes them."""

import re
from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_fprime import COMPONENT, HEADER, VERSION
from footfall.io.imports.parsed import (
    ParsedSequence,
    command,
    items,
    json_of,
    layout_in,
    member,
    only,
    require_rows,
    text,
    text_of,
    with_start,
)
from footfall.sequence.commands import Command
from footfall.telemetry.command_kinds import WAIT

_LINE = re.compile(rf"(?P<time>\S+)\s+{COMPONENT}\.(?P<name>\w+)\s+(?P<arguments>[^;]*?)\s*(?:;\s*(?P<comment>.*))?")
_HEADER = ("version", "robot", "start", "T_site_base", "at_rest", "digest", "software", "layout")
_AT_ONCE = re.compile(r"R00:00:00(\.0+)?")


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence, naming the line, where the file is not such a sequence.

    Other comments are read no more than ``fprime-seqgen`` reads them.
    """
    header, commands, rows = None, [], []
    for number, line in enumerate(text_of(data).split("\n"), start=1):
        if line.startswith(HEADER):
            if header is not None:
                raise InvalidSequence(f"line {number} is a second comment {HEADER.strip()!r}: give one sequence a file")
            header = json_of(line.removeprefix(HEADER))
        elif line.strip() and not line.startswith(";"):
            asked, row = _command(f"line {number}", line.strip())
            commands.append(asked)
            rows.append((f"line {number}", row))
    require_rows(rows)
    if header is None:
        raise InvalidSequence(f"it lacks the comment {HEADER.strip()!r} with what the commands start from")
    if (version := member(header, "version", HEADER)) != VERSION:
        raise InvalidSequence(f"this FootFall reads version {VERSION} of its sequences for F Prime, not {version!r}")
    only(header, _HEADER, HEADER.strip())
    robot, layout = text(member(header, "robot", HEADER), "robot"), layout_in(header, "its header")
    return with_start(ParsedSequence(robot, tuple(commands), described=layout), header, "its header")


def _command(where: str, line: str) -> tuple[Command, Any]:
    """It, and which row its comment says it is; None where there is none."""
    found = _LINE.fullmatch(line)
    if found is None:
        raise InvalidSequence(f"{where} must be a time, {COMPONENT}.<command> and its arguments: {line[:80]!r}")
    if not _AT_ONCE.fullmatch(found["time"]):
        raise InvalidSequence(f"{where} waits until {found['time']}; FootFall knows R00:00:00 only, and {WAIT.name}")
    comment = json_of(found["comment"]) if (found["comment"] or "").startswith("{") else {}
    only(comment, ("row", "phase"), f"{where}, its comment")
    arguments = items(json_of(f"[{found['arguments']}]"), where)
    asked = command(found["name"], arguments, text(comment.get("phase", ""), f"{where}, phase"), where)
    return asked, comment.get("row")
