"""Yamcs command stacks of our commands, as ``io.exports.as_yamcs`` writes them. They don't say what the commands start
from; texts, checks and gates say nothing of a command and are left out."""

import re
import sys
from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.io.exports.as_yamcs import SPACE_SYSTEM
from footfall.io.imports.told import Told, argument_names, command, items, json_of, member, text, text_of
from footfall.sequence.commands import Command

_ROBOT = re.compile(r"FootFall sequence \w+ for (?P<robot>.*?): \d+ commands, ", re.DOTALL)
_COMMENT = re.compile(r"row (?P<row>\d+)(?: (?P<phase>.*))?", re.DOTALL)
_ENTITY = re.compile(r"&#(\d{1,7});")
_SILENT = ("text", "check", "verify")


def decode(data: bytes) -> Told:
    """Raises InvalidSequence, naming the step, where the file is not such a stack."""
    steps = items(member(json_of(text_of(data)), "steps", "the file"), "steps")
    robot, commands = None, []
    for number, step in enumerate(steps):
        where = f"steps[{number}]"
        kind = text(member(step, "type", where), f"{where}, type")
        if kind == "command":
            commands.append(_command(where, step, len(commands)))
        elif kind not in _SILENT:
            raise InvalidSequence(f"{where} is of type {kind!r}; FootFall knows command, {', '.join(_SILENT)}")
        elif kind == "text" and (found := _ROBOT.match(text(member(step, "text", where), f"{where}, text"))):
            robot = _plain(found["robot"], where)
    if robot is None:
        raise InvalidSequence("it lacks the text 'FootFall sequence … for <robot>', which says for which robot it is")
    return Told(robot, tuple(commands))


def _command(where: str, step: Any, row: int) -> Command:
    path = text(member(step, "name", where), f"{where}, name")
    system, _, name = path.rpartition("/")
    if system != SPACE_SYSTEM:
        raise InvalidSequence(f"{where} is {path!r}; FootFall's commands begin with {SPACE_SYSTEM}/")
    found = _COMMENT.fullmatch(text(step.get("comment", f"row {row}"), f"{where}, comment"))
    if found is None or int(found["row"]) != row:
        raise InvalidSequence(f"{where} must have the comment 'row {row}' and its phase: rows are missing or moved")
    told: dict[str, Any] = {}
    for i, one in enumerate(items(member(step, "arguments", where), f"{where}, arguments")):
        argument = text(member(one, "name", f"{where}, arguments[{i}]"), f"{where}, arguments[{i}], name")
        if argument in told:
            raise InvalidSequence(f"{where} gives {argument!r} twice")
        told[argument] = member(one, "value", f"{where}, {argument}")
    names = argument_names(name, where)
    if sorted(told) != sorted(names):
        raise InvalidSequence(f"{where} has the arguments {', '.join(told) or 'none'}; {name} takes {', '.join(names)}")
    phase = _plain(found["phase"] or "", where)
    return command(name, [told[argument] for argument in names], phase, where)


def _plain(literal: str, where: str) -> str:
    """The text of what ``as_yamcs`` wrote in entities, by number and not as HTML reads them: that changes controls."""
    numbers = [int(found) for found in _ENTITY.findall(literal)]
    if any(number > sys.maxunicode or 0xD800 <= number < 0xE000 for number in numbers):
        raise InvalidSequence(f"{where} has an entity that is no character: {literal[:100]!r}")
    return _ENTITY.sub(lambda found: chr(int(found[1])), literal)
