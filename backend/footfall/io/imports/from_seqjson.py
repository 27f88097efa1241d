"""SeqJSON of our commands. The arguments' order counts: on the way through SeqN they lose their names."""

from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.io.imports.told import (
    Told,
    array,
    command,
    items,
    json_of,
    matrix,
    member,
    number,
    only,
    require_row,
    text,
    text_of,
)
from footfall.sequence.commands import LEG_JOINTS, ONE_LEG, Command

_NOT_CARRIED_OUT = ("parameters", "locals", "immediate_commands", "hardware_commands", "requests")
_DOCUMENT = ("id", "metadata", "steps")
_METADATA = (
    *("robot", "start", "T_site_base", "units"),
    *("format", "schema", "digest", "software", "parents", "final", "final_T_site_base"),
)
_STEP = ("type", "stem", "time", "args", "metadata")
_UNITS = {"angle": "rad", "duration": "s", "length": "m", "force": "N"}


def decode(data: bytes) -> Told:
    """Raises InvalidSequence, naming the place, where the file is not such a SeqJSON."""
    return of_document(json_of(text_of(data)))


def of_document(document: Any) -> Told:
    """The same from parsed JSON."""
    about = member(document, "metadata", "the file")
    for part in _NOT_CARRIED_OUT:
        if document.get(part):
            raise InvalidSequence(f"it has {part}, which FootFall can't carry out; only steps")
    only(document, (*_DOCUMENT, *_NOT_CARRIED_OUT), "the file")
    only(about, _METADATA, "metadata")
    told = about.get("units", {})
    if not isinstance(told, dict) or any(_UNITS.get(kind) != unit for kind, unit in told.items()):
        raise InvalidSequence(f"metadata, units are {told!r}; FootFall reads {_UNITS}")
    steps = items(member(document, "steps", "the file"), "steps")
    return Told(
        robot=text(member(about, "robot", "metadata"), "metadata, robot"),
        commands=tuple(_command(f"steps[{row}]", row, step) for row, step in enumerate(steps)),
        start=array(member(about, "start", "metadata"), "metadata, start"),
        T_site_base=matrix(member(about, "T_site_base", "metadata"), "metadata, T_site_base"),
    )


def _command(where: str, row: int, step: Any) -> Command:
    if (kind := member(step, "type", where)) != "command":
        raise InvalidSequence(f"{where} is of type {kind!r}; FootFall carries out commands only")
    if (time := member(step, "time", where)) != {"type": "COMMAND_COMPLETE"}:
        raise InvalidSequence(f"{where} has the time {time!r}; FootFall knows COMMAND_COMPLETE only")
    only(step, _STEP, where)
    name = text(member(step, "stem", where), f"{where}, stem")
    args = items(member(step, "args", where), f"{where}, args")
    numbers = [_number(arg, f"{where}, args[{i}]") for i, arg in enumerate(args)]
    names = [arg["name"] for arg in args if "name" in arg]
    if names and names != (expected := _names(name, len(args))):
        raise InvalidSequence(f"{where}: the arguments of {name} are {', '.join(expected)} in this order, not {names}")
    about = step.get("metadata", {})
    if not isinstance(about, dict):
        raise InvalidSequence(f"{where}, metadata must be an object")
    only(about, ("row", "phase"), f"{where}, metadata")
    require_row(about.get("row", row), row, where)
    phase = text(about.get("phase", ""), f"{where}, phase")
    return command(name, _by_kind(name, numbers), phase, where)


def _number(arg: Any, where: str) -> float:
    if (kind := member(arg, "type", where)) != "number":
        raise InvalidSequence(f"{where} is a {kind!r}, not a number")
    only(arg, ("type", "name", "value"), where)
    return number(member(arg, "value", where), where)


def _names(name: str, count: int) -> list[str]:
    if name in ONE_LEG:
        return ["leg", *LEG_JOINTS, "duration", *(["force"] if name == "LEG_LOWER" else [])]
    legs = range((count - 1) // 6)
    return [*(f"leg{leg}_{joint}" for leg in legs for joint in LEG_JOINTS), "duration"]


def _by_kind(name: str, numbers: list[float]) -> list[Any]:
    """The joints among the arguments as one list."""
    if name in ONE_LEG:
        return [*numbers[:1], numbers[1:7], *numbers[7:]]
    return [numbers[:-1], *numbers[-1:]] if name == "POSTURE_MOVE" else numbers
