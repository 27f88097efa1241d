"""A sequence as a file has it, and strict reading of its parts: no booleans for numbers, nothing missing."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.misread import Unreadable, place_of
from footfall.core.strict_json import read_json
from footfall.core.written import how_to_write, number_of, utf8_of
from footfall.sequence.commands import AtRest, Command
from footfall.telemetry.command_kinds import (
    ALL_ANGLES,
    DURATION,
    FORCE,
    KINDS,
    LEG,
    LEG_ANGLES,
    CommandKind,
)
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.state import RobotState


@dataclass(frozen=True)
class ParsedSequence:
    """Name of the robot, commands, and what they start from: posture (legs × 6,) [rad] and T_site_base (4, 4).

    described: legs and joints of a robot that others described; None: of ATHLETE's build, or it isn't said.
    at_rest: how a rover that sags stood before the first; None: the file doesn't say, as of one that is rigid.
    start and T_site_base are None where the format doesn't say. No rule has been asked yet.
    """

    robot: str
    commands: tuple[Command, ...]
    start: Array | None = None
    T_site_base: Array | None = None
    described: JointLayout | None = None
    at_rest: AtRest | None = None


def text_of(data: bytes) -> str:
    """UTF-8 text. Raises InvalidSequence for anything else."""
    try:
        return utf8_of(data)
    except Unreadable as error:
        raise InvalidSequence(f"it is no UTF-8 text: {error}") from error


def json_of(text: str) -> Any:
    """JSON without NaN, two members of one name, and lone surrogates. Raises InvalidSequence."""
    try:
        return read_json(text, _constant)
    except ValueError as error:
        raise InvalidSequence(f"it is no JSON{place_of(error)}") from error


def member(document: object, name: str, where: str) -> Any:
    """A member of a JSON object. Raises InvalidSequence where it is missing."""
    found = members(document, where)
    if name not in found:
        raise InvalidSequence(f"{where} lacks {name!r}")
    return found[name]


def members(item: object, where: str) -> Mapping[str, object]:
    """A JSON object. Raises InvalidSequence."""
    if not isinstance(item, dict):
        raise InvalidSequence(f"{where} must be an object, not {_kind(item)}")
    return item


def only(document: Mapping[str, object], known: Sequence[str], where: str) -> None:
    """Raise InvalidSequence, by name, for members that would be dropped: docs/exports.md lists what may be."""
    strange = [name for name in document if name not in known]
    if strange:
        raise InvalidSequence(
            f"{where} has {', '.join(map(repr, strange))}, which FootFall doesn't know and won't drop; "
            f"it knows {', '.join(known)}",
            unknown=strange,
        )


def require_rows(stated: Sequence[tuple[str, object]]) -> None:
    """Raise InvalidSequence where commands say that they are other rows than they are.

    stated: of each its place in the file, and the row that it says it is, None where it says nothing. Rows count from
    1, in files of 2026-11-25 and before from 0.
    """
    said = [(i, where, whole(row, f"{where}, row")) for i, (where, row) in enumerate(stated) if row is not None]
    first = 0 if said and said[0][2] == said[0][0] else 1
    for i, where, row in said:
        if row != first + i:
            raise InvalidSequence(f"{where} says that it is row {row}: commands are missing or out of order")


def text(item: object, where: str) -> str:
    """A text. Raises InvalidSequence."""
    if not isinstance(item, str):
        raise InvalidSequence(f"{where} must be a text, not {_kind(item)}")
    return item


def items(item: object, where: str) -> list[Any]:
    """A list. Raises InvalidSequence."""
    if not isinstance(item, list):
        raise InvalidSequence(f"{where} must be a list, not {_kind(item)}")
    return item


def number(item: object, where: str) -> float:
    """A finite number. Raises InvalidSequence."""
    if isinstance(item, bool) or not isinstance(item, (int, float)):
        raise InvalidSequence(f"{where} must be a number, not {_kind(item)}")
    try:
        found = float(item)
    except OverflowError:
        found = math.inf
    if math.isnan(found):
        raise InvalidSequence(f"{where} must be a number, not NaN")
    if not math.isfinite(found):
        raise InvalidSequence(f"{where} is too large for a number")
    return found


def whole(item: object, where: str) -> int:
    """A whole number, also written as 2.0. Raises InvalidSequence."""
    found = number(item, where)
    if not found.is_integer():
        raise InvalidSequence(f"{where} must be a whole number, not {found!r}")
    return int(found)


def array(item: object, where: str) -> Array:
    """A flat array of finite numbers. Raises InvalidSequence."""
    return np.array([number(one, f"{where}[{i}]") for i, one in enumerate(items(item, where))], float)


def matrix(item: object, where: str) -> Array:
    """A (4, 4) array of finite numbers. Raises InvalidSequence."""
    rows = [array(row, f"{where}[{i}]") for i, row in enumerate(items(item, where))]
    if [len(row) for row in rows] != [4] * 4:
        raise InvalidSequence(f"{where} must have four rows of four numbers")
    return np.array(rows)


def layout_in(document: Mapping[str, object], where: str) -> JointLayout | None:
    """The member ``layout`` of an object: legs and joints by name; None without it. Raises InvalidSequence."""
    if "layout" not in document:
        return None
    at = f"{where}, layout"
    layout = members(document["layout"], at)
    legs = items(member(layout, "legs", at), f"{at}, legs")
    sliding = items(member(layout, "sliding", at), f"{at}, sliding")
    only(layout, ("legs", "sliding"), at)
    names = [text(member(leg, "name", at), f"{at}, name") for leg in legs]
    joints = [tuple(text(one, f"{at}, joints") for one in items(member(leg, "joints", at), at)) for leg in legs]
    for leg in legs:
        only(leg, ("name", "joints"), at)
    return JointLayout(tuple(names), tuple(joints), tuple(text(one, f"{at}, sliding") for one in sliding))


def with_start(parsed: ParsedSequence, document: Mapping[str, object], where: str) -> ParsedSequence:
    """The same with the members of an object that say from where it starts: ``start``, ``T_site_base``, ``at_rest``.

    Raises InvalidInput where one of the first two is missing, or the last doesn't fit them.
    """
    start = array(member(document, "start", where), f"{where}, start")
    T_site_base = matrix(member(document, "T_site_base", where), f"{where}, T_site_base")
    started = replace(parsed, start=start, T_site_base=T_site_base)
    if "at_rest" not in document:
        return started
    at = f"{where}, at_rest"
    rest = members(document["at_rest"], at)
    only(rest, ("set_points", "joint_torques", "wheel_forces"), at)
    set_points, torques = (array(member(rest, name, at), f"{at}, {name}") for name in ("set_points", "joint_torques"))
    rows = items(member(rest, "wheel_forces", at), f"{at}, wheel_forces")
    forces = [array(row, f"{at}, wheel_forces[{i}]") for i, row in enumerate(rows)]
    if any(len(force) != 3 for force in forces):
        raise InvalidSequence(f"{at}, wheel_forces must have three numbers for each leg")
    feet = np.array(forces).reshape(-1, 3)
    state = RobotState(parsed.robot, 0.0, start, T_site_base, feet, torques, "idle", described=parsed.described)
    return replace(started, at_rest=AtRest(state, set_points))


def decimal(written: str, where: str) -> float:
    """A finite number written in a text field. Raises InvalidSequence."""
    found = number_of(written)
    if found is None:
        raise InvalidSequence(f"{where} must be a number, not {written!r}{how_to_write(written)}")
    return number(found, where)


_READERS = {LEG: whole, LEG_ANGLES: array, ALL_ANGLES: array, DURATION: number, FORCE: number}


def known_kind(name: str, where: str) -> CommandKind:
    """The kind of command of that name. Raises InvalidSequence where the name is unknown."""
    if name not in KINDS:
        raise InvalidSequence(f"{where} is a {name!r}; FootFall knows {', '.join(KINDS)}")
    return KINDS[name]


def command(name: str, arguments: Sequence[object], phase: str, where: str) -> Command:
    """A command from its arguments in the order of its kind, joints as one list.

    Raises InvalidSequence where the name is unknown, or there are more or fewer.
    """
    kind = known_kind(name, where)
    if len(arguments) != len(kind.arguments):
        names = ", ".join(kind.argument_names)
        raise InvalidSequence(f"{where} has {len(arguments)} arguments; {name} takes {names}")
    fields: dict[str, Any] = {"leg": None, "joints": None}
    for argument, item in zip(kind.arguments, arguments, strict=True):
        fields[argument.name] = _READERS[argument](item, f"{where}, {argument.name}")
    return Command(name=name, phase=phase, **fields)


def _kind(item: object) -> str:
    names = {type(None): "null", bool: "a truth value", str: "a text", dict: "an object", list: "a list"}
    return names.get(type(item), "a number")


def _constant(name: str) -> NoReturn:
    raise Unreadable(f"{name} is no number of JSON")
