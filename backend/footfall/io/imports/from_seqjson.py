"""SeqJSON of our commands. The arguments' order counts: on the way through SeqN they lose their names."""

from typing import Any

from footfall.core.errors import InvalidSequence
from footfall.io.exports import as_seqjson
from footfall.io.imports.parsed import (
    ParsedSequence,
    command,
    items,
    json_of,
    known_kind,
    layout_in,
    member,
    members,
    number,
    only,
    require_rows,
    text,
    text_of,
    whole,
    with_start,
)
from footfall.sequence.commands import Command
from footfall.telemetry.command_kinds import (
    ALL_ANGLES,
    DURATION,
    FORCE,
    JOINTS_OF_LEG,
    LEG,
    LEG_ANGLES,
    CommandKind,
)
from footfall.telemetry.joint_layout import JointLayout

_NOT_CARRIED_OUT = ("parameters", "locals", "immediate_commands", "hardware_commands", "requests")
_DOCUMENT = ("id", "metadata", "steps")
_METADATA = (
    *("robot", "start", "T_site_base", "at_rest", "units", "layout"),
    *("format", "schema", "digest", "software", "parents", "final", "final_T_site_base"),
)
_STEP = ("type", "stem", "time", "args", "metadata")
_UNITS = {"angle": LEG_ANGLES.unit, "duration": DURATION.unit, "length": "m", "force": FORCE.unit}


def decode(data: bytes) -> ParsedSequence:
    """Raises InvalidSequence, naming the place, where the file is not such a SeqJSON."""
    return of_document(json_of(text_of(data)))


def of_document(document: Any) -> ParsedSequence:
    """The same from parsed JSON."""
    about = members(member(document, "metadata", "the file"), "metadata")
    for part in _NOT_CARRIED_OUT:
        if document.get(part):
            raise InvalidSequence(f"it has {part}, which FootFall can't carry out; only steps")
    only(document, (*_DOCUMENT, *_NOT_CARRIED_OUT), "the file")
    only(about, _METADATA, "metadata")
    units = about.get("units", {})
    if not isinstance(units, dict) or any(_UNITS.get(kind) != unit for kind, unit in units.items()):
        raise InvalidSequence(f"metadata, units are {units!r}; FootFall reads {_UNITS}")
    steps = items(member(document, "steps", "the file"), "steps")
    layout = layout_in(about, "metadata")
    commands = tuple(_command(f"steps[{i}]", step, layout) for i, step in enumerate(steps))
    require_rows([(f"steps[{i}]", step.get("metadata", {}).get("row")) for i, step in enumerate(steps)])
    parsed = ParsedSequence(text(member(about, "robot", "metadata"), "metadata, robot"), commands, described=layout)
    return with_start(parsed, about, "metadata")


def _command(where: str, step: Any, layout: JointLayout | None) -> Command:
    if (kind := member(step, "type", where)) != "command":
        raise InvalidSequence(f"{where} is of type {kind!r}; FootFall carries out commands only")
    if (time := member(step, "time", where)) != {"type": "COMMAND_COMPLETE"}:
        raise InvalidSequence(f"{where} has the time {time!r}; FootFall knows COMMAND_COMPLETE only")
    only(step, _STEP, where)
    name = text(member(step, "stem", where), f"{where}, stem")
    args = items(member(step, "args", where), f"{where}, args")
    numbers = [_number(arg, f"{where}, args[{i}]") for i, arg in enumerate(args)]
    names = [arg["name"] for arg in args if "name" in arg]
    kind = known_kind(name, where)
    leg = _leg(kind, numbers, layout, where)
    count = JOINTS_OF_LEG if layout is None or leg is None else len(layout.joints[leg])
    legs = (len(args) - len(kind.arguments) + 1) // JOINTS_OF_LEG
    if names and names != (expected := as_seqjson.names(kind, leg, layout, legs)):
        raise InvalidSequence(f"{where}: the arguments of {name} are {', '.join(expected)} in this order, not {names}")
    about = step.get("metadata", {})
    if not isinstance(about, dict):
        raise InvalidSequence(f"{where}, metadata must be an object")
    only(about, ("row", "phase"), f"{where}, metadata")
    phase = text(about.get("phase", ""), f"{where}, phase")
    return command(name, _by_argument(kind, numbers, count), phase, where)


def _leg(kind: CommandKind, numbers: list[float], layout: JointLayout | None, where: str) -> int | None:
    """The leg that a command names, where the robot's layout says what joints it has."""
    if layout is None or not kind.names_leg or not numbers:
        return None
    leg = whole(numbers[kind.arguments.index(LEG)], f"{where}, leg")
    if not 0 <= leg < len(layout.legs):
        raise InvalidSequence(f"{where}: the robot has legs 0…{len(layout.legs) - 1}, not {leg}")
    return leg


def _number(arg: Any, where: str) -> float:
    if (kind := member(arg, "type", where)) != "number":
        raise InvalidSequence(f"{where} is a {kind!r}, not a number")
    only(arg, ("type", "name", "value"), where)
    return number(member(arg, "value", where), where)


def _by_argument(kind: CommandKind, numbers: list[float], of_leg: int) -> list[Any]:
    """The joints among the arguments as one list; what is too much comes last. of_leg: joints that the leg has."""
    found: list[Any] = []
    for at, argument in enumerate(kind.arguments):
        if argument is LEG_ANGLES:
            count = of_leg
        elif argument is ALL_ANGLES:
            count = len(numbers) - (len(kind.arguments) - at - 1)
        else:
            count = 1
        taken, numbers = numbers[:count], numbers[count:]
        found += [taken] if argument in (LEG_ANGLES, ALL_ANGLES) else taken
    return [*found, *numbers]
