"""Yamcs command stacks of our commands, as ``io.exports.as_yamcs`` writes them. They don't say what the commands start
from. Whatever else a stack can ask for (waits, checks, gates of others) is refused: nothing of it is dropped."""

import re
import sys
from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.core.json_object import JsonObject
from footfall.io.exports.as_yamcs import ADVANCEMENT, CHECK, GATE, SPACE_SYSTEM, UNITS
from footfall.io.imports.parsed import (
    ParsedSequence,
    command,
    items,
    json_of,
    known_kind,
    member,
    number,
    only,
    require_rows,
    text,
    text_of,
)
from footfall.sequence.commands import Command
from footfall.telemetry.command_kinds import WAIT

_ROBOT = re.compile(
    rf"FootFall sequence \w+ for (?P<robot>.*?): \d+ commands, [\d.]+ s\. {re.escape(UNITS)}", re.DOTALL
)
_COMMENT = re.compile(r"row (?P<row>\d+)(?: (?P<phase>.*))?", re.DOTALL)
_ENTITY = re.compile(r"&#(\d{1,7});")
_STEPS = ("command", "text", "check", "verify")


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence, naming the step, where the file is not such a stack."""
    document = json_of(text_of(data))
    steps = items(member(document, "steps", "the file"), "steps")
    only(document, ("$schema", "steps", "advancement"), "the file")
    _require_complete(member(document, "advancement", "the file"), "advancement")
    stack = _Stack()
    for position, step in enumerate(steps):
        stack.take(f"steps[{position}]", step)
    return stack.sequence()


class _Stack:
    """What the steps of a stack say, taken one by one. gate: where one is that still lacks its command."""

    def __init__(self) -> None:
        self._robot: str | None = None
        self._commands: list[Command] = []
        self._rows: list[tuple[str, int | None]] = []
        self._gate: str | None = None

    def take(self, where: str, step: Any) -> None:
        """Raises InvalidSequence where the step is none that FootFall can keep."""
        kind = text(member(step, "type", where), f"{where}, type")
        if kind not in _STEPS:
            raise InvalidSequence(f"{where} is of type {kind!r}; FootFall knows {', '.join(_STEPS)}")
        if self._gate is not None and kind != "command":
            raise InvalidSequence(f"{self._gate} is a gate, and {where} behind it no command")
        if kind == "command":
            self._take_command(where, step)
        elif kind == "verify":
            if step != GATE:
                raise InvalidSequence(f"{where} is another gate than FootFall's, which it can't keep: {_short(step)}")
            self._gate = where
        elif kind == "check":
            if step != CHECK or self._commands:
                raise InvalidSequence(
                    f"{where} is another check than FootFall's first, which it can't keep: {_short(step)}"
                )
        else:
            self._robot = _robot(where, step, self._robot)

    def _take_command(self, where: str, step: Any) -> None:
        asked, row = _command(where, step)
        self._commands.append(asked)
        self._rows.append((where, row))
        if self._gate is not None and not asked.kind.moves:
            raise InvalidSequence(
                f"{self._gate} is a gate before a command that moves nothing, which FootFall can't keep"
            )
        self._gate = None

    def sequence(self) -> ParsedSequence:
        """After the last step. Raises InvalidSequence where something of it is missing."""
        if self._gate is not None:
            raise InvalidSequence(f"{self._gate} is a gate with no command behind it")
        if self._robot is None:
            raise InvalidSequence(
                "it lacks the text 'FootFall sequence … for <robot>', which says for which robot it is"
            )
        require_rows(self._rows)
        return ParsedSequence(self._robot, tuple(self._commands))


def _robot(where: str, step: JsonObject, before: str | None) -> str:
    named = text(member(step, "text", where), f"{where}, text")
    only(step, ("type", "text"), where)
    found = _ROBOT.fullmatch(named)
    if found is None and before is None:
        raise InvalidSequence(
            f"it lacks the text 'FootFall sequence … for <robot>: … {UNITS}', which says for which robot it is: "
            f"{where} says {named[:100]!r}"
        )
    if found is None or before is not None:
        raise InvalidSequence(f"{where} is a text that FootFall can't keep; take it out: {named[:100]!r}")
    return _plain(found["robot"], where)


def _require_complete(verified: Any, where: str) -> None:
    """Raise InvalidSequence unless the next step comes as soon as the one before is complete, as FootFall's do."""
    acknowledgment = text(member(verified, "acknowledgment", where), f"{where}, acknowledgment")
    only(verified, tuple(ADVANCEMENT), where)
    if acknowledgment != ADVANCEMENT["acknowledgment"]:
        raise InvalidSequence(
            f"{where} goes on at {acknowledgment!r}; FootFall's commands begin when the one before is done, at "
            f"{ADVANCEMENT['acknowledgment']!r}"
        )
    if (wait := number(verified.get("wait", 0), f"{where}, wait")) != 0:
        raise InvalidSequence(f"{where} waits {wait:g} ms; FootFall can't keep that: give a {SPACE_SYSTEM}/{WAIT.name}")


def _command(where: str, step: Any) -> tuple[Command, int | None]:
    """It, and which row its comment says it is; None where it has none."""
    path = text(member(step, "name", where), f"{where}, name")
    system, _, name = path.rpartition("/")
    if system != SPACE_SYSTEM:
        raise InvalidSequence(f"{where} is {path!r}; FootFall's commands begin with {SPACE_SYSTEM}/")
    only(step, ("type", "name", "arguments", "comment", "advancement"), where)
    if "advancement" in step:
        _require_complete(step["advancement"], f"{where}, advancement")
    found = _COMMENT.fullmatch(text(step["comment"], f"{where}, comment")) if "comment" in step else None
    if found is None and "comment" in step:
        raise InvalidSequence(f"{where} must have the comment 'row' with its number and its phase")
    arguments: dict[str, object] = {}
    for i, one in enumerate(items(member(step, "arguments", where), f"{where}, arguments")):
        argument = text(member(one, "name", f"{where}, arguments[{i}]"), f"{where}, arguments[{i}], name")
        if argument in arguments:
            raise InvalidSequence(f"{where} gives {argument!r} twice")
        arguments[argument] = member(one, "value", f"{where}, {argument}")
        only(one, ("name", "value"), f"{where}, {argument}")
    names = known_kind(name, where).argument_names
    if sorted(arguments) != sorted(names):
        raise InvalidSequence(
            f"{where} has the arguments {', '.join(arguments) or 'none'}; {name} takes {', '.join(names)}"
        )
    phase = "" if found is None else _plain(found["phase"] or "", where)
    asked = command(name, [arguments[argument] for argument in names], phase, where)
    return asked, None if found is None else int(found["row"])


def _short(step: JsonObject) -> str:
    return str({name: item for name, item in step.items() if name != "type"})[:160]


def _plain(literal: str, where: str) -> str:
    """The text of what ``as_yamcs`` wrote in entities, by number and not as HTML reads them: that changes controls."""
    numbers = [int(found) for found in _ENTITY.findall(literal)]
    if any(number > sys.maxunicode or 0xD800 <= number < 0xE000 for number in numbers):
        raise InvalidSequence(f"{where} has an entity that is no character: {literal[:100]!r}")
    return _ENTITY.sub(lambda found: chr(int(found[1])), literal)
